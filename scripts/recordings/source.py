"""A recording named on the command line, of any format."""

from __future__ import annotations

import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from slam.errors import InputError

if TYPE_CHECKING:
    from slam.episode import Episode
    from slam.io.loaded_recording import LoadedRecording


@dataclass(kw_only=True)
class RecordingSource:
    """The recording that a command reads."""

    file: tyro.conf.Positional[Path]
    """Recording: ROS bag (.bag, .mcap, .db3, folder), CARMEN log (plain or .gz), .csv or .npz."""
    laser: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Topic of the laser; needed where a bag has several. Given several times: all of these lasers,
    which are on the same robot, scan by scan in the order of time."""
    odometry: str | None = None
    """Topic of the odometry, or its frame of /tf; needed where a bag has several. none: estimate
    the odometry from the scans."""
    mount: tuple[float, float, float] | None = None
    """Pose of the laser on the robot: m forward, m to the left, degrees. Default: as in the file.
    """

    def read(self, laser: str | None = None) -> LoadedRecording:
        """The recording as it is in the file, of the laser `laser`, or else the only one.

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
        return read_log(self.file, SourceSelection(laser, self.odometry, mount))

    def read_lasers(self) -> list[LoadedRecording]:
        """The recording as each of the chosen lasers saw it; prints warnings on standard error.

        Raises InputError.
        """
        lasers = list(dict.fromkeys(self.laser))
        if len(lasers) > 1 and self.mount is not None:
            raise InputError("--mount is of one laser, and there are several (--laser)")
        logs = [self.read(laser) for laser in lasers or [None]]
        for warning in dict.fromkeys(str(warning) for log in logs for warning in log.warnings):
            print(f"{self.file}: warning: {warning}", file=sys.stderr)
        return logs


@dataclass(kw_only=True)
class MappedSource(RecordingSource):
    """The recording that a command makes a map of."""

    clock: str = "auto"
    """Seconds by which the odometry's stamps are late against the laser's (negative: early), and
    whether a scan's stamp is of the begin or the end of its sweep: 0.2 or 0.2,begin or 0.2,end.
    auto: estimate both, and correct what is significant. none: no correction."""
    begin: Annotated[float | None, tyro.conf.arg(name="from")] = None
    """Use the recording from here on: seconds after its first scan, or a stamp (from 1e8 on)."""
    end: Annotated[float | None, tyro.conf.arg(name="to")] = None
    """Use the recording up to here: seconds after its first scan, or a stamp (from 1e8 on)."""
    min_range: float | None = None
    """Nearest range that is used, m: nearer readings, as of the robot itself, are left out."""
    max_range: float | None = None
    """Farthest range that is used, m: echoes from here on count as none."""

    def read_limited(self) -> tuple[list[Episode], list[str]]:
        """The part of the recording that is used, an episode of each laser, and the warnings, which
        are printed on standard error too. Raises InputError."""
        from slam.preprocessing.range_limits import with_ranges
        from slam.preprocessing.time_slice import between_times, moment

        logs = self.read_lasers()
        start = min(log.episode.scans[0].time for log in logs)
        low, high = (None if t is None else moment(t, start) for t in (self.begin, self.end))
        try:
            parts = [between_times(log.episode, low, high) for log in logs]
            parts = [with_ranges(part, self.min_range, self.max_range) for part in parts]
        except InputError as error:
            raise InputError(f"{self.file}: {error}") from None
        return parts, [str(warning) for log in logs for warning in log.warnings]


def stem(file: Path) -> str:
    """A recording's name without its endings, for the names of files made from it."""
    name = Path(os.path.abspath(file)).name.removesuffix(".gz")  # a link keeps its own name
    return Path(name).stem.lstrip(".") or "recording"
