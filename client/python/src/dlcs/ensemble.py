# SPDX-License-Identifier: Apache-2.0
"""Ensembles as jobs: one system for many initial states, sources or parameters, and what is kept of each member."""

from typing import Any, Dict, List, Optional, Sequence

import numpy as np

from . import messages
from .errors import FailedPrecondition, invalid, shortened, text, whole
from .problem import DEFAULT_TOL, add_parameters, numbers, solve_request, span_and_times, tolerance
from .sources import time_function

MISSING, SOLVED, REACHED, FAILED = range(4)  # as MemberOutcome
_PARTS = ("x0", "f", "g", "t_end", "breaks", "parameters")  # of a member


def ensemble_request(members: Any, *args: Any, keep: Any = None, shard_members: int = 0, **kwargs: Any) -> Any:
    """The CreateEnsembleJobRequest; the arguments are those of Client.submit_ensemble()."""
    columns = _columns(members)
    first = members[0] if columns is None else {name: column[0] for name, column in columns.items()}
    if "x0" not in kwargs and "t_span" in kwargs and "x0" in first:
        kwargs["x0"] = first["x0"]  # required, but not used
    solve = solve_request(*args, **kwargs)
    result = messages.CreateEnsembleJobRequest(title=solve.title)
    try:
        result.results.CopyFrom(messages.KeptResults(**({} if keep is None else keep)))
    except (TypeError, ValueError, AttributeError) as error:
        raise invalid("keep", f"{shortened(keep)}: {error}") from None
    if solve.options.output_times and not result.results.extrema:
        raise invalid("t_eval", 'only the end of each member is kept; with keep={"extrema": True} also the extrema')
    result.shard_members = whole("shard_members", shard_members, 32)
    result.ensemble.problem.CopyFrom(solve.problem)
    result.ensemble.options.CopyFrom(solve.options)
    target = result.ensemble.members
    if columns is not None:
        _add_columns(target, columns, len(solve.problem.x0))
        return result
    begin, _ = span_and_times(kwargs)
    tol = kwargs.get("tol", kwargs.get("rtol"))
    add = _MemberAdder(solve.problem, begin, DEFAULT_TOL if tol is None else tolerance(tol), target)
    for k, part in enumerate(members):
        add(k, part)
    return result


def _columns(members: Any) -> Optional[Dict[str, np.ndarray]]:
    """{"x0": states, one row each, and the name of a parameter: its values}; None for a list of dictionaries."""
    if isinstance(members, (list, tuple)) and any(isinstance(member, dict) for member in members):
        for k, member in enumerate(members):
            if not isinstance(member, dict):
                raise invalid(f"members[{k}]", f"{shortened(member)}; must be a dictionary, as others are")
        return None
    if not isinstance(members, dict):
        return {"x0": _rows("members", members, 2)}
    columns = {
        text("members", name): _rows(f"members[{shortened(name)}]", values, 2 if name == "x0" else 1)
        for name, values in members.items()
    }
    sizes = {name: len(column) for name, column in columns.items()}
    if not sizes:
        raise invalid("members", "is empty; must have a member")
    if len(set(sizes.values())) > 1:
        raise invalid("members", f"has columns of different lengths: {shortened(sizes)}")
    return columns


def _rows(name: str, value: Any, dimensions: int) -> np.ndarray:
    """`value` as an array of real numbers with a row, or a number, for each member."""
    array = numbers(name, value, dimensions)
    if array.size == 0:
        raise invalid("members", "is empty; must have a member")
    if np.ndim(value) != dimensions:
        raise invalid(name, f"has {np.ndim(value)} dimensions; must have {dimensions}, the first of them the members")
    return array


def _add_columns(target: Any, columns: Dict[str, np.ndarray], m: int) -> None:
    states = columns.get("x0")
    if states is not None and states.shape[1] != m:
        raise invalid("members", f"has states of {states.shape[1]} values; must have {m}")
    parameters = [(name, column.tolist()) for name, column in columns.items() if name != "x0"]
    count = len(next(iter(columns.values())))
    for k in range(count):
        member = target.add()
        if states is not None:
            member.x0.extend(states[k].tolist())
        for name, values in parameters:
            member.parameters.add(name=name, value=values[k])


class _MemberAdder:
    """Adds members to a request."""

    def __init__(self, problem: Any, begin: float, tol: float, target: Any):
        self._begin = begin
        self._tol = tol
        self._target = target
        self._horizon = problem.horizon
        self._breaks = [t + begin for t in problem.break_points]
        self._m = len(problem.x0)
        self._n = problem.m.dense.rows or problem.m.sparse.rows

    def __call__(self, k: int, part: Dict[str, Any]) -> None:
        field = f"members[{k}]"
        member = self._target.add()
        for name in part:
            if name not in _PARTS:
                raise invalid(field, f"has {shortened(name)}; only {', '.join(_PARTS)} may differ")
        end = self._begin + self._horizon
        if "t_end" in part:
            end = float(numbers(f"{field}.t_end", part["t_end"], 0))
            member.horizon = end - self._begin
            if not 0 < member.horizon < np.inf:
                raise invalid(f"{field}.t_end", f"{end!r}; must be after {self._begin!r}")
        breaks: Sequence[float] = self._breaks
        if "breaks" in part:
            breaks = numbers(f"{field}.breaks", part["breaks"], 1).tolist()
            member.break_points.times.extend(sorted(t - self._begin for t in breaks if self._begin < t < end))
        if "x0" in part:
            x0 = numbers(f"{field}.x0", part["x0"], 1)
            if x0.size != self._m:
                raise invalid(f"{field}.x0", f"has {x0.size} values; must have {self._m}")
            member.x0.extend(x0.tolist())
        for name, size in (("f", self._m), ("g", self._n)):
            if name in part:
                source = time_function(f"{field}.{name}", part[name], size, self._begin, end, self._tol, breaks)
                getattr(member, name).CopyFrom(source)
        add_parameters(member.parameters, f"{field}.parameters", part.get("parameters"))


class Ensemble:
    """What is kept of the members of an ensemble that is a job.

    Attributes:
      columns: names of the values that are kept: "t", "error", and of states, pairs and outputs their own or "x1",
        "y1", "w1"; with extrema also "min(x1)" and "max(x1)".
      values: k x columns, a row for each of the k members; NaN if a member has none.
      x, y, w: k x kept components, at the end of each member.
      t, error: k times reached, and estimated errors relative to the size of each component, NaN if not known.
      outputs: for each output that is kept its name and k values.
      outcomes: for each member SOLVED, REACHED (no error is known, and none is estimated), FAILED, or MISSING where the
        job ended before (dlcs.ensemble.SOLVED, ...).
      failures: why members failed, of the first 10 of every shard: {member: text}.
      success: all members are solved or reached.
      message: how many are what and, if the job did not succeed, why.
      job: the name of the job.
      state: how it ended: "SUCCEEDED", "FAILED" or "CANCELLED".
    """

    def __init__(self, job: Any):
        if not job.HasField("ensemble"):
            raise FailedPrecondition(f"{job.name} is not an ensemble", "FAILED_PRECONDITION")
        about = job.ensemble
        self.columns = column_names(about.columns)
        self.values = np.full((about.members, len(self.columns)), np.nan)
        self.outcomes = np.zeros(about.members, dtype=np.int8)
        self.failures: Dict[int, str] = {}
        self._columns = [(column.quantity, column.statistic) for column in about.columns]
        self.job = job.name

    def add(self, shard: Any) -> None:
        """Takes an EnsembleShard; they come in any order."""
        rows = slice(shard.first_member, shard.first_member + len(shard.outcomes))
        self.outcomes[rows] = np.asarray(shard.outcomes)
        self.values[rows] = np.asarray(shard.values).reshape(len(shard.outcomes), len(self.columns))
        self.failures.update((failure.member, failure.message) for failure in shard.failures)

    def finish(self, job: Any) -> "Ensemble":
        """Takes the job as it ended."""
        self.state = messages.enum_name("JobState", job.state)[len("JOB_STATE_") :]
        self.t, self.error = self._final("TIME")[:, 0], self._final("ERROR")[:, 0]
        self.x, self.y, self.w = self._final("X"), self._final("Y"), self._final("W")
        outputs = self._final("OUTPUT")
        names = [self.columns[k] for k in self._places("OUTPUT")]
        self.outputs = {name: outputs[:, k] for k, name in enumerate(names)}
        counts = np.bincount(self.outcomes, minlength=FAILED + 1)
        self.success = bool(counts[MISSING] == 0 and counts[FAILED] == 0)
        words = ((SOLVED, "solved"), (REACHED, "reached"), (FAILED, "failed"), (MISSING, "missing"))
        self.message = ", ".join(f"{counts[kind]} {word}" for kind, word in words if counts[kind]) or "no members"
        if self.state != "SUCCEEDED":
            self.message += f"; {self.state}" + (f": {job.error.message}" if job.error.message else "")
        return self

    def _places(self, quantity: str) -> List[int]:
        wanted = (_number("Quantity", f"QUANTITY_{quantity}"), _number("Statistic", "STATISTIC_FINAL"))
        return [k for k, column in enumerate(self._columns) if column == wanted]

    def _final(self, quantity: str) -> np.ndarray:
        return self.values[:, self._places(quantity)]

    def __len__(self) -> int:
        return len(self.outcomes)

    def __getitem__(self, name: str) -> np.ndarray:
        """The values of the column with this name: one for each member."""
        if name not in self.columns:
            raise invalid("name", f"{shortened(name)}; must be one of {', '.join(self.columns)}")
        return self.values[:, self.columns.index(name)]

    def quantiles(self, shares: Any) -> np.ndarray:
        """Quantiles of each column over the members that have it, which is a row for each share from 0 to 1.

        Between two members they are interpolated; NaN if no member has a value.
        """
        wanted = numbers("shares", shares, 1)
        if not np.all((wanted >= 0) & (wanted <= 1)):
            raise invalid("shares", f"{shortened(shares)}; must lie in [0, 1]")
        result = np.full((wanted.size, len(self.columns)), np.nan)
        for k in range(len(self.columns)):
            present = self.values[np.isfinite(self.values[:, k]), k]
            if present.size:
                result[:, k] = np.quantile(present, wanted)
        return result

    def __repr__(self) -> str:
        return f"<dlcs.Ensemble: {self.message}>"


def _number(enum: str, name: str) -> int:
    return messages.EnsembleColumn.DESCRIPTOR.enum_types_by_name[enum].values_by_name[name].number


def column_names(columns: Sequence[Any]) -> List[str]:
    """A name of its own for each EnsembleColumn, the same as those of `dlcs result`."""
    smallest, largest = _number("Statistic", "STATISTIC_SMALLEST"), _number("Statistic", "STATISTIC_LARGEST")
    taken = {"member", "outcome", "message"}
    names: List[str] = []
    name = ""
    before: Optional[Any] = None
    for column in columns:
        key = (column.quantity, column.component)
        same = before is not None and key == before[:2] and column.statistic != before[2]
        if not same:
            plain, kind = _plain_name(column)
            name, tries = plain, 0
            while taken & {name, f"min({name})", f"max({name})"}:
                tries += 1
                name = f"{kind}:{plain}" if tries == 1 else f"{kind}:{plain}:{tries}"
            taken |= {name, f"min({name})", f"max({name})"}
        shown = {smallest: f"min({name})", largest: f"max({name})"}
        names.append(shown.get(column.statistic, name))
        before = (*key, column.statistic)
    return names


def _plain_name(column: Any) -> Any:
    """The name of a component that may be taken, and its kind."""
    own, number = column.name, column.component + 1
    by_quantity = {
        _number("Quantity", "QUANTITY_TIME"): ("t", "output"),
        _number("Quantity", "QUANTITY_ERROR"): ("error", "output"),
        _number("Quantity", "QUANTITY_X"): (own or f"x{number}", "x"),
        _number("Quantity", "QUANTITY_Y"): (own or f"y{number}", "y"),
        _number("Quantity", "QUANTITY_W"): (f"w({own})" if own else f"w{number}", "w"),
    }
    return by_quantity.get(column.quantity, (own or f"output{number}", "output"))
