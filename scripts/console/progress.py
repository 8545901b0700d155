"""Progress on standard error, so that standard output can be piped: a bar, or a line at times."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from typing import Protocol, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

T = TypeVar("T")
LINE_EVERY = 30.0  # s between lines where standard error is no terminal
FIRST_LINE = 5.0  # s, the first of them
RATE_OVER = 300.0  # s, the time that a rate is measured over
SLOW = 1.0  # a second: below this rate, it is told per minute


class ProgressTracker(Protocol):
    """Passes items on and shows how many are done."""

    def __call__(self, items: Sequence[T], description: str) -> Iterable[T]:
        """The same items."""
        ...


def progress_bar() -> Progress:
    """A bar with the count, the rate, the elapsed and the remaining time; it disappears when
    finished. Where standard error is no terminal, a line of the same after 5 s, then every half
    minute."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _RateColumn(),
        TimeElapsedColumn(),
        _LeftColumn(),
    )
    if console.is_terminal:
        return Progress(*columns, console=console, transient=True, speed_estimate_period=RATE_OVER)
    return _Lines(
        *columns, console=console, disable=True, auto_refresh=False, speed_estimate_period=RATE_OVER
    )


class _RateColumn(ProgressColumn):
    """Items a second, or a minute."""

    def render(self, task: Task) -> Text:
        return Text(rate(task))


class _LeftColumn(ProgressColumn):
    """The remaining time."""

    def render(self, task: Task) -> Text:
        return Text(left(task))


class _Lines(Progress):
    """Draws no bar, and writes a line of every task that has begun every LINE_EVERY s, the first
    after FIRST_LINE."""

    def start(self) -> None:
        self._ended = threading.Event()
        threading.Thread(target=self._write, daemon=True).start()

    def stop(self) -> None:
        self._ended.set()

    def _write(self) -> None:
        pause = min(FIRST_LINE, LINE_EVERY)
        while not self._ended.wait(pause):
            pause = LINE_EVERY
            for task in self.tasks:
                if task.started and not task.finished and task.total != 0:
                    self.console.print(line(task), highlight=False, soft_wrap=True)


def line(task: Task) -> str:
    """A task in a line: how many of how many, the rate, the time left."""
    if task.total is None:
        return f"{task.description}: {task.elapsed or 0:.0f} s"
    done = f"{task.description}: {task.completed:g} of {task.total:g}"
    return ", ".join(part for part in (done, rate(task), left(task)) if part)


def rate(task: Task) -> str:
    """Items of a task a second, or a minute where that is less than one; empty if not known."""
    speed = _speed(task)
    if not speed:
        return ""
    return f"{speed:.1f} a second" if speed >= SLOW else f"{60 * speed:.1f} a minute"


def left(task: Task) -> str:
    """The time that the rest of a task takes at its rate; empty if not known."""
    speed = _speed(task)
    if not speed or task.remaining is None:
        return ""
    return f"{duration(task.remaining / speed)} left"


def _speed(task: Task) -> float:
    """Items a second in the last RATE_OVER; since the begin where none was done in that time."""
    since_begin = task.completed / task.elapsed if task.elapsed else 0.0
    return task.finished_speed or task.speed or since_begin


def duration(seconds: float) -> str:
    """A time for people: `40 s`, `12 min`, `3 h 20 min`."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
