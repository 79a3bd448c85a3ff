# SPDX-License-Identifier: Apache-2.0
"""The result of a solve, shaped like that of scipy.integrate.solve_ivp."""

from typing import Any, Callable, List, Optional

import numpy as np

from . import messages
from .errors import Error, invalid


class Solution:
    """A solved system.

    Attributes:
      t: k times.
      x: m x k states.
      y, w: n x k; at break points and at the start the right limits.
      left_limits: pairs (time, y, w) where the left limits differ.
      t_events: the switching times; the first is the begin of the span.
      status: 0 if the end was reached, -1 otherwise.
      success: the answer may be used: its error was controlled or estimated, and nothing contradicts it.
      message: the verdict in one line.
      error: the estimated error relative to the size of each component; NaN if it is not known.
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
        self.left_limits = [
            (self.t[limit.index], np.asarray(limit.y), np.asarray(limit.w))
            for chunk in self._chunks
            for limit in chunk.left_limits
        ]
        self._chunks = []
        self.t_events = np.array([event.time for event in self.summary.switching_times]) + self._begin
        self.verdict = self.summary.verdict
        self.accuracy = self.summary.accuracy
        self.certificate = self.summary.certificate
        self.error = self.accuracy.error if self.accuracy.HasField("error") else float("nan")
        self.success = self.verdict.success
        reached = messages.enum_value("Termination", "TERMINATION_REACHED_END")
        self.status = 0 if self.summary.termination == reached else -1
        self.message = self.verdict.text
        if self.status != 0:
            self.message += f": {self.summary.message}"
        return self

    def __call__(self, t: Any) -> np.ndarray:
        """x at the times t: m values for a number, m x k for k times in any order.

        Between nodes x is not interpolated here: the server solves once more with these output times, so that the
        tolerance holds at each of them. Cost: a solve for each call, however many times it has.
        """
        times = np.asarray(t, dtype=float)
        flat, place = np.unique(times.ravel(), return_inverse=True)
        if flat.size == 0:
            return np.empty((self.x.shape[0], 0))
        here = {float(time): k for k, time in enumerate(self.t)}
        if all(float(time) in here for time in flat):
            x = self.x[:, [here[float(time)] for time in flat]]
        else:
            if self._again is None:
                raise invalid("t", "is no node, and the problem is not at hand to solve it again")
            x = self._again(flat).x
            if x.shape[1] != flat.size:
                raise invalid("t", f"the solution ends before {flat[-1]!r}")
        x = x[:, place.ravel()]
        return x[:, 0] if times.ndim == 0 else x

    def __repr__(self) -> str:
        return f"<dlcs.Solution: {self.message}; {self.t.size} times>"
