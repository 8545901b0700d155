"""What measurements have in common: rows of figures, and a bar that follows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol, TypeVar

Row = dict[str, Any]
"""One line of a table: figures by name, as JSON holds them."""

T = TypeVar("T")


class ProgressTracker(Protocol):
    """Hands on what it is given, and shows how far that has come."""

    def __call__(self, items: Sequence[T], description: str) -> Iterable[T]:
        """The same items."""
        ...
