# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio: dlcs.aio.Client has the calls of dlcs.Client as coroutines and asynchronous iterators."""

import asyncio
from typing import Any, AsyncIterator, List, Optional

import grpc
import grpc.aio
import numpy as np

from . import messages, solution
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


class Solution(solution.Solution):
    """As dlcs.Solution, but x between the nodes is awaited: `await sol(t)`."""

    async def __call__(self, t: Any) -> np.ndarray:  # type: ignore[override]
        flat, place = self._sorted_times(t)
        x = self._at_nodes(flat)
        return place(x if x is not None else self._between_nodes(flat, await self._repeat()(flat)))


class Client:
    """As dlcs.Client; use it with `async with`."""

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
        self._loop: Optional[asyncio.AbstractEventLoop] = None  # the loop of the channel

    def _method(self, name: str) -> Any:
        check_process()
        if self._closed:
            raise FailedPrecondition("the client is closed", "FAILED_PRECONDITION")
        loop = asyncio.get_running_loop()
        if self._loop is not loop:
            self._loop = loop
            self._channel = self._connection.channel(grpc.aio)
            self._methods = methods(self._channel)
        return self._methods[name]

    async def close(self) -> None:
        self._closed = True
        if self._loop is asyncio.get_running_loop():
            await self._channel.close()

    async def __aenter__(self) -> "Client":
        return self

    async def __aexit__(self, *_: Any) -> None:
        await self.close()

    async def call(self, method: str, request: Any) -> Any:
        """A call of the contract with one response. Raises Error."""
        call = self._method(method)
        attempts = Attempts(self._connection.timeout, request)
        while True:
            try:
                return await call(request, timeout=attempts.timeout(), metadata=self._connection.metadata)
            except grpc.RpcError as error:
                failure = from_rpc(error)
            await asyncio.sleep(attempts.pause(failure))

    async def stream(self, method: str, request: Any) -> AsyncIterator[Any]:
        """A call of the contract with many responses. Raises Error."""
        call = self._method(method)
        attempts = Attempts(self._connection.timeout, request)
        while True:
            responses = call(request, timeout=attempts.timeout(), metadata=self._connection.metadata)
            try:
                async for response in responses:
                    attempts.answered()
                    yield response
                return
            except grpc.RpcError as error:
                failure = from_rpc(error)
            finally:
                responses.cancel()
            await asyncio.sleep(attempts.pause(failure))

    async def solve(self, *args: Any, **kwargs: Any) -> Solution:
        """Solves a problem; the arguments are those of dlcs.solve()."""
        iteration = self.iterate(*args, **kwargs)
        async for _ in iteration:
            pass
        return iteration.solution

    def iterate(self, *args: Any, **kwargs: Any) -> "Iteration":
        """Solves a problem, and yields each iterate as it arrives; the arguments are those of dlcs.solve()."""
        return Iteration(self, solve_request(*args, **kwargs), *span_and_times(kwargs))

    async def submit(self, *args: Any, request_id: str = "", priority: int = 0, **kwargs: Any) -> str:
        """Creates a job and returns its name."""
        request = job_request(solve_request(*args, **kwargs), request_id, priority)
        return (await self.call("CreateSolveJob", request)).name

    async def jobs(self) -> List[Any]:
        """The jobs, newest first."""
        result: List[Any] = []
        request = messages.ListSolveJobsRequest()
        while True:
            page = await self.call("ListSolveJobs", request)
            result.extend(page.jobs)
            if not page.next_page_token:
                return result
            request.page_token = page.next_page_token

    async def job(self, name: str) -> Any:
        """A SolveJob."""
        return await self.call("GetSolveJob", of_job(messages.GetSolveJobRequest, name))

    async def cancel(self, name: str) -> Any:
        """Asks a job to stop."""
        return await self.call("CancelSolveJob", of_job(messages.CancelSolveJobRequest, name))

    async def delete(self, name: str) -> None:
        """Deletes a job that has ended."""
        await self.call("DeleteSolveJob", of_job(messages.DeleteSolveJobRequest, name))

    def watch(self, name: str, after: int = 0) -> AsyncIterator[Any]:
        """The SolveEvents of a job, after the number `after`."""
        return self.stream("WatchSolveJob", watch_request(name, after))

    async def result(self, name: str) -> Solution:
        """Waits for the end of a job and reads its solution."""
        result = Solution()
        async for event in self.watch(name):
            if event.WhichOneof("kind") == "analysis":
                result.add(event)
        job = await self.job(name)
        result.job = name
        check_is_solve(job)
        if not job.HasField("summary"):
            raise Error(job.error.message or f"{name} solved nothing", "FAILED_PRECONDITION")
        async for page in self.stream("ReadTrajectory", of_job(messages.ReadTrajectoryRequest, name)):
            if page.chunk.times:
                result.add_chunk(page.chunk)
        result.summary = job.summary
        return result.finish()

    async def submit_ensemble(
        self,
        members: Any,
        *args: Any,
        request_id: str = "",
        priority: int = 0,
        deadline: Optional[float] = None,
        **kwargs: Any,
    ) -> str:
        """Creates a job for many members and returns its name."""
        request = with_terms(ensemble_request(members, *args, **kwargs), request_id, priority, deadline)
        return (await self.call("CreateEnsembleJob", request)).name

    async def shards(self, name: str, patience: float = 60) -> AsyncIterator[Any]:
        """The results of an ensemble as they are stored, each EnsembleShard once, over broken connections."""
        follower = EnsembleFollower(name, patience)
        while True:
            broken: Optional[Error] = None
            try:
                async for page in self.stream("ReadEnsemble", follower.request):
                    follower.take(page)
                    if page.HasField("shard"):
                        yield page.shard
            except Error as error:
                broken = error
            if follower.complete:
                return
            await asyncio.sleep(follower.pause(broken))

    async def ensemble(self, name: str, patience: float = 60) -> Ensemble:
        """Waits for the end of an ensemble and reads its results."""
        result = Ensemble(await self.job(name))
        async for shard in self.shards(name, patience):
            result.add(shard)
        return result.finish(await self.job(name))

    async def capabilities(self) -> Any:
        """Methods and limits of the server."""
        return await self.call("GetCapabilities", messages.GetCapabilitiesRequest())


class Iteration(solution.IterationBase[Solution]):
    """The iterates of one solve, for `async for`. Iterating over it again solves again."""

    async def __aiter__(self) -> AsyncIterator[Any]:
        result = Solution(self._begin, self._times, self._again)
        async for event in self._client.stream("Solve", self._request):
            result.add(event)
            if event.WhichOneof("kind") == "iterate":
                yield event.iterate
        self._solution = result.finish()

    async def _again(self, times: np.ndarray) -> Solution:
        request = request_at(self._request, times, self._begin)
        result = Solution(self._begin, times)
        async for event in self._client.stream("Solve", request):
            result.add(event)
        return result.finish()
