"""A recording named on the command line, of any format."""

from __future__ import annotations

import math
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import tyro

from slam.benchmark.run import warm_up
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.formats import read_log
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.preprocessing.deskewing import deskewed
from slam.preprocessing.laser_odometry import poses_by_laser, with_odometry

from ..console.progress import progress_bar


@dataclass(kw_only=True)
class RecordingSource:
    """What a command reads."""

    file: tyro.conf.Positional[Path]
    """Recording: ROS bag (.bag, .mcap, .db3, folder), CARMEN log (plain or .gz), .csv or .npz."""
    laser: str | None = None
    """Topic of the laser, where a bag has several."""
    odometry: str | None = None
    """Topic of the odometry, or its frame of /tf, where a bag has several; none: by the laser."""
    mount: tuple[float, float, float] | None = None
    """Where the laser stands on the robot: m ahead, m to the left, degrees; if not given, as the
    file says."""

    def read(self) -> LoadedRecording:
        """The recording as it is in the file. Raises InputError."""
        mount = None
        if self.mount is not None:
            x, y, degrees = self.mount
            if not all(map(math.isfinite, self.mount)):
                raise InputError(f"--mount is three finite numbers, got {x} {y} {degrees}")
            mount = Pose2(x, y, math.radians(degrees))
        return read_log(self.file, SourceSelection(self.laser, self.odometry, mount))

    def told(self) -> LoadedRecording:
        """The same; what was wrong with it is told on standard error."""
        log = self.read()
        for warning in log.warnings:
            print(f"{self.file}: warning: {warning}", file=sys.stderr)
        return log


def prepared(episode: Episode) -> Episode:
    """A recording as a SLAM takes it: what the robot moved during a sweep is taken out; where there
    is no odometry, it is found from the scans, which takes its time."""
    return deskewed(episode if episode.has_odometry else _by_laser(episode))


def stem(file: Path) -> str:
    """A recording's name without its endings, to call what is made of it."""
    name = file.resolve().name.removesuffix(".gz")
    return Path(name).stem.lstrip(".") or "recording"


def _by_laser(episode: Episode) -> Episode:
    with progress_bar() as progress:
        poses = list(
            progress.track(
                poses_by_laser(episode), len(episode.scans), description="odometry by laser"
            )
        )
    return with_odometry(episode, poses)


def compile_first(variant: str, episode: Episode) -> None:
    """Compile what a variant needs, which takes half a minute the first time, and says so."""
    with progress_bar() as progress:
        progress.add_task("compiling, the first time only", total=None)
        with suppress(InputError):  # the run itself comes to it, and keeps what was before
            warm_up(variant, episode)
