# SPDX-License-Identifier: Apache-2.0
"""The result of a solve, shaped like that of scipy.integrate.solve_ivp."""

from typing import Any, Callable, Dict, Generic, List, Optional, Tuple, TypeVar

import numpy as np

from . import messages
from .errors import Error, FailedPrecondition, invalid
from .problem import numbers


class Solution:
    """A solved system.

    Attributes:
      t: k times.
      x: m x k states.
      y, w: n x k; at break points and at the start the right limits.
      outputs: for each output of the problem its name and k values, right limits as of y.
      measurements: for each measurement of the problem its name and value; None if it does not occur, and
        summary.measurements says why.
      left_limits: (time, y, w) where the left limits of y, w or an output differ.
      t_events: the switching times; the first is the begin of the span.
      status: 0 if the end was reached, -1 otherwise.
      success: the answer may be used: its error was controlled or estimated, and nothing contradicts it.
      message: the verdict in one line.
      error: the estimated error relative to the size of each component; NaN if it is not known. accuracy.named lists
        the components that are zero or negligible, and those that missed the tolerance.
      certificate, accuracy, verdict, summary, analysis: the messages of the contract.
      job: the name of the job, if the solve ran as one.
    """

    def __init__(
        self,
        begin: float = 0.0,
        times: Optional[np.ndarray] = None,
        again: Optional[Callable[[np.ndarray], "Solution"]] = None,
    ):
        self._begin = begin
        self._times = times
        self._again = again
        self._chunks: List[Any] = []
        self.summary: Any = None
        self.analysis: Any = None
        self.job = ""

    def add(self, event: Any) -> None:
        """Takes a SolveEvent."""
        kind = event.WhichOneof("kind")
        if kind == "trajectory":
            self.add_chunk(event.trajectory)
        elif kind == "summary":
            self.summary = event.summary
        elif kind == "analysis":
            self.analysis = event.analysis
        elif kind == "accepted":
            self.job = event.accepted.job

    def add_chunk(self, chunk: Any) -> None:
        """Takes a TrajectoryChunk; they come in order."""
        self._chunks.append(chunk)

    def finish(self) -> "Solution":
        """Assembles the trajectory. Raises Error if the stream ended early."""
        if self.summary is None:
            raise Error("the server ended the stream without a summary", "DATA_LOSS")
        times = [t for chunk in self._chunks for t in chunk.times]
        if len(times) != self.summary.times:
            raise Error(f"{len(times)} times were received of {self.summary.times}", "DATA_LOSS")

        def rows(field: str) -> np.ndarray:
            flat = np.concatenate([np.asarray(getattr(c, field), dtype=float) for c in self._chunks] or [np.empty(0)])
            return flat.reshape(len(times), -1).T if times else flat.reshape(0, 0)

        if self._times is not None:
            self.t = self._times[: len(times)]  # the caller's own, not rounded by a shift
        else:
            self.t = np.asarray(times) + self._begin
        self.x, self.y, self.w = rows("x"), rows("y"), rows("w")
        names = self.analysis.output_names if self.analysis is not None else []
        self.outputs: Dict[str, np.ndarray] = dict(zip(names, rows("outputs")))
        self.measurements: Dict[str, Optional[float]] = {
            one.name: one.value if one.HasField("value") else None for one in self.summary.measurements
        }
        self.left_limits = [
            (self.t[limit.index], np.asarray(limit.y), np.asarray(limit.w))
            for chunk in self._chunks
            for limit in chunk.left_limits
        ]
        self._chunks = []
        self.t_events = np.array([event.time for event in self.summary.switching_times]) + self._begin
        self._share_summary()
        self.error = self.accuracy.error if self.accuracy.HasField("error") else float("nan")
        self.success = self.verdict.success
        reached = messages.enum_value("Termination", "TERMINATION_REACHED_END")
        self.status = 0 if self.summary.termination == reached else -1
        self.message = self.verdict.text
        if self.status != 0:
            self.message += f": {self.summary.message}"
        return self

    def _share_summary(self) -> None:
        self.verdict = self.summary.verdict
        self.accuracy = self.summary.accuracy
        self.certificate = self.summary.certificate

    def __call__(self, t: Any) -> np.ndarray:
        """x at the times t: m values for a number, m x k for a list of k times in any order.

        Between nodes x is not interpolated here: the server solves once more with these output times, so that the
        tolerance holds at each of them. Cost: a solve for each call, however many times it has.

        Raises InvalidArgument: t is no number or list, or outside the span or the part that was solved; or x is wanted
        between nodes of a solution that does not know its problem, as that of a job or a copy from another process.
        """
        flat, place = self._sorted_times(t)
        x = self._at_nodes(flat)
        return place(x if x is not None else self._between_nodes(flat, self._repeat()(flat)))

    @property
    def sol(self: "_Solution") -> "_Solution":
        """This solution, for programs that evaluate `sol.sol(t)` of the result of solve_ivp."""
        return self

    def _sorted_times(self, t: Any) -> Tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        """The distinct times in t, and a function that arranges columns for them in the order of t."""
        is_list = isinstance(t, (list, tuple, range)) or bool(getattr(t, "shape", ()))
        times = numbers("t", t, 1 if is_list else 0)
        if not np.all(np.isfinite(times)):
            raise invalid("t", "must be finite")
        flat, inverse = np.unique(times.ravel(), return_inverse=True)

        def place(x: np.ndarray) -> np.ndarray:
            columns = x[:, inverse.ravel()]
            return columns[:, 0] if times.ndim == 0 else columns

        return flat, place

    def _at_nodes(self, times: np.ndarray) -> Optional[np.ndarray]:
        """x if all times are nodes."""
        here = {float(time): k for k, time in enumerate(self.t)}
        if all(float(time) in here for time in times):
            return self.x[:, [here[float(time)] for time in times]]
        return None

    def _repeat(self) -> Callable[[np.ndarray], Any]:
        if self._again is None:
            raise invalid("t", "is not a node, and the problem is not at hand to solve it again")
        return self._again

    @staticmethod
    def _between_nodes(times: np.ndarray, again: "Solution") -> np.ndarray:
        if again.x.shape[1] != times.size:
            raise invalid("t", f"the solution ends before {float(times[-1])!r}")
        return again.x

    def __getstate__(self) -> Dict[str, Any]:
        """The state for copies and other processes: everything except the connection to the problem."""
        state = dict(self.__dict__, _again=None)
        for name in ("verdict", "accuracy", "certificate"):  # parts of the summary
            state.pop(name, None)
        for name in _MESSAGES:
            state[name] = None if state[name] is None else state[name].SerializeToString()
        return state

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(state)
        for name, message in _MESSAGES.items():
            if state[name] is not None:
                setattr(self, name, getattr(messages, message).FromString(state[name]))
        if self.summary is not None:
            self._share_summary()

    def __repr__(self) -> str:
        return f"<dlcs.Solution: {self.message}; {self.t.size} times>"


_MESSAGES = {"summary": "Summary", "analysis": "Analysis"}


_Solution = TypeVar("_Solution", bound=Solution)


class IterationBase(Generic[_Solution]):
    """One solve as an iteration, and its solution once there is one."""

    def __init__(self, client: Any, request: Any, begin: float, times: Optional[np.ndarray]):
        self._client = client
        self._request = request
        self._begin = begin
        self._times = times
        self._solution: Optional[_Solution] = None

    @property
    def solution(self) -> _Solution:
        """The solution. Raises FailedPrecondition before the last iterate has been taken."""
        if self._solution is None:
            raise FailedPrecondition(
                "solution: there is none before the last iterate was taken", "FAILED_PRECONDITION"
            )
        return self._solution
