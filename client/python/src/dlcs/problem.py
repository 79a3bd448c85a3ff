# SPDX-License-Identifier: Apache-2.0
"""From arrays to a SolveRequest."""

import difflib
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np

from . import messages
from .errors import invalid
from .sources import time_function

DEFAULT_TOL = 1e-6


def numbers(name: str, value: Any, dimensions: int) -> np.ndarray:
    """`value` as an array of real numbers with so many dimensions. Raises InvalidArgument."""
    try:
        array = np.asarray(value)
        if np.iscomplexobj(array):
            raise ValueError("must be real")
        array = np.array(array, dtype=float, ndmin=dimensions)
    except (TypeError, ValueError) as error:
        raise invalid(name, f"is no array of numbers: {error}") from None
    if array.ndim != dimensions:
        raise invalid(name, f"has {array.ndim} dimensions; must have {dimensions}")
    return array


def _matrix(name: str, value: Any, rows: Optional[int], columns: Optional[int]) -> Tuple[Any, Tuple[int, int]]:
    """The Matrix for an array or a SciPy sparse matrix, and its shape. None for a size: any."""
    result = messages.Matrix()
    if hasattr(value, "tocoo"):
        coo = value.tocoo()
        coo.sum_duplicates()
        shape = coo.shape
        result.sparse.rows, result.sparse.columns = shape
        result.sparse.row_indices.extend(map(int, coo.row))
        result.sparse.column_indices.extend(map(int, coo.col))
        result.sparse.values.extend(map(float, coo.data))
    else:
        array = numbers(name, value, 2)
        shape = array.shape
        result.dense.rows, result.dense.columns = shape
        result.dense.values.extend(array.ravel())
    wanted = tuple(have if want is None else want for want, have in zip((rows, columns), shape))
    if shape != wanted:
        raise invalid(name, f"is {shape[0]} x {shape[1]}; must be {wanted[0]} x {wanted[1]}")
    return result, shape


def _set_options(options: Any, given: dict) -> None:
    """The fields of SolveOptions by their names; `method` also as "event-driven"."""
    fields = options.DESCRIPTOR.fields_by_name
    for name, value in given.items():
        field = fields.get(name)
        if field is None:
            near = difflib.get_close_matches(name, fields, 1)
            raise invalid(name, "is no option" + (f"; did you mean {near[0]}?" if near else ""))
        if field.enum_type is not None and isinstance(value, str):
            prefix = next(iter(field.enum_type.values_by_name)).rsplit("UNSPECIFIED", 1)[0]
            full = value if value.startswith(prefix) else prefix + value.upper().replace("-", "_")
            known = field.enum_type.values_by_name
            if full not in known:
                words = [n[len(prefix) :].lower().replace("_", "-") for n in known if not n.endswith("_UNSPECIFIED")]
                raise invalid(name, f'"{value}"; must be one of {", ".join(words)}')
            value = known[full].number
        try:
            if name == "grid_times":
                options.grid_times.times.extend(map(float, value))
            elif field.message_type is not None:
                getattr(options, name).CopyFrom(type(getattr(options, name))(**value))
            elif field.label == field.LABEL_REPEATED:
                getattr(options, name).extend(value)
            else:
                setattr(options, name, value)
        except (TypeError, ValueError, AttributeError) as error:
            raise invalid(name, f"{value!r}: {error}") from error


def solve_request(
    A: Any,
    B: Any,
    N: Any,
    M: Any,
    f: Any = None,
    g: Any = None,
    *,
    x0: Any,
    t_span: Sequence[float],
    t_eval: Optional[Sequence[float]] = None,
    tol: Optional[float] = None,
    breaks: Sequence[float] = (),
    rule: Optional[str] = None,
    title: str = "",
    **options: Any,
) -> Any:
    """The SolveRequest of a linear problem; the arguments are those of dlcs.solve()."""
    x0 = numbers("x0", x0, 1)
    m = x0.size
    if m == 0:
        raise invalid("x0", "is empty; must have a value for each state")
    if len(t_span) != 2 or not t_span[0] < t_span[1]:
        raise invalid("t_span", f"{tuple(t_span)}; must be (begin, end) with begin < end")
    begin, end = map(float, t_span)

    request = messages.SolveRequest(title=title)
    problem = request.problem
    a, _ = _matrix("A", A, m, m)
    matrix_m, (n, _) = _matrix("M", M, None, None)
    matrix_m, _ = _matrix("M", M, n, n)
    b, _ = _matrix("B", B, m, n)
    matrix_n, _ = _matrix("N", N, n, m)
    for target, value in ((problem.a, a), (problem.b, b), (problem.n, matrix_n), (problem.m, matrix_m)):
        target.CopyFrom(value)
    problem.x0.extend(x0)
    problem.horizon = end - begin
    problem.break_points.extend(sorted(float(t) - begin for t in breaks if begin < t < end))
    accuracy = DEFAULT_TOL if tol is None else float(numbers("tol", tol, 1)[0])
    problem.f.CopyFrom(time_function("f", f, m, begin, end, accuracy, breaks))
    problem.g.CopyFrom(time_function("g", g, n, begin, end, accuracy, breaks))
    if rule is not None:
        name = "SOLUTION_RULE_" + rule.upper().replace("-", "_")
        try:
            problem.rule = messages.enum_value("SolutionRule", name)
        except KeyError:
            raise invalid("rule", f'"{rule}" is unknown; for example "unique", "least-element", "least-norm"') from None
    _set_options(request.options, options)
    if tol is not None:
        _set_options(request.options, {"error_tolerance": tol})
    if t_eval is not None:
        set_output_times(request, t_eval, begin)
    return request


def span_and_times(arguments: Dict[str, Any]) -> Tuple[float, Optional[np.ndarray]]:
    """The begin of t_span, and t_eval, of the arguments of a valid solve_request()."""
    times = arguments.get("t_eval")
    return float(arguments["t_span"][0]), None if times is None else np.atleast_1d(np.asarray(times, dtype=float))


def set_output_times(request: Any, times: Sequence[float], begin: float, name: str = "t_eval") -> None:
    """Asks for the trajectory at these times of the caller, which must increase and lie in the span."""
    times = numbers(name, times, 1)
    end = begin + request.problem.horizon
    if times.size == 0:
        raise invalid(name, "is empty; must have a time")
    if not np.all(np.diff(times) > 0):
        raise invalid(name, "must increase")
    if not (begin <= times[0] and times[-1] <= end):
        raise invalid(name, f"{times[0]!r} to {times[-1]!r}; must lie in [{begin!r}, {end!r}]")
    del request.options.output_times[:]
    request.options.output_times.extend(np.minimum(times - begin, request.problem.horizon))
