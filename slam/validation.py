"""Checks of configurations: raise InputError that says what was wrong and what is allowed."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

import numpy as np

from slam.errors import InputError

MAX_NAMES = 10  # maximum number of names in a message
LARGEST = sys.float_info.max  # a whole number may be larger
LARGEST_WHOLE = 2**63 - 1  # of an int64


def unknown_name(kind: str, name: str, known: Iterable[str], source: str = "") -> str:
    """The message for an unknown `name`: the nearest known names, else the first ten of them.

    kind    kind of object that is named, such as "SLAM variant"
    source  where to find the whole list, such as "slam.variants()"
    """
    names = list(known)
    near = get_close_matches(name, names)
    if near:
        message = f"unknown {kind} {name!r}; did you mean {', '.join(near)}?"
    else:
        more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
        message = f"unknown {kind} {name!r}; known: {', '.join(names[:MAX_NAMES]) or 'none'}{more}"
    return f"{message} (all {len(names)}: {source})" if source else message


def number(name: str, value: Any, low: float = -math.inf, high: float = math.inf) -> None:
    """Check that `value` is a finite number in [low, high]."""
    if _is_number(value, float) and abs(value) <= LARGEST and low <= value <= high:
        return
    span = f" from {low:g} to {high:g}" if high < math.inf else f" of at least {low:g}"
    raise InputError(
        f"{name} must be a finite number{span if low > -math.inf else ''}, got {_shown(value)}"
    )


def positive_number(name: str, value: Any) -> None:
    """Check that `value` is a finite number above zero."""
    if not (_is_number(value, float) and 0 < value <= LARGEST):
        raise InputError(f"{name} must be a finite number above 0, got {_shown(value)}")


def whole_number(name: str, value: Any, low: int) -> None:
    """Check that `value` is an int of at least `low` that fits into 64 bits."""
    if not (_is_number(value, int) and low <= value <= LARGEST_WHOLE):
        raise InputError(f"{name} must be a whole number of at least {low}, got {_shown(value)}")


def one_of(name: str, value: Any, allowed: tuple[Any, ...]) -> None:
    """Check that `value` is one of `allowed`; the error suggests the nearest name."""
    if value not in allowed:
        known = ", ".join(repr(choice) for choice in allowed)
        names = [choice for choice in allowed if isinstance(choice, str)]
        near = get_close_matches(str(value), names, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"{name} must be one of {known}, got {value!r}{hint}")


def function(name: str, value: object) -> None:
    """Check that `value` is callable: a function or a class."""
    if not callable(value):
        raise InputError(f"{name} must be a function or a class, got {value!r}")


def instance(name: str, value: object, kind: type, allowed: str | None = None) -> None:
    """Check that `value` is an instance of `kind`; a class itself is rejected even if its methods
    match a protocol.

    allowed  description for the message, instead of the name of `kind`
    """
    if isinstance(value, type) or not isinstance(value, kind):
        raise InputError(f"{name} must be {allowed or f'a {kind.__name__}'}, got {value!r}")


def finite(name: str, value: Any, columns: int | None = None) -> None:
    """Check that `value` holds finite numbers only, in shape (n, columns) if `columns` is given."""
    array = np.asarray(value)
    if columns is not None and (array.ndim != 2 or array.shape[1] != columns):
        raise InputError(f"{name} must have shape (n, {columns}), got {array.shape}")
    if not (array.dtype.kind in "fiu" and np.isfinite(array).all()):
        raise InputError(f"{name} must hold finite numbers only, got {value!r}")


def within(config: object, field: str, low: float, high: float = math.inf) -> None:
    """Check that the field of `config` is a finite number in [low, high]."""
    number(f"{type(config).__name__}.{field}", getattr(config, field), low, high)


def positive(config: object, *fields: str) -> None:
    """Check that each of the fields of `config` is a finite number above zero."""
    for field in fields:
        positive_number(f"{type(config).__name__}.{field}", getattr(config, field))


def whole(config: object, field: str, low: int) -> None:
    """Check that the field of `config` is an int of at least `low`."""
    whole_number(f"{type(config).__name__}.{field}", getattr(config, field), low)


def _is_number(value: Any, kind: type) -> bool:
    kinds = int if kind is int else int | float
    return isinstance(value, kinds) and not isinstance(value, bool)


def _shown(value: Any) -> str:
    """For a message; Python refuses to write a whole number of thousands of digits."""
    large = _is_number(value, int) and abs(value) > LARGEST_WHOLE
    return "one beyond 64 bits" if large else repr(value)
