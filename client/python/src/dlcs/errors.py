# SPDX-License-Identifier: Apache-2.0
"""Errors of calls. That a system has no solution is not one of them: see Solution.success."""

import numbers
from typing import Any, List, NamedTuple, Optional

from . import messages


class Violation(NamedTuple):
    """A field of the request that breaks a rule."""

    field: str
    description: str  # the value and the rule


class Error(Exception):
    """A call failed.

    Attributes:
      code: the canonical code, such as "INVALID_ARGUMENT".
      violations: the fields that break a rule.
      retry_after: seconds after which to try again; None if that does not help.
    """

    def __init__(
        self,
        text: str,
        code: str = "UNKNOWN",
        violations: Optional[List[Violation]] = None,
        retry_after: Optional[float] = None,
    ):
        super().__init__(text)
        self.code = code
        self.violations = violations or []
        self.retry_after = retry_after


class InvalidArgument(Error, ValueError):
    """The request breaks a rule; `violations` names each field. Correct the request."""


class NotFound(Error, LookupError):
    """There is no such job or problem."""


class AlreadyExists(Error):
    """request_id was used for another request."""


class PermissionDenied(Error):
    """The user lacks a right."""


class Unauthenticated(Error):
    """The token is missing or wrong."""


class ResourceExhausted(Error):
    """A limit of the server."""


class FailedPrecondition(Error):
    """The state of the job does not allow it."""


class DeadlineExceeded(Error, TimeoutError):
    """The deadline of the call passed."""


class Unavailable(Error, ConnectionError):
    """The server cannot be reached, or is shutting down."""


_CLASSES = {
    "INVALID_ARGUMENT": InvalidArgument,
    "OUT_OF_RANGE": InvalidArgument,
    "NOT_FOUND": NotFound,
    "ALREADY_EXISTS": AlreadyExists,
    "PERMISSION_DENIED": PermissionDenied,
    "UNAUTHENTICATED": Unauthenticated,
    "RESOURCE_EXHAUSTED": ResourceExhausted,
    "FAILED_PRECONDITION": FailedPrecondition,
    "DEADLINE_EXCEEDED": DeadlineExceeded,
    "UNAVAILABLE": Unavailable,
}


def shortened(value: Any) -> str:
    """`value` as text for messages, at most 80 characters long."""
    try:
        shown = repr(value)
    except Exception:  # of a class of the caller
        shown = f"<{type(value).__name__}>"
    return shown if len(shown) <= 80 else shown[:77] + "..."


def invalid(field: str, description: str) -> InvalidArgument:
    """The error for an argument that this package refuses itself."""
    return InvalidArgument(f"{field}: {description}", "INVALID_ARGUMENT", [Violation(field, description)])


def text(name: str, value: Any) -> str:
    """`value` if it is text. Raises InvalidArgument."""
    if not isinstance(value, str):
        raise invalid(name, f"{shortened(value)}; must be a string")
    return value


def whole(name: str, value: Any, bits: int) -> int:
    """`value` if it is a whole number of so many bits. Raises InvalidArgument."""
    if not isinstance(value, numbers.Integral) or not -(2 ** (bits - 1)) <= value < 2 ** (bits - 1):
        raise invalid(name, f"{shortened(value)}; must be a whole number of {bits} bits")
    return int(value)


def from_rpc(error: Any) -> Error:
    """The exception for a grpc.RpcError, with the details that the server sent."""
    code = error.code().name
    violations: List[Violation] = []
    retry_after = None
    for key, value in error.trailing_metadata() or ():
        if key != "grpc-status-details-bin":
            continue
        for detail in messages.message("google.rpc.Status").FromString(value).details:
            kind = detail.type_url.rsplit("/", 1)[-1]
            if kind == "google.rpc.BadRequest":
                bad = messages.message(kind).FromString(detail.value)
                violations += [Violation(v.field, v.description) for v in bad.field_violations]
            elif kind == "google.rpc.RetryInfo":
                delay = messages.message(kind).FromString(detail.value).retry_delay
                retry_after = delay.seconds + 1e-9 * delay.nanos
    return _CLASSES.get(code, Error)(error.details() or code, code, violations, retry_after)
