# SPDX-License-Identifier: Apache-2.0
"""Differential linear complementarity systems, solved by a dlcs server.

    sol = dlcs.solve(A, B, N, M, f, g, x0=[1, 0], t_span=(0, 2), tol=1e-8)
"""

from . import aio
from .client import Client, Iteration, iterate, solve
from .deck import read_deck
from .ensemble import Ensemble
from .errors import (
    AlreadyExists,
    DeadlineExceeded,
    Error,
    FailedPrecondition,
    InvalidArgument,
    NotFound,
    PermissionDenied,
    ResourceExhausted,
    Unauthenticated,
    Unavailable,
    Violation,
)
from .problem import Problem
from .solution import Solution

__all__ = [
    "AlreadyExists",
    "Client",
    "DeadlineExceeded",
    "Ensemble",
    "Error",
    "FailedPrecondition",
    "InvalidArgument",
    "Iteration",
    "NotFound",
    "PermissionDenied",
    "Problem",
    "ResourceExhausted",
    "Solution",
    "Unauthenticated",
    "Unavailable",
    "Violation",
    "aio",
    "iterate",
    "read_deck",
    "solve",
]
