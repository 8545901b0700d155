"""An outside SLAM system on one episode: its program in a process of its own, scored as ours."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from slam.algorithms.ceilings import MappingOnly
from slam.benchmark.keyframes import Filled, anchored, filled
from slam.benchmark.results import Result
from slam.benchmark.run import Run, run, true_start
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Array
from slam.interface import Slam
from slam.maps.static import Static

from ..outside.adapter import PREFIX, Adapter
from ..outside.program import Spent, run_programs
from ..outside.result_file import read_result
from .episode_formats import FOR_PROGRAMS
from .jobs import Done, Trial

SCORING_TIME = 300.0  # s, beyond the limit of the program: recording, reading, mapping, scores
VERSION_TIME = 20.0  # s, to tell a version


@dataclass(frozen=True)
class OutsideTrial(Trial):
    """An outside SLAM system on one episode.

    The program is given the recording without the truth. Its poses are filled in and moved such
    that the first is the true one, where our variants start; its map is `Static` drawn from them.

    adapter         how to run it
    program_limit   s, of the program alone
    """

    adapter: Adapter = None  # type: ignore[assignment]  (fields before it have defaults)
    program_limit: float = 600.0

    def __call__(self) -> Done:
        """Run and score. The scores of the online trajectory are left out: it is not known."""
        done = super().__call__()
        kept = {name: value for name, value in done.row.items() if not name.endswith("_online")}
        return done._replace(row=kept)

    def measured(self, episode: Episode) -> tuple[Run, Result]:
        """The poses of the program, and what it took with its start and reading the recording."""
        poses, keyframes, spent = self._outside(episode)
        done = run(_known(poses, episode), episode)
        measured = {
            "scans": len(poses),
            "matched": keyframes,
            "seconds": spent.wall,
            "cpu_seconds": spent.cpu,
            "ms_per_matched_scan": 1e3 * spent.wall / keyframes,
            "peak_memory_mb": spent.memory,
            "memory_mb": spent.memory,
            "slam": {"type": "outside", **self.adapter.plain},
        }
        return done, measured

    def again(self, done: Run, episode: Episode) -> Slam:
        """The map drawn from the same poses."""
        return _known(done.poses, episode)

    def _outside(self, episode: Episode) -> tuple[Array, int, Spent]:
        with tempfile.TemporaryDirectory(prefix="dynslam-outside-") as name:
            folder = Path(name)
            found, spent = self._filled(episode, folder)
        start = np.array(true_start(episode))
        return anchored(found.poses, start), len(found.keyframes), spent

    def _filled(self, episode: Episode, folder: Path) -> tuple[Filled, Spent]:
        adapter, out = self.adapter, folder / self.adapter.trajectory
        shown = _decimated(replace(episode, truth=None, meta=_odometry(episode)), adapter.max_beams)
        log = FOR_PROGRAMS[adapter.log](shown, folder / "recording")
        places = _places(adapter) | {"log": log, "out": out, "seed": self.source.seed}
        prepare, commands = (
            [adapter.words(command, places) for command in group]
            for group in (adapter.prepare, adapter.commands)
        )
        limit = self.program_limit
        limit -= run_programs(prepare, folder, limit, adapter.memory_mb).wall
        spent = run_programs(commands, folder, limit, adapter.memory_mb)
        given = read_result(out, episode, adapter.columns, adapter.stamps, adapter.offset)
        return filled(episode, given), spent


def _known(poses: Array, episode: Episode) -> MappingOnly:
    nothing = np.zeros((0, 4)), np.zeros((len(poses), 0, 4))
    return MappingOnly(Truth(poses, *nothing), Static())


def _odometry(episode: Episode) -> dict[str, object]:
    """Of the meta, only whether there is odometry: the rest tells of the world."""
    return {name: episode.meta[name] for name in ("odometry",) if name in episode.meta}


def _decimated(episode: Episode, most: int) -> Episode:
    """Each k-th beam of every scan, with the least k that leaves at most `most`."""
    step = max(-(-len(scan.ranges) // most) for scan in episode.scans)
    if step == 1:
        return episode
    scans = tuple(
        replace(
            scan, ranges=scan.ranges[::step], angles=scan.angles[::step],
            beam_time=step * scan.beam_time,
        )
        for scan in episode.scans
    )  # fmt: skip
    return replace(episode, scans=scans)


def _places(adapter: Adapter) -> dict[str, object]:
    return {"folder": adapter.folder, "python": sys.executable}


@cache
def _version_of(words: tuple[str, ...]) -> str:
    found = subprocess.run(words, capture_output=True, text=True, timeout=VERSION_TIME, check=True)
    return next(iter(found.stdout.strip().splitlines()), "")


def told_version(adapter: Adapter) -> str:
    """The version that the program tells of itself; empty if the adapter has no command for it.

    Raises InputError where that command fails: the program is not installed.
    """
    if not adapter.version:
        return ""
    words = tuple(adapter.words(adapter.version, _places(adapter)))
    try:
        return _version_of(words)
    except (OSError, subprocess.SubprocessError) as error:
        said = str(getattr(error, "stderr", None) or "").strip() or str(error)
        raise InputError(
            f"{PREFIX}{adapter.name}: {shlex.join(words)} fails ({said.splitlines()[-1]}); "
            f"is the program installed where the adapter looks for it?"
        ) from None
