# SPDX-License-Identifier: Apache-2.0
"""What the synchronous and the asynchronous client share: channels, methods, metadata."""

import os
from typing import Any, Dict, List, Optional, Tuple

import grpc

from . import messages
from .errors import invalid

_SERVICES = ("SolverService", "JobService", "ProblemService")
_OPTIONS = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]


class Connection:
    """Where the server is and how to reach it. `ca`, `cert` and `key` are files, PEM."""

    def __init__(
        self,
        server: str,
        token: Optional[str] = None,
        ca: Optional[str] = None,
        cert: Optional[str] = None,
        key: Optional[str] = None,
    ):
        if not server.startswith("unix:") and not server.rpartition(":")[2].isdigit():
            raise invalid("server", f'"{server}"; must be HOST:PORT or unix:/PATH')
        if (cert is None) != (key is None):
            raise invalid("cert", "must be given together with key")
        local = server.startswith(("unix:", "localhost:", "127.", "[::1]:"))
        if token is not None and ca is None and not local:
            raise invalid("token", f"is not sent to {server} without encryption; give ca")
        self.server = server
        self.metadata: List[Tuple[str, str]] = [("authorization", f"Bearer {token}")] if token else []
        self._files = (ca, key, cert)

    def channel(self, module: Any) -> Any:
        """A channel of grpc or grpc.aio."""
        if self._files[0] is None:
            return module.insecure_channel(self.server, _OPTIONS)
        texts = [open(name, "rb").read() if name else None for name in self._files]
        return module.secure_channel(self.server, grpc.ssl_channel_credentials(*texts), _OPTIONS)


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
    """Old versions of protobuf know only here whether a method streams."""
    from google.protobuf import descriptor_pb2

    proto = descriptor_pb2.ServiceDescriptorProto()
    service.CopyToProto(proto)
    return next(method for method in proto.method if method.name == name)


def job_request(request: Any, options: Dict[str, Any]) -> Any:
    """CreateSolveJobRequest of a SolveRequest; `options` has request_id and priority."""
    result = messages.CreateSolveJobRequest(title=request.title, **options)
    result.solve.CopyFrom(request)
    return result


def default_server() -> Optional[str]:
    """DLCS_SERVER, as for the command line."""
    return os.environ.get("DLCS_SERVER") or None
