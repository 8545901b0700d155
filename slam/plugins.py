"""Entry points: objects that other installed packages register under a name."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any


def load_entry_points(
    group: str, known: Callable[[str], bool], register: Callable[[str, Any], None]
) -> None:
    """Register the objects of all entry points of a group, except for known names.

    One that fails to load is skipped with a warning, so that the others still load.
    """
    for entry in entry_points(group=group):
        if known(entry.name):
            continue
        try:
            register(entry.name, entry.load())
        except Exception as error:
            warnings.warn(f"{group} {entry.name!r} ({entry.value}): {error}", stacklevel=2)
