"""A recording as it is read from a file: what a SLAM can be run on, and what was wrong with it."""

from __future__ import annotations

from typing import NamedTuple

from slam.episode import Episode
from slam.geometry import Pose2
from slam.io.warnings import RecordingWarning


class LoadedRecording(NamedTuple):
    """A log that was read, and what was wrong with it."""

    episode: Episode
    warnings: tuple[RecordingWarning, ...]


class SourceSelection(NamedTuple):
    """What of a file with several lasers or odometries is wanted; None: what is found by itself.

    laser     topic of the laser's scans
    odometry  topic of the odometry, or the frame of /tf that it is told in; "none" for none
    mount     the sensor on the robot (robot_from_sensor), instead of what the file says
    """

    laser: str | None = None
    odometry: str | None = None
    mount: Pose2 | None = None
