"""The parameters of a SLAM and its parts as JSON, saved beside every result."""

from __future__ import annotations

import inspect
import math
from functools import partial
from typing import Any

import numpy as np


def configuration(part: Any) -> Any:
    """The constructor parameters of an object by name, recursively.

    As in scikit-learn, a parameter is included if the object stores it under the same name.
    """
    if part is None or isinstance(part, bool | int | str):
        return part
    if isinstance(part, float):
        return part if math.isfinite(part) else str(part)
    if isinstance(part, tuple | list):
        return [configuration(item) for item in part]
    if isinstance(part, np.random.Generator):
        return "random"
    if inspect.isroutine(part) or isinstance(part, type | partial):
        return _made(part)
    names = inspect.signature(type(part).__init__).parameters
    kept = {name: getattr(part, name) for name in names if hasattr(part, name)}
    return {"type": type(part).__name__} | {k: configuration(v) for k, v in kept.items()}


def _made(maker: Any) -> Any:
    """The configuration of what a factory makes; its name if it needs arguments."""
    try:
        inspect.signature(maker).bind()
    except (TypeError, ValueError):
        return getattr(maker, "__qualname__", type(maker).__name__)
    return configuration(maker())
