"""The work of `dynslam speed`: which tables are measured, and their output."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from rich.console import Console
from rich.table import Table

from agents import record_corridor
from slam.benchmark.results import Result, versions
from slam.episode import Episode
from slam.errors import InputError
from slam.io.formats import read_log
from slam.preprocessing.deskewing import deskewed
from slam.validation import whole_number

from ..console.progress import ProgressTracker, T, progress_bar
from ..console.selection import parse_selection, parse_variants
from .building import building_rows, building_table
from .environment import env_rows, env_table
from .long import SCANS, long_rows, long_table
from .memory import memory_rows, memory_table
from .patrol import patrol_rows, patrol_table
from .slam_update import slam_rows, slam_table

if TYPE_CHECKING:
    from .speed import SpeedCommand

SEED = 7  # of the corridor, its doors moving
BUILDING_SIDE = 200.0  # m
ENV_ROUNDS_PER_SLAM_ROUND = 9  # a SLAM's round takes longer and varies less
ENV_ROUNDS_PER_PATROL_ROUND = 3
TABLES = ["env", "slam", "memory", "patrol", "building", "long"]


class Measurement(NamedTuple):
    """A table: its name, a function that measures its rows, one that lays them out."""

    name: str
    measure: Callable[[ProgressTracker], list[Result]]
    table: Callable[[list[Result]], Table]


def measure(options: SpeedCommand) -> int:
    """Measure and print; the exit status."""
    whole_number("rounds", options.rounds, 1)
    whole_number("num-envs", options.num_envs, 1)
    parts = _measurements(options)  # raises before any work
    rows = []
    with progress_bar() as bar:

        def track(items: Sequence[T], description: str) -> Iterable[T]:
            return bar.track(items, description=description)

        for part in parts:
            rows.append(part.measure(track))
    if options.json:
        flat = [
            {"table": part.name} | row
            for part, mine in zip(parts, rows, strict=True)
            for row in mine
        ]
        print(json.dumps({"rows": flat, "versions": versions()}))
    else:
        for part, mine in zip(parts, rows, strict=True):
            Console().print(part.table(mine))
    return 0


def _measurements(options: SpeedCommand) -> list[Measurement]:
    """The requested measurements."""
    asked = parse_selection("measurement", options.what, TABLES)
    variants = parse_variants(options.variants)
    if options.log and "slam" not in asked:
        raise InputError(f"a log is for --what slam, got --what {options.what}")
    parts = []
    if "env" in asked:
        parts.append(
            Measurement("env", partial(env_rows, options.num_envs, options.rounds), env_table)
        )
    if "slam" in asked:
        rounds = -(-options.rounds // ENV_ROUNDS_PER_SLAM_ROUND)
        for name, episode in _drives(options):
            rows = partial(slam_rows, variants, episode, name, rounds)
            parts.append(Measurement("slam", rows, slam_table))
    if "memory" in asked:
        episode = record_corridor(SEED, "moving")
        parts.append(Measurement("memory", partial(memory_rows, variants, episode), memory_table))
    if "patrol" in asked:
        rounds = -(-options.rounds // ENV_ROUNDS_PER_PATROL_ROUND)
        parts.append(Measurement("patrol", partial(patrol_rows, rounds), patrol_table))
    if "building" in asked:
        parts.append(
            Measurement("building", partial(building_rows, variants, BUILDING_SIDE), building_table)
        )
    if "long" in asked:
        parts.append(Measurement("long", partial(long_rows, variants, SCANS), long_table))
    return parts


def _drives(options: SpeedCommand) -> Iterator[tuple[str, Episode]]:
    """The drive in the corridor, and the log."""
    yield "corridor", record_corridor(SEED, "moving")
    if options.log:
        log = read_log(options.log)
        for warning in log.warnings:
            print(f"{options.log}: warning: {warning}", file=sys.stderr)
        yield options.log.name, deskewed(log.episode)
