# SPDX-License-Identifier: Apache-2.0
"""From arrays to a SolveRequest."""

import difflib
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np

from . import messages
from .errors import InvalidArgument, invalid, shortened, text
from .sources import time_function

DEFAULT_TOL = 1e-6


_MOST_NUMBERS = 2**27  # of one array: 1 GiB; a message holds less than 2 GiB
_NUMERIC = "biufO"  # kinds of NumPy types; objects are numbers of Python that fit no other type


def numbers(name: str, value: Any, dimensions: int) -> np.ndarray:
    """`value` as an array of real numbers with so many dimensions. Raises InvalidArgument."""
    try:
        array = np.asarray(value)
        if array.dtype.kind == "c":
            raise ValueError("must be real")
        kind = array.dtype.kind
        if kind not in _NUMERIC or (kind == "O" and any(entry is None for entry in array.flat)):
            raise ValueError(shortened(value))
        if np.ma.is_masked(value):
            raise ValueError("has masked entries")
        if array.size > _MOST_NUMBERS:
            raise ValueError(f"{array.size} numbers; at most {_MOST_NUMBERS}, and larger matrices as sparse ones")
        array = np.array(array, dtype=float, ndmin=dimensions)
    except (TypeError, ValueError, OverflowError) as error:
        raise invalid(name, f"is not an array of numbers: {error}") from None
    if array.ndim != dimensions:
        raise invalid(name, f"has {array.ndim} dimensions; must have {dimensions}")
    return array


def _matrix(
    name: str, value: Any, rows: Optional[int], columns: Optional[int], why: str = ""
) -> Tuple[Any, Tuple[int, int]]:
    """The Matrix for an array or a SciPy sparse matrix, and its shape. None for a size: any. `why` ends the error."""
    result = messages.Matrix()
    if hasattr(value, "tocoo"):
        coo = value.tocoo(copy=True)  # the caller's own must not change
        if len(coo.shape) != 2:
            raise invalid(name, f"has {len(coo.shape)} dimensions; must have 2")
        coo.sum_duplicates()
        shape = coo.shape
        result.sparse.rows, result.sparse.columns = shape
        result.sparse.row_indices.extend(coo.row.tolist())
        result.sparse.column_indices.extend(coo.col.tolist())
        result.sparse.values.extend(numbers(name, coo.data, 1))
    else:
        array = numbers(name, value, 2)
        shape = array.shape
        result.dense.rows, result.dense.columns = shape
        result.dense.values.extend(array.ravel())
    if 0 in shape:
        raise invalid(name, "is empty; a system has at least one state and one pair")
    wanted = tuple(have if want is None else want for want, have in zip((rows, columns), shape))
    if shape != wanted:
        raise invalid(name, f"is {shape[0]} x {shape[1]}; must be {wanted[0]} x {wanted[1]}{why}")
    return result, shape


def _set_options(options: Any, given: dict) -> None:
    """The fields of SolveOptions by their names; `method` also as "event-driven"."""
    fields = options.DESCRIPTOR.fields_by_name
    for name, value in given.items():
        field = fields.get(name)
        if name == "output_times":
            raise invalid(name, "is not an option; did you mean t_eval?")
        if field is None:
            near = difflib.get_close_matches(name, fields, 1)
            raise invalid(name, "is not an option" + (f"; did you mean {near[0]}?" if near else ""))
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
                options.grid_times.times.extend(value)
            elif field.message_type is not None:
                getattr(options, name).CopyFrom(type(getattr(options, name))(**value))
            elif field.label == field.LABEL_REPEATED:
                getattr(options, name).extend(value)
            else:
                setattr(options, name, value)
        except (TypeError, ValueError, AttributeError) as error:
            raise invalid(name, f"{shortened(value)}: {error}") from None


def tolerance(value: Any, name: str = "tol", may_be_zero: bool = False) -> float:
    """`value` if it is a positive number, or zero if that may be. Raises InvalidArgument."""
    try:
        tol = float(numbers(name, value, 0))
    except (InvalidArgument, TypeError):
        tol = np.nan
    if not (0 < tol < np.inf or (may_be_zero and tol == 0)):
        rule = "a number at least 0" if may_be_zero else "a positive number"
        raise invalid(name, f"{shortened(value)}; must be {rule}")
    return tol


class Problem:
    """A problem with its horizon, as read_deck() makes it. It takes the place of A, B, N, M, f, g, x0 and t_span.

    Attributes:
      message: the Problem message of the contract.
      title: its title.
      notes: what was ignored or assumed when it was read.
    """

    def __init__(self, message: Any, title: str = "", notes: Sequence[str] = ()):
        self.message = message
        self.title = title
        self.notes = list(notes)

    def __repr__(self) -> str:
        return f"<dlcs.Problem: {self.title or 'untitled'}; t from 0 to {self.message.horizon!r}>"


def solve_request(A: Any, *args: Any, **kwargs: Any) -> Any:
    """The SolveRequest of a linear problem; the arguments are those of dlcs.solve()."""
    if "rtol" in kwargs:  # as SciPy calls it
        if kwargs.get("tol") is not None:
            raise invalid("rtol", "is another name of tol; give one of them")
        kwargs["tol"] = kwargs.pop("rtol")
    if isinstance(A, Problem):
        if args:
            raise invalid("B", "is part of the problem")
        return _request_of_problem(A, **kwargs)
    return _request_of_arrays(A, *args, **kwargs)


def _request_of_problem(
    problem: Problem,
    *,
    t_eval: Optional[Sequence[float]] = None,
    tol: Optional[float] = None,
    atol: Any = None,
    title: str = "",
    **options: Any,
) -> Any:
    for name in ("B", "N", "M", "f", "g", "E", "x0", "t_span", "breaks", "rule", "outputs", "parameters"):
        if name in options:
            raise invalid(name, "is part of the problem")
    request = messages.SolveRequest(title=text("title", title) or problem.title)
    request.problem.CopyFrom(problem.message)
    _set_run(request, options, tol, atol, t_eval, 0.0)
    return request


def _outputs(given: Any, m: int, n: int, begin: float, end: float, tol: float) -> Any:
    """The Outputs for {name: (row over x, row over y, h)}, of which the last ones may be missing or None."""
    if not isinstance(given, dict):
        raise invalid("outputs", f"{shortened(given)}; must be a dictionary of names and rows")
    rows, names, h = [np.zeros((len(given), m)), np.zeros((len(given), n))], [], []
    for k, (name, parts) in enumerate(given.items()):
        field = f"outputs[{shortened(name)}]"
        names.append(text(field, name))
        if not isinstance(parts, (tuple, list)) or not 1 <= len(parts) <= 3:
            raise invalid(field, f"{shortened(parts)}; must be (row over x, row over y, h)")
        for matrix, row, size in zip(rows, parts, (m, n)):
            if row is None:
                continue
            values = numbers(field, row, 1)
            if values.size != size:
                raise invalid(field, f"has a row of {values.size}; must have {size}")
            matrix[k] = values
        last = parts[2] if len(parts) == 3 else None
        h.append(0.0 if last is None else last)
    result = messages.Outputs(names=names)
    if names:
        for target, matrix in zip((result.c, result.d), rows):
            target.CopyFrom(_matrix("outputs", matrix, *matrix.shape)[0])
        result.h.CopyFrom(time_function("outputs", h, len(h), begin, end, tol, ()))
    return result


def add_parameters(target: Any, field: str, given: Any) -> None:
    """Adds {name: value} to a list of Parameter messages; None adds nothing."""
    if given is None:
        return
    if not isinstance(given, dict):
        raise invalid(field, f"{shortened(given)}; must be a dictionary of names and values")
    for name, value in given.items():
        number = numbers(f"{field}[{shortened(name)}]", value, 0)
        target.add(name=text(field, name), value=float(number))


def _request_of_arrays(
    A: Any,
    B: Any,
    N: Any,
    M: Any,
    f: Any = None,
    g: Any = None,
    *,
    x0: Any,
    t_span: Sequence[float],
    E: Any = None,
    t_eval: Optional[Sequence[float]] = None,
    tol: Optional[float] = None,
    atol: Any = None,
    breaks: Sequence[float] = (),
    rule: Optional[str] = None,
    outputs: Any = None,
    parameters: Any = None,
    title: str = "",
    **options: Any,
) -> Any:
    x0 = numbers("x0", x0, 1)
    m = x0.size
    if m == 0:
        raise invalid("x0", "is empty; must have a value for each state")
    span = numbers("t_span", t_span, 1)
    if span.size != 2 or not (np.all(np.isfinite(span)) and span[0] < span[1]):
        raise invalid("t_span", f"{shortened(t_span)}; must be (begin, end) with begin < end")
    begin, end = map(float, span)
    breaks = numbers("breaks", breaks, 1)
    if not np.all(np.isfinite(breaks)):
        raise invalid("breaks", "must be finite")
    accuracy = DEFAULT_TOL if tol is None else tolerance(tol)

    request = messages.SolveRequest(title=text("title", title))
    problem = request.problem
    a, _ = _matrix("A", A, m, m, f", since x0 has {m} value{'' if m == 1 else 's'}")
    matrix_m, (n, _) = _matrix("M", M, None, None)
    matrix_m, _ = _matrix("M", M, n, n)
    b, _ = _matrix("B", B, m, n)
    matrix_n, _ = _matrix("N", N, n, m)
    for target, value in ((problem.a, a), (problem.b, b), (problem.n, matrix_n), (problem.m, matrix_m)):
        target.CopyFrom(value)
    if E is not None:
        mass, _ = _matrix("E", E, m, m)
        problem.e.CopyFrom(mass)
    problem.x0.extend(x0)
    problem.horizon = end - begin
    problem.break_points.extend(sorted(float(t) - begin for t in breaks if begin < t < end))
    problem.f.CopyFrom(time_function("f", f, m, begin, end, accuracy, breaks))
    problem.g.CopyFrom(time_function("g", g, n, begin, end, accuracy, breaks))
    if rule is not None:
        name = "SOLUTION_RULE_" + text("rule", rule).upper().replace("-", "_")
        try:
            problem.rule = messages.enum_value("SolutionRule", name)
        except KeyError:
            raise invalid("rule", f'"{rule}" is unknown; for example "unique", "least-element", "least-norm"') from None
    add_parameters(problem.parameters, "parameters", parameters)
    if outputs is not None:
        problem.outputs.CopyFrom(_outputs(outputs, m, n, begin, end, accuracy))
    _set_run(request, options, tol, atol, t_eval, begin)
    return request


def _set_run(
    request: Any, options: dict, tol: Optional[float], atol: Any, t_eval: Optional[Sequence[float]], begin: float
) -> None:
    """How the problem of the request is solved."""
    if "grid_times" in options:  # times of the caller, whose span may begin anywhere
        options["grid_times"] = numbers("grid_times", options["grid_times"], 1) - begin
    _set_options(request.options, options)
    if tol is not None:
        request.options.error_tolerance = tolerance(tol)
    if isinstance(atol, dict):
        for name, value in atol.items():
            of_one = tolerance(value, f"atol[{shortened(name)}]", True)
            request.options.absolute_tolerances.add(name=text("atol", name), tolerance=of_one)
    elif atol is not None:
        request.options.absolute_tolerance = tolerance(atol, "atol", True)
    if t_eval is not None:
        set_output_times(request, t_eval, begin)


def span_and_times(arguments: Dict[str, Any]) -> Tuple[float, Optional[np.ndarray]]:
    """The begin of t_span, and t_eval, of the arguments of a valid solve_request()."""
    times = arguments.get("t_eval")
    begin = float(arguments["t_span"][0]) if "t_span" in arguments else 0.0
    return begin, None if times is None else np.atleast_1d(np.asarray(times, dtype=float))


def set_output_times(request: Any, times: Sequence[float], begin: float, name: str = "t_eval") -> None:
    """Sets the output times. They are times of the caller, which must increase and lie in the span."""
    times = numbers(name, times, 1)
    # Of a periodic solution one period is returned.
    horizon = request.options.period if request.options.period > 0 else request.problem.horizon
    end = begin + horizon
    if times.size == 0:
        raise invalid(name, "is empty; must have a time")
    if not np.all(np.isfinite(times)):
        raise invalid(name, "must be finite")
    if not np.all(np.diff(times) > 0):
        raise invalid(name, "must increase")
    if not (begin <= times[0] and times[-1] <= end):
        raise invalid(name, f"{float(times[0])!r} to {float(times[-1])!r}; must lie in [{begin!r}, {end!r}]")
    del request.options.output_times[:]
    request.options.output_times.extend(np.minimum(times - begin, horizon))


def request_at(request: Any, times: np.ndarray, begin: float) -> Any:
    """The same SolveRequest with other output times; errors name them "t"."""
    result = type(request)()
    result.CopyFrom(request)
    result.request_id = ""
    set_output_times(result, times, begin, "t")
    return result
