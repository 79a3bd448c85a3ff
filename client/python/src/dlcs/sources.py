# SPDX-License-Identifier: Apache-2.0
"""f and g as the contract takes them. Callables are fitted by piecewise polynomials."""

import numbers
from typing import Any, Callable, List, Sequence

import numpy as np

from . import messages
from .errors import invalid, shortened

_LARGEST = int(np.finfo(float).max)
_DEGREE = 8
_LEAST_PART = 2.0**-26  # of the horizon, the shortest piece
_MOST_PIECES = 20_000
_FIRST_PIECES = 32
# Chebyshev points of [0, 1], and times between them where a fit is checked.
_NODES = (1 - np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))) / 2
_CHECKS = (1 - np.cos(np.pi * np.arange(1, 2 * _DEGREE + 2, 2) / (2 * _DEGREE + 2) + 0.11)) / 2
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
_AT_CHECKS = np.vander(_CHECKS, _DEGREE + 1, increasing=True) @ _TO_POWERS


def time_function(
    name: str, value: Any, size: int, begin: float, end: float, tol: float, breaks: Sequence[float]
) -> Any:
    """The TimeFunction for f or g on [begin, end], whose time 0 is `begin`.

    Args:
      name: "f" or "g", for errors.
      value: None (zero); `size` numbers; `size` formulas in t, if begin is 0; or a callable t -> `size` numbers.
      tol: the relative error of the answer; a callable is fitted to a tenth of it, relative to the largest value of the
        component.
      breaks: times of the caller at which a callable jumps or has a kink. The value there is the right limit. What is
        narrower than 1/500 of the span between two breaks may be missed.
    Raises:
      InvalidArgument: another shape or type; or the callable is not resolved, with the time.
    """
    result = messages.TimeFunction()
    piece = result.pieces.add()
    if value is None:
        piece.constant.values.extend([0.0] * size)
    elif callable(value):
        _fit(name, value, size, begin, end, tol, breaks, piece.polynomial)
    else:
        entries = _entries(name, value)
        if len(entries) != size:
            raise invalid(name, f"has {len(entries)} components; must have {size}")
        for k, entry in enumerate(entries):
            if not isinstance(entry, (str, numbers.Real)) or (isinstance(entry, int) and abs(entry) > _LARGEST):
                raise invalid(f"{name}[{k}]", f"{shortened(entry)}; must be a number or a formula")
        if any(isinstance(entry, str) for entry in entries):
            if begin != 0:
                raise invalid("t_span", f"begins at {begin!r}; formulas in {name} need a span that begins at 0")
            piece.formulas.formulas.extend(e if isinstance(e, str) else repr(float(e)) for e in entries)
        else:
            piece.constant.values.extend(float(entry) for entry in entries)
    return result


def _entries(name: str, value: Any) -> List[Any]:
    """The components of f or g that is no callable; one alone may be given without brackets."""
    try:
        dimensions = 0 if isinstance(value, str) else np.ndim(value)
    except ValueError as error:  # rows of different lengths
        raise invalid(name, f"{shortened(value)}: {error}") from None
    if dimensions > 1:
        raise invalid(name, f"has {dimensions} dimensions; must have 1")
    if dimensions == 1:
        return list(value)
    return [value.item() if isinstance(value, np.ndarray) else value]


def _fit(
    name: str,
    function: Callable[[float], Any],
    size: int,
    begin: float,
    end: float,
    tol: float,
    breaks: Sequence[float],
    result: Any,
) -> None:
    def at(times: np.ndarray) -> np.ndarray:
        values = np.empty((len(times), size))
        for k, t in enumerate(times):
            t = float(t)
            try:
                returned = function(t)
                value = np.atleast_1d(np.asarray(returned, dtype=float))
            except Exception as error:  # of the caller's function
                raise invalid(name, f"fails at t = {t!r}: {type(error).__name__}: {error}") from error
            if value.shape != (size,):
                raise invalid(name, f"returns shape {value.shape} at t = {t!r}; must be ({size},)")
            if not np.all(np.isfinite(value)):
                raise invalid(name, f"returns {shortened(returned)} at t = {t!r}; must be finite")
            values[k] = value
        return values

    edges = [begin] + sorted(t for t in set(map(float, breaks)) if begin < t < end) + [end]
    allowed = 0.1 * tol * np.abs(at(np.linspace(begin, end, 129)[:-1])).max(axis=0)
    starts: List[float] = []
    coefficients: List[np.ndarray] = []
    for left, right in zip(edges[:-1], edges[1:]):
        ends = np.linspace(left, right, _FIRST_PIECES + 1)
        waiting = list(zip(ends[:-1], ends[1:]))[::-1]
        while waiting:
            a, b = waiting.pop()
            values = at(a + (b - a) * _NODES)
            allowed = np.maximum(allowed, 0.1 * tol * np.abs(values).max(axis=0))
            miss = np.abs(_AT_CHECKS @ values - at(a + (b - a) * _CHECKS)).max(axis=0)
            rounding = 64 * np.finfo(float).eps * np.abs(values).max(axis=0)
            if np.all(miss <= np.maximum(allowed, rounding)):
                starts.append(a)
                coefficients.append((_TO_POWERS @ values) / (b - a) ** np.arange(_DEGREE + 1)[:, None])
                continue
            if b - a < _LEAST_PART * (end - begin) or len(starts) + len(waiting) > _MOST_PIECES:
                raise invalid(
                    name, f"is not resolved near t = {float(a + b) / 2!r}; a jump or a kink there must be in breaks"
                )
            middle = (a + b) / 2
            waiting += [(middle, b), (a, middle)]  # the earlier part is next
    result.breaks.extend(float(t - begin) for t in starts)
    result.breaks.append(float(end - begin))
    for coefficient in coefficients:
        result.coefficients.add().values.extend(coefficient.ravel())
