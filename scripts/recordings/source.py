"""A recording named on the command line, of any format."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from slam.errors import InputError

if TYPE_CHECKING:
    from slam.io.loaded_recording import LoadedRecording


@dataclass(kw_only=True)
class RecordingSource:
    """The recording that a command reads."""

    file: tyro.conf.Positional[Path]
    """Recording: ROS bag (.bag, .mcap, .db3, folder), CARMEN log (plain or .gz), .csv or .npz."""
    laser: str | None = None
    """Topic of the laser; needed where a bag has several."""
    odometry: str | None = None
    """Topic of the odometry, or its frame of /tf; needed where a bag has several. none: estimate
    the odometry from the scans."""
    mount: tuple[float, float, float] | None = None
    """Pose of the laser on the robot: m forward, m to the left, degrees. Default: as in the file.
    """

    def read(self, laser: str | None = None) -> LoadedRecording:
        """The recording as it is in the file, of the chosen laser or else `laser`.

        Raises InputError.
        """
        from slam.bounds import MAX_MOUNT, all_within
        from slam.geometry import Pose2
        from slam.io.formats import read_log
        from slam.io.loaded_recording import SourceSelection

        mount = None
        if self.mount is not None:
            x, y, degrees = self.mount
            mount = Pose2(x, y, math.radians(degrees))
            if not all_within(mount, MAX_MOUNT):
                raise InputError(
                    f"--mount is three finite numbers, the laser within {MAX_MOUNT:g} m of the "
                    f"robot, got {x} {y} {degrees}"
                )
        return read_log(self.file, SourceSelection(self.laser or laser, self.odometry, mount))

    def read_and_warn(self) -> LoadedRecording:
        """The same; prints its warnings on standard error."""
        log = self.read()
        for warning in log.warnings:
            print(f"{self.file}: warning: {warning}", file=sys.stderr)
        return log


@dataclass(kw_only=True)
class MappedSource(RecordingSource):
    """The recording that a command makes a map of."""

    clock: str = "auto"
    """Seconds by which the odometry's stamps are late against the laser's (negative: early), and
    whether a scan's stamp is of the begin or the end of its sweep: 0.2 or 0.2,begin or 0.2,end.
    auto: estimate both, and correct what is significant. none: no correction."""


def stem(file: Path) -> str:
    """A recording's name without its endings, for the names of files made from it."""
    name = file.resolve().name.removesuffix(".gz")
    return Path(name).stem.lstrip(".") or "recording"
