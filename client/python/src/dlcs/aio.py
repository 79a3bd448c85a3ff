# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio: dlcs.aio.Client has the calls of dlcs.Client as coroutines and asynchronous iterators."""

from typing import Any, AsyncIterator, List, Optional

import grpc
import grpc.aio

from . import messages
from ._calls import Connection, default_server, job_request, methods
from .errors import Error, from_rpc
from .private_server import private_server
from .problem import solve_request, span_and_times
from .solution import Solution


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
        self._connection = Connection(server, token, ca, cert, key)
        self._channel = self._connection.channel(grpc.aio)
        self._methods = methods(self._channel)
        self._timeout = timeout

    async def close(self) -> None:
        await self._channel.close()

    async def __aenter__(self) -> "Client":
        return self

    async def __aexit__(self, *_: Any) -> None:
        await self.close()

    async def call(self, method: str, request: Any) -> Any:
        """A call of the contract with one response. Raises Error."""
        try:
            return await self._methods[method](request, timeout=self._timeout, metadata=self._connection.metadata)
        except grpc.RpcError as error:
            raise from_rpc(error) from None

    async def stream(self, method: str, request: Any) -> AsyncIterator[Any]:
        """A call of the contract with many responses. Raises Error."""
        responses = self._methods[method](request, timeout=self._timeout, metadata=self._connection.metadata)
        try:
            async for response in responses:
                yield response
        except grpc.RpcError as error:
            raise from_rpc(error) from None
        finally:
            responses.cancel()

    async def solve(self, *args: Any, **kwargs: Any) -> Solution:
        """Solves a problem; the arguments are those of dlcs.solve(). The solution knows x at its nodes only."""
        request = solve_request(*args, **kwargs)
        solution = Solution(*span_and_times(kwargs))
        async for event in self.stream("Solve", request):
            solution.add(event)
        return solution.finish()

    async def iterate(self, *args: Any, **kwargs: Any) -> AsyncIterator[Any]:
        """The iterates of a solve as they arrive."""
        async for event in self.stream("Solve", solve_request(*args, **kwargs)):
            if event.WhichOneof("kind") == "iterate":
                yield event.iterate

    async def submit(self, *args: Any, request_id: str = "", priority: int = 0, **kwargs: Any) -> str:
        """Creates a job and returns its name."""
        request = job_request(solve_request(*args, **kwargs), {"request_id": request_id, "priority": priority})
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
        return await self.call("GetSolveJob", messages.GetSolveJobRequest(name=name))

    async def cancel(self, name: str) -> Any:
        """Asks a job to stop."""
        return await self.call("CancelSolveJob", messages.CancelSolveJobRequest(name=name))

    async def delete(self, name: str) -> None:
        """Deletes a job that has ended."""
        await self.call("DeleteSolveJob", messages.DeleteSolveJobRequest(name=name))

    def watch(self, name: str, after: int = 0) -> AsyncIterator[Any]:
        """The SolveEvents of a job, behind the number `after`."""
        return self.stream("WatchSolveJob", messages.WatchSolveJobRequest(name=name, after_sequence=after))

    async def result(self, name: str) -> Solution:
        """Waits for the end of a job and reads its solution."""
        solution = Solution()
        async for event in self.watch(name):
            if event.WhichOneof("kind") == "analysis":
                solution.add(event)
        job = await self.job(name)
        solution.job = name
        if not job.HasField("summary"):
            raise Error(job.error.message or f"{name} solved nothing", "FAILED_PRECONDITION")
        async for page in self.stream("ReadTrajectory", messages.ReadTrajectoryRequest(name=name)):
            if page.chunk.times:
                solution.add_chunk(page.chunk)
        solution.summary = job.summary
        return solution.finish()

    async def capabilities(self) -> Any:
        """Methods and limits of the server."""
        return await self.call("GetCapabilities", messages.GetCapabilitiesRequest())
