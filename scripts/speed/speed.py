"""`dynslam speed`: what a step of the environment and a scan of a SLAM cost, in time and memory."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from agents import record_corridor
from slam.benchmark.results import versions
from slam.episode import Episode
from slam.errors import InputError
from slam.io.formats import read_log
from slam.preprocessing.deskewing import deskewed
from slam.validation import whole_number

from ..console.progress import progress_bar
from ..console.rows import ProgressTracker, Row, T
from ..console.selection import PLAIN, parse_selection, parse_variants
from .building import building_rows, building_table
from .environment import env_rows, env_table
from .memory import memory_rows, memory_table
from .patrol import patrol_rows, patrol_table
from .slam_update import slam_rows, slam_table

SEED = 7  # of the corridor, its doors moving
SIDE = 200.0  # m, of the building
EACH = 3  # rounds of the environment for one of a SLAM, which takes longer and varies less
WHAT = ["env", "slam", "memory", "patrol", "building"]


@dataclass
class SpeedCommand:
    """Measure what things cost: processor time and memory, each beside a yardstick.

    env: ten physics steps (the floor), one environment, the vector environment, resets.
    slam: a matched scan of each variant on a drive past moving doors, and on a log.
    memory: bytes of each variant's map as time goes by in one place.
    patrol: where the time of a step of DoorPatrol-v0 goes, and of learning (on request).
    building: bytes of each variant's map of 200 x 200 m (on request: half a minute each).
    """

    what: str = "env,slam,memory"
    """What to measure: some of env, slam, memory, patrol, building, with commas between, or all."""
    variants: str = PLAIN
    """SLAM variants to measure, with commas between; or all; or plain: those without a slash."""
    log: Path | None = None
    """CARMEN log, plain or .gz, to measure the SLAM variants on as well."""
    json: bool = False
    """Print one JSON object instead of tables."""
    num_envs: int = 64
    """Worlds of the vector environment."""
    rounds: int = 9
    """Rounds of each measurement of env; a third of them of slam. The fastest counts."""

    def __call__(self) -> int:
        """Measure and print."""
        whole_number("rounds", self.rounds, 1)
        whole_number("num-envs", self.num_envs, 1)
        parts = self._parts()  # a mistake is told before all work
        rows = []
        with progress_bar() as bar:

            def track(items: Sequence[T], description: str) -> Iterable[T]:
                return bar.track(items, description=description)

            for part in parts:
                rows.append(part.measure(track))
        if self.json:
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

    def _parts(self) -> list[Part]:
        """What is to be measured."""
        asked = parse_selection("what", self.what, WHAT)
        variants = parse_variants(self.variants)
        if self.log and "slam" not in asked:
            raise InputError(f"a log is for --what slam, got --what {self.what}")
        parts = []
        if "env" in asked:
            parts.append(Part("env", partial(env_rows, self.num_envs, self.rounds), env_table))
        if "slam" in asked:
            rounds = -(-self.rounds // EACH)
            for name, episode in self._drives():
                rows = partial(slam_rows, variants, episode, name, rounds)
                parts.append(Part("slam", rows, slam_table))
        if "memory" in asked:
            episode = record_corridor(SEED, "moving")
            parts.append(Part("memory", partial(memory_rows, variants, episode), memory_table))
        if "patrol" in asked:
            rounds = -(-self.rounds // EACH)
            parts.append(Part("patrol", partial(patrol_rows, rounds), patrol_table))
        if "building" in asked:
            parts.append(Part("building", partial(building_rows, variants, SIDE), building_table))
        return parts

    def _drives(self) -> Iterator[tuple[str, Episode]]:
        """The drive in the corridor, and the log."""
        yield "corridor", record_corridor(SEED, "moving")
        if self.log:
            log = read_log(self.log)
            for warning in log.warnings:
                print(f"{self.log}: warning: {warning}", file=sys.stderr)
            yield self.log.name, deskewed(log.episode)


class Part(NamedTuple):
    """One table: its name, how its rows are measured, how they are shown."""

    name: str
    measure: Callable[[ProgressTracker], list[Row]]
    table: Callable[[list[Row]], Table]
