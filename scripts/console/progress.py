"""A progress bar on standard error, so that standard output can be piped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

T = TypeVar("T")


class ProgressTracker(Protocol):
    """Passes items on and shows how many are done."""

    def __call__(self, items: Sequence[T], description: str) -> Iterable[T]:
        """The same items."""
        ...


def progress_bar() -> Progress:
    """A bar with the count, the elapsed and the remaining time; it disappears when finished.

    Nothing is drawn if standard error is not a terminal.
    """
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    )
