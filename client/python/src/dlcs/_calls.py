# SPDX-License-Identifier: Apache-2.0
"""What the synchronous and the asynchronous client share: channels, methods, metadata."""

import json
import math
import os
import random
import time
from typing import Any, Dict, List, Optional, Tuple

import grpc
from grpc.experimental import ChannelOptions

from . import messages
from .errors import Error, FailedPrecondition, ResourceExhausted, Unavailable, invalid, shortened, text, whole

_SERVICES = ("SolverService", "JobService", "ProblemService")

# Calls that change nothing. gRPC repeats them if no server responds, as during the seconds of a restart. It repeats the
# start of a stream; errors later in the stream are left to the caller, who knows what was received.
_READS = {
    "SolverService": ("GetCapabilities", "AnalyzeProblem", "SolveLcp", "SolveDcp"),
    "JobService": ("GetSolveJob", "ListSolveJobs", "WatchSolveJob", "ReadTrajectory", "ReadEnsemble"),
    "ProblemService": ("GetProblem", "ListProblems"),
}
_RETRIES = {
    "methodConfig": [
        {
            "name": [
                {"service": f"dlcs.v1.{service}", "method": method}
                for service, methods in _READS.items()
                for method in methods
            ],
            # After about 0.3, 0.6, 1.2 and 2.4 seconds; gRPC allows no more attempts.
            "retryPolicy": {
                "maxAttempts": 5,
                "initialBackoff": "0.3s",
                "maxBackoff": "3s",
                "backoffMultiplier": 2,
                "retryableStatusCodes": ["UNAVAILABLE"],
            },
        }
    ]
}
_OPTIONS = [
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_send_message_length", -1),
    ("grpc.service_config", json.dumps(_RETRIES)),
    # Each attempt reconnects at once, so that it finds a restarted server instead of failing like the one before.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 500),
]

_process: Optional[int] = None  # the process that has created channels


def check_process() -> None:
    """Raises FailedPrecondition in a fork of a process that has created channels: gRPC's threads are missing there, and
    calls may hang."""
    global _process
    if _process is None:
        _process = os.getpid()
    if _process != os.getpid():
        raise FailedPrecondition(
            "this process was forked from one that had used dlcs, which gRPC does not survive; fork before the first "
            'call, or start processes by the method "spawn"',
            "FAILED_PRECONDITION",
        )


class Connection:
    """Where the server is and how to reach it; the arguments are those of Client. Raises InvalidArgument."""

    def __init__(
        self,
        server: str,
        token: Optional[str] = None,
        ca: Optional[str] = None,
        cert: Optional[str] = None,
        key: Optional[str] = None,
        timeout: Optional[float] = None,
    ):
        if not text("server", server).startswith("unix:") and not _is_port(server.rpartition(":")[2]):
            raise invalid("server", f"{shortened(server)}; must be HOST:PORT or unix:/PATH")
        if (cert is None) != (key is None):
            raise invalid("cert", "must be given together with key")
        if cert is not None and ca is None:
            raise invalid("ca", "must be given where cert is")
        if timeout is not None and not (isinstance(timeout, (int, float)) and 0 < timeout < math.inf):
            raise invalid("timeout", f"{shortened(timeout)}; must be a positive number of seconds, or None")
        local = server.startswith(("unix:", "localhost:", "127.", "[::1]:"))
        if token is not None and not (text("token", token).isascii() and token.isprintable()):
            raise invalid("token", "must consist of printable ASCII characters")
        if token is not None and ca is None and not local:
            raise invalid("token", f"is not sent to {server} without encryption; give ca")
        self.server = server
        self.timeout = timeout
        self.metadata: List[Tuple[str, str]] = [("authorization", f"Bearer {token}")] if token else []
        self._pem = [_pem("ca", ca), _pem("key", key), _pem("cert", cert)]

    def channel(self, module: Any) -> Any:
        """A channel of grpc or grpc.aio. Raises FailedPrecondition after a fork."""
        check_process()
        options = list(_OPTIONS)
        if module is grpc:
            # The caller's thread reads its streams itself. A second thread would need locks, and Ctrl-C just after the
            # caller has acquired one leaves it locked, so that later calls wait forever.
            options.append((ChannelOptions.SingleThreadedUnaryStream, 1))
        if self._pem[0] is None:
            return module.insecure_channel(self.server, options)
        return module.secure_channel(self.server, grpc.ssl_channel_credentials(*self._pem), options)


def _is_port(word: str) -> bool:
    return word.isascii() and word.isdigit() and 0 < int(word) < 65536


def _pem(name: str, file: Any) -> Optional[bytes]:
    """The content of a PEM file."""
    if file is None:
        return None
    try:
        with open(file, "rb") as opened:
            content = opened.read()
    except (OSError, TypeError, ValueError) as error:
        raise invalid(name, f"{shortened(file)}: {error}") from None
    if b"-----BEGIN " not in content:
        raise invalid(name, f"{shortened(file)}: is no PEM file")
    return content


def methods(channel: Any) -> Dict[str, Any]:
    """The calls of all services by their names."""
    result = {}
    for name in _SERVICES:
        service = messages.service(name)
        for method in service.methods:
            proto = _method_proto(service, method.name)
            shape = ("stream" if proto.client_streaming else "unary") + (
                "_stream" if proto.server_streaming else "_unary"
            )
            result[method.name] = getattr(channel, shape)(
                f"/{service.full_name}/{method.name}",
                request_serializer=messages.class_of(method.input_type).SerializeToString,
                response_deserializer=messages.class_of(method.output_type).FromString,
            )
    return result


def _method_proto(service: Any, name: str) -> Any:
    """The proto of a method. In old versions of protobuf only this says whether the method streams."""
    from google.protobuf import descriptor_pb2

    proto = descriptor_pb2.ServiceDescriptorProto()
    service.CopyToProto(proto)
    return next(method for method in proto.method if method.name == name)


def job_request(request: Any, request_id: str, priority: int) -> Any:
    """The CreateSolveJobRequest for a SolveRequest."""
    result = messages.CreateSolveJobRequest(title=request.title)
    result.solve.CopyFrom(request)
    return with_terms(result, request_id, priority)


def with_terms(request: Any, request_id: str, priority: int, deadline: Optional[float] = None) -> Any:
    """`request`, which creates a job, with its fields about the job itself set."""
    request.request_id = text("request_id", request_id)
    request.priority = whole("priority", priority, 32)
    if deadline is not None:
        if not (isinstance(deadline, (int, float)) and 0 < deadline < 1e10):
            raise invalid("deadline", f"{shortened(deadline)}; must be a positive number of seconds, or None")
        request.deadline.FromMicroseconds(int((time.time() + deadline) * 1e6))
    return request


def of_job(request_type: Any, name: str, **fields: Any) -> Any:
    """A request of this type for the job with this name."""
    return request_type(name=text("name", name), **fields)


def check_is_solve(job: Any) -> None:
    if job.HasField("ensemble"):
        raise FailedPrecondition(f"{job.name} is an ensemble: read it with ensemble()", "FAILED_PRECONDITION")


def watch_request(name: str, after: int) -> Any:
    return of_job(messages.WatchSolveJobRequest, name, after_sequence=whole("after", after, 64))


class Attempts:
    """The attempts of one call within its timeout. A busy server refuses a call before it does anything, with the delay
    after which to try again."""

    def __init__(self, timeout: Optional[float], request: Any):
        self._end = math.inf if timeout is None else time.monotonic() + timeout
        self._repeatable = hasattr(request, "SerializeToString")  # an iterator of requests is used up

    def answered(self) -> None:
        """Records a response, after which the call must not be repeated."""
        self._repeatable = False

    def timeout(self) -> Optional[float]:
        """Seconds left; None without a timeout."""
        return None if self._end == math.inf else max(0.0, self._end - time.monotonic())

    def pause(self, error: Error) -> float:
        """Seconds to wait before the next attempt. Raises `error` if it would not help, or would be too late."""
        if not (self._repeatable and isinstance(error, ResourceExhausted) and error.retry_after is not None):
            raise error
        # Random, so that callers that were refused together do not retry together.
        pause = error.retry_after * random.uniform(1, 1.5)
        if time.monotonic() + pause >= self._end:
            raise error
        return pause


class EnsembleFollower:
    """The position of a reader of an ensemble, and the delays of its retries after a broken connection."""

    def __init__(self, name: str, patience: Any):
        if not (isinstance(patience, (int, float)) and patience >= 0):
            raise invalid("patience", f"{shortened(patience)}; must be a number of seconds")
        self.request = of_job(messages.ReadEnsembleRequest, name, follow=True)
        self.complete = False
        self._patience = patience
        self._broken_since: Optional[float] = None
        self._pause = 0.05

    def take(self, page: Any) -> None:
        self.request.resume_token = page.resume_token
        self.complete = page.complete
        self._broken_since, self._pause = None, 0.05

    def pause(self, error: Optional[Error]) -> float:
        """Seconds to wait before the next call, after one that ended with `error` or without one. Raises `error` if a
        retry would not help, or if the patience is exhausted."""
        error = error or Unavailable("the server ended the stream before the ensemble ended", "UNAVAILABLE")
        now = time.monotonic()
        if self._broken_since is None:
            self._broken_since = now
        if not isinstance(error, Unavailable) or now - self._broken_since >= self._patience:
            raise error
        self._pause = min(2 * self._pause, 2.0)
        return self._pause


def default_server() -> Optional[str]:
    """DLCS_SERVER, as for the command line."""
    return os.environ.get("DLCS_SERVER") or None
