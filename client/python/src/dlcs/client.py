# SPDX-License-Identifier: Apache-2.0
"""The client: problems in, solutions and jobs out."""

import os
import threading
import time
from typing import Any, Dict, Iterator, List, Optional

import grpc
import numpy as np

from . import messages
from ._calls import (
    Attempts,
    Connection,
    EnsembleFollower,
    check_is_solve,
    check_process,
    default_server,
    job_request,
    methods,
    of_job,
    watch_request,
    with_terms,
)
from .ensemble import Ensemble, ensemble_request
from .errors import Error, FailedPrecondition, from_rpc
from .private_server import private_server
from .problem import request_at, solve_request, span_and_times
from .solution import IterationBase, Solution

_SOLVE_OPTIONS = ("server", "token", "ca", "cert", "key", "timeout", "dlcsd")


class Client:
    """A connection to a dlcsd. Threads may share it; use it as a context manager or close() it.

    Args:
      server: HOST:PORT or unix:/PATH. None: DLCS_SERVER, or else a private server on this machine.
      token: of the user, on servers with users.
      ca, cert, key: PEM files for TLS: the authority of the server, and this client's own certificate.
      timeout: seconds for a call, with the time that a busy server asks to wait; None waits forever.
      dlcsd: the program of a private server.
    """

    def __init__(
        self,
        server: Optional[str] = None,
        *,
        token: Optional[str] = None,
        ca: Optional[str] = None,
        cert: Optional[str] = None,
        key: Optional[str] = None,
        timeout: Optional[float] = None,
        dlcsd: Optional[str] = None,
    ):
        server = server or default_server() or private_server(dlcsd)
        self._connection = Connection(server, token, ca, cert, key, timeout)
        self._closed = False
        self._channel = self._connection.channel(grpc)
        self._methods = methods(self._channel)

    def close(self) -> None:
        self._closed = True
        self._channel.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def call(self, method: str, request: Any) -> Any:
        """Any call of the contract: a response, or an iterator of responses. Raises Error."""
        check_process()
        if self._closed:
            raise FailedPrecondition("the client is closed", "FAILED_PRECONDITION")
        streams = isinstance(self._methods[method], (grpc.UnaryStreamMultiCallable, grpc.StreamStreamMultiCallable))
        return (self._stream if streams else self._unary)(self._methods[method], request)

    def _unary(self, method: Any, request: Any) -> Any:
        attempts = Attempts(self._connection.timeout, request)
        while True:
            try:
                return method(request, timeout=attempts.timeout(), metadata=self._connection.metadata)
            except grpc.RpcError as error:
                failure = from_rpc(error)
            time.sleep(attempts.pause(failure))

    def _stream(self, method: Any, request: Any) -> Iterator[Any]:
        attempts = Attempts(self._connection.timeout, request)
        while True:
            responses = method(request, timeout=attempts.timeout(), metadata=self._connection.metadata)
            try:
                for response in responses:
                    attempts.answered()
                    yield response
                return
            except grpc.RpcError as error:
                failure = from_rpc(error)
            finally:
                responses.cancel()
            time.sleep(attempts.pause(failure))

    def solve(self, *args: Any, **kwargs: Any) -> Solution:
        """Solves a problem; the arguments are those of dlcs.solve()."""
        iteration = self.iterate(*args, **kwargs)
        for _ in iteration:
            pass
        return iteration.solution

    def iterate(self, *args: Any, **kwargs: Any) -> "Iteration":
        """Solves a problem, and yields each iterate as it arrives; the arguments are those of dlcs.solve()."""
        return Iteration(self, solve_request(*args, **kwargs), *span_and_times(kwargs))

    def submit(self, *args: Any, request_id: str = "", priority: int = 0, **kwargs: Any) -> str:
        """Creates a job for a problem and returns its name. The arguments are those of dlcs.solve(), and:

        request_id: the same for every attempt to create the same job.
        priority: order among the user's jobs, higher ones first.
        """
        request = job_request(solve_request(*args, **kwargs), request_id, priority)
        return self.call("CreateSolveJob", request).name

    def jobs(self) -> List[Any]:
        """The jobs, newest first, as SolveJob messages."""
        result: List[Any] = []
        request = messages.ListSolveJobsRequest()
        while True:
            page = self.call("ListSolveJobs", request)
            result.extend(page.jobs)
            if not page.next_page_token:
                return result
            request.page_token = page.next_page_token

    def job(self, name: str) -> Any:
        """A SolveJob."""
        return self.call("GetSolveJob", of_job(messages.GetSolveJobRequest, name))

    def cancel(self, name: str) -> Any:
        """Asks a job to stop; what is solved so far can be read."""
        return self.call("CancelSolveJob", of_job(messages.CancelSolveJobRequest, name))

    def delete(self, name: str) -> None:
        """Deletes a job that has ended."""
        self.call("DeleteSolveJob", of_job(messages.DeleteSolveJobRequest, name))

    def watch(self, name: str, after: int = 0) -> Iterator[Any]:
        """The SolveEvents of a job, after the number `after`; the last one has `summary`."""
        return self.call("WatchSolveJob", watch_request(name, after))

    def result(self, name: str) -> Solution:
        """Waits for the end of a job and reads its solution, the part solved so far if it was stopped.

        Times count from 0, whatever span it was submitted with. Raises Error if the job failed before it solved
        anything.
        """
        solution = Solution()
        for event in self.watch(name):
            if event.WhichOneof("kind") == "analysis":
                solution.add(event)
        job = self.job(name)
        solution.job = name
        check_is_solve(job)
        if not job.HasField("summary"):
            raise Error(job.error.message or f"{name} solved nothing", "FAILED_PRECONDITION")
        for page in self.call("ReadTrajectory", of_job(messages.ReadTrajectoryRequest, name)):
            if page.chunk.times:
                solution.add_chunk(page.chunk)
        solution.summary = job.summary
        return solution.finish()

    def submit_ensemble(
        self,
        members: Any,
        *args: Any,
        request_id: str = "",
        priority: int = 0,
        deadline: Optional[float] = None,
        **kwargs: Any,
    ) -> str:
        """Creates a job that solves a linear problem for many members, and returns its name.

        Args:
          members: a k x m array of initial states; or {"x0": such an array, "NAME": k values of a parameter, ...}; or
            a list of dictionaries of what differs from the problem: x0, f, g, t_end, breaks, parameters={"NAME": 1}.
          further arguments are those of dlcs.solve(), except server and what belongs to it. x0 may be left out where
            the members have it.
          parameters: as for dlcs.solve(), for members without their own.
          keep: fields of KeptResults in jobs.proto, such as {"extrema": True, "x_components": [0, 2]}. None: x, y, w
            and outputs at the end of each member.
          shard_members: members that one server solves at a time; 0: the server chooses.
          request_id, priority: as for submit().
          deadline: seconds from now after which the job ends, with what is solved until then.
        """
        request = with_terms(ensemble_request(members, *args, **kwargs), request_id, priority, deadline)
        return self.call("CreateEnsembleJob", request).name

    def shards(self, name: str, patience: float = 60) -> Iterator[Any]:
        """The results of an ensemble as they are stored, until it ends: each EnsembleShard once.

        The columns of its values are those of job(name).ensemble. After a broken connection it calls again and resumes
        after the last shard, unless no call has succeeded for `patience` seconds.
        """
        follower = EnsembleFollower(name, patience)
        while True:
            broken: Optional[Error] = None
            try:
                for page in self.call("ReadEnsemble", follower.request):
                    follower.take(page)
                    if page.HasField("shard"):
                        yield page.shard
            except Error as error:
                broken = error
            if follower.complete:
                return
            time.sleep(follower.pause(broken))

    def ensemble(self, name: str, patience: float = 60) -> Ensemble:
        """Waits for the end of an ensemble and reads its results, those stored so far if it was stopped.

        `patience` is that of shards().
        """
        result = Ensemble(self.job(name))
        for shard in self.shards(name, patience):
            result.add(shard)
        return result.finish(self.job(name))

    def capabilities(self) -> Any:
        """Methods and limits of the server."""
        return self.call("GetCapabilities", messages.GetCapabilitiesRequest())


class Iteration(IterationBase[Solution]):
    """The iterates of one solve. Iterating over it again solves again."""

    def __iter__(self) -> Iterator[Any]:
        solution = Solution(self._begin, self._times, self._again)
        for event in self._client.call("Solve", self._request):
            solution.add(event)
            if event.WhichOneof("kind") == "iterate":
                yield event.iterate
        self._solution = solution.finish()

    def _again(self, times: np.ndarray) -> Solution:
        request = request_at(self._request, times, self._begin)
        solution = Solution(self._begin, times)
        for event in self._client.call("Solve", request):
            solution.add(event)
        return solution.finish()


_CLIENTS: Dict[Any, Client] = {}
_CLIENTS_LOCK = threading.Lock()


def _renew_lock() -> None:
    """Called in a fork, since another thread may have held the lock when it was made."""
    global _CLIENTS_LOCK
    _CLIENTS_LOCK = threading.Lock()


os.register_at_fork(after_in_child=_renew_lock)


def _split(kwargs: Dict[str, Any]) -> Client:
    """Takes the arguments of Client from those of solve(). One client is kept for each set of them."""
    own = {name: kwargs.pop(name) for name in _SOLVE_OPTIONS if name in kwargs}
    server = own.pop("server", None) or default_server() or private_server(own.get("dlcsd"))
    key = repr((server, sorted(own.items())))
    with _CLIENTS_LOCK:
        if key not in _CLIENTS:
            _CLIENTS[key] = Client(server, **own)
        return _CLIENTS[key]


def solve(A: Any, *args: Any, **kwargs: Any) -> Solution:
    """Solves x' = A x + B y + f(t), 0 <= y, w = N x + g(t) + M y >= 0, y'w = 0, x(begin) = x0.

    solve(A, B, N, M, f=None, g=None, ...), or solve(problem, ...) with a Problem in place of these, x0, t_span, E,
    breaks, rule and outputs.

    Args:
      A, B, N, M: m x m, m x n, n x m and n x n arrays or SciPy sparse matrices.
      f, g: m and n numbers, formulas in t ("sin(3*t)"), a callable t -> array, or None for zero.
      x0: m values.
      t_span: (begin, end).
      E: m x m, nonsingular: solves E x' = A x + B y + f(t). The identity if None.
      t_eval: the times of the result, increasing; every node of the grid if not given.
      tol, or rtol: the largest error of each component of x, y, w and the outputs, relative to its largest value; 1e-6
        if neither it nor steps are given.
      atol: an absolute error that is accepted too: a number for all components, or {name: number} for states, pairs and
        outputs by their names.
      breaks: times at which f or g, if callable, jumps or has a kink.
      rule: which y to take if there are several, such as "least-element".
      parameters: {name: value} of the formulas in f, g and outputs.
      outputs: further quantities of the result, {name: (row over x, row over y, h)} for each row x + row y + h(t); h is
        a number or a formula, and what comes last may be left out.
      server, token, ca, cert, key, timeout, dlcsd: those of Client.
      Any option of SolveOptions by its name: method="event-driven", steps=1000, theta=0.5, ...

    Returns:
      A Solution. Its `success` and `message` report whether and how well the system was solved.

    Raises:
      Error: the call failed; InvalidArgument names the field and the rule.
    """
    client = _split(kwargs)
    return client.solve(A, *args, **kwargs)


def iterate(A: Any, *args: Any, **kwargs: Any) -> Iteration:
    """As solve(), but yields each iterate as it arrives; `solution` of the returned object is set at the end."""
    client = _split(kwargs)
    return client.iterate(A, *args, **kwargs)
