"""Entry points: what other installed packages register under a name."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any


def load_entry_points(
    group: str, known: Callable[[str], bool], register: Callable[[str, Any], None]
) -> None:
    """Register the objects of all entry points of a group, but for the names that are known.

    One that does not load is left out with a warning: it is no reason for the others to fail.
    """
    for entry in entry_points(group=group):
        if known(entry.name):
            continue
        try:
            register(entry.name, entry.load())
        except Exception as error:
            warnings.warn(f"{group} {entry.name!r} ({entry.value}): {error}", stacklevel=2)
