"""Cost of a scan for each SLAM: processor time, and memory of the map."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

import slam
from slam.benchmark.results import Result
from slam.benchmark.run import true_start, warm_up
from slam.episode import Episode, Truth
from slam.geometry import Array
from slam.interface import Slam
from slam.search.registration import Registration

from ..console.progress import ProgressTracker
from .memory import map_memory, map_of

YARDSTICK = "static-ml"
"""The variant that the others' costs are compared with."""


class Cost(NamedTuple):
    """Processor time of a SLAM on an episode.

    seconds      (n,) per scan: prediction, search and map update
    matched      (n,) bool, the matched scans
    mapping      seconds spent on the map and on the refresh of its sensor model
    registering  seconds spent on the registration of matched poses on the map's surfaces
    """

    seconds: Array
    matched: np.ndarray
    mapping: float
    registering: float = 0.0

    @property
    def ms(self) -> float:
        """Time per matched scan, ms; per scan if none was matched."""
        return _ms(self.seconds, self.matched)

    @property
    def halves(self) -> tuple[float, float]:
        """`ms` of the first and of the second half of the scans."""
        half = len(self.seconds) // 2
        return (
            _ms(self.seconds[:half], self.matched[:half]),
            _ms(self.seconds[half:], self.matched[half:]),
        )


class Costs(NamedTuple):
    """Costs of the whole episode, and of its second half for a SLAM that begins there."""

    whole: Cost
    alone: Cost


def slam_rows(
    variants: Sequence[str], episode: Episode, name: str, rounds: int, track: ProgressTracker
) -> list[Result]:
    """One row per variant; variants alternate in each round, so that other load of the machine
    affects all equally.

    Times are of each variant's fastest round, ratios are medians over the rounds. The second half
    of a drive may cost more than the first because of the place; if it costs more than for a SLAM
    that begins there, the cost grows with the map.
    """
    measured = [YARDSTICK, *(one for one in variants if one != YARDSTICK)]
    for variant in measured:
        warm_up(variant, episode)
    costs: dict[str, list[Costs]] = {variant: [] for variant in measured}
    robots: dict[str, Slam] = {}
    latter = second_half(episode)
    turns = [variant for _ in range(rounds) for variant in measured]
    for variant in track(turns, f"SLAM, {name}"):
        robots[variant] = slam.make(variant, true_start(episode))
        whole = cost(robots[variant], episode)
        alone = cost(slam.make(variant, true_start(latter)), latter)
        costs[variant].append(Costs(whole, alone))
    return [
        _row(variant, name, costs[variant], costs[YARDSTICK]) | _memory(robots[variant])
        for variant in variants
    ]


def slam_table(rows: list[Result]) -> Table:
    """The table for a terminal of 80 columns."""
    table = Table(box=HORIZONTALS, title=f"a SLAM's scan, {rows[0]['on']}, one core", padding=0)
    table.caption, table.caption_justify = COLUMN_LEGEND, "left"
    table.add_column("what", no_wrap=True)
    for heading in (
        "CPU ms",
        f"/ {YARDSTICK}",
        "map %",
        "reg %",
        "2nd/1st",
        "2nd/new",
        "B/seen",
        "B/cell",
        "MB",
    ):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(
            row["what"],
            f"{row['cpu_ms']:.3f}",
            f"{row['ratio']:.2f}",
            _shown(row["map_share"], "{:.0%}"),
            _shown(row["registration_share"], "{:.0%}"),
            _shown(row["second_half"], "{:.2f}"),
            _shown(row["second_half_grown"], "{:.2f}"),
            _shown(row["bytes_per_observed_cell"], "{:.1f}"),
            _shown(row["bytes_per_cell"], "{:.1f}"),
            _shown(row["bytes"], "{:.2f}", 1e-6),
        )
    return table


COLUMN_LEGEND = (
    "CPU ms: of the processor per matched scan, prediction, search and map update; map: share of "
    "the map update, reg: of the registration; 2nd/1st: cost of the drive's second half over that "
    "of its first; 2nd/new: over that of the same half on a map of its own, 1 if cost does not "
    "grow with the map; B/seen, B/cell: bytes per cell that was seen, and per cell of the tiles in "
    "use; MB: of the map"
)


def second_half(episode: Episode) -> Episode:
    """The second half of the scans as an episode."""
    half, truth = len(episode.scans) // 2, episode.truth
    if truth is not None:
        truth = Truth(truth.poses[half:], truth.walls, truth.doors[half:])
    return replace(episode, scans=episode.scans[half:], truth=truth)


def cost(robot: Slam, episode: Episode) -> Cost:
    """Run `robot` over the whole episode and measure its processor time."""
    stopwatch, registering = Stopwatch(), Stopwatch()
    parts = ((map_of(robot), "integrate"), (getattr(robot, "sensor_model", None), "refresh"))
    for part, method in parts:
        if part is not None:
            setattr(part, method, stopwatch.around(getattr(part, method)))
    scans = episode.scans
    seconds, matched = np.empty(len(scans)), np.empty(len(scans), dtype=np.bool_)
    with registering.timing(Registration, "__call__"):
        for k, (displacement, scan) in enumerate(zip(episode.displacements(), scans, strict=True)):
            begun = time.process_time()
            estimate = robot.update(displacement, scan)
            seconds[k] = time.process_time() - begun
            matched[k] = estimate.matched
    return Cost(seconds, matched, stopwatch.seconds, registering.seconds)


class Stopwatch:
    """Adds up the processor time of calls."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = time.process_time()
            result = call(*args, **kwargs)
            self.seconds += time.process_time() - begun
            return result

        return timed

    @contextmanager
    def timing(self, owner: type, method: str) -> Iterator[None]:
        """Time a method of all objects of a class, as of those that a graph makes on the way."""
        untimed = getattr(owner, method)
        setattr(owner, method, self.around(untimed))
        try:
            yield
        finally:
            setattr(owner, method, untimed)


def _row(variant: str, name: str, costs: list[Costs], yardstick: list[Costs]) -> Result:
    fastest = min((one.whole for one in costs), key=lambda whole: whole.ms)
    return {
        "what": variant,
        "on": name,
        "cpu_ms": fastest.ms,
        "ratio": median(
            own.whole.ms / other.whole.ms for own, other in zip(costs, yardstick, strict=True)
        ),
        "map_share": fastest.mapping / fastest.seconds.sum() or None,
        "registration_share": fastest.registering / fastest.seconds.sum() or None,
        "second_half": median(whole.halves[1] / whole.halves[0] for whole, _ in costs),
        "second_half_grown": median(whole.halves[1] / alone.ms for whole, alone in costs),
        "matched": int(fastest.matched.sum()),
        "scans": len(fastest.seconds),
    }


def _memory(robot: Slam) -> Result:
    map_model = map_of(robot)
    if map_model is None:
        total = getattr(robot, "nbytes", None)
        return {"bytes": total, "bytes_per_observed_cell": None, "bytes_per_cell": None}
    now = map_memory(map_model)
    return {
        "bytes": now.nbytes,
        "bytes_per_observed_cell": now.nbytes / now.observed if now.observed else None,
        "bytes_per_cell": now.nbytes / now.cells if now.cells else None,
    }


def _ms(seconds: Array, matched: np.ndarray) -> float:
    return 1e3 * float(seconds.sum()) / int(matched.sum() or len(seconds) or 1)


def _shown(value: float | None, pattern: str, scale: float = 1.0) -> str:
    return "" if value is None else pattern.format(scale * value)
