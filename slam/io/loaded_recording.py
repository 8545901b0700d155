"""A recording that was read from a file, and the choice of its laser and odometry."""

from __future__ import annotations

from typing import NamedTuple

from slam.episode import Episode
from slam.geometry import Pose2
from slam.io.warnings import RecordingWarning


class LoadedRecording(NamedTuple):
    """An episode that was read from a file, and the warnings about the file."""

    episode: Episode
    warnings: tuple[RecordingWarning, ...]


class SourceSelection(NamedTuple):
    """Which laser and odometry of a file to read; None: the one that is found in the file.

    laser     topic of the laser's scans
    odometry  topic of the odometry, or its frame in /tf; "none" for none
    mount     the sensor on the robot (robot_from_sensor), instead of the one in the file
    """

    laser: str | None = None
    odometry: str | None = None
    mount: Pose2 | None = None
