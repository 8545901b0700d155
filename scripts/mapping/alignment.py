"""`--align`: the start heading at which the walls of the map are parallel to its axes."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import slam
from slam.benchmark.run import Playback
from slam.episode import Episode
from slam.geometry import Pose2
from slam.layers.wall_direction import wall_direction

from ..console.progress import progress_bar
from .start import Start

if TYPE_CHECKING:
    from .map import MapCommand


def aligned(start: Start, options: MapCommand, variant: str, episode: Episode) -> Start:
    """The start at the origin, turned so that the map has its walls along its axes: the recording
    is mapped once to see their direction, which is told on standard error."""
    robot = slam.make(variant, start.pose, options.seed)
    playback = Playback(robot, episode)
    with progress_bar() as progress:
        for _ in progress.track(playback, len(episode.scans), description="direction of walls"):
            pass
    angle = wall_direction(episode.scans, playback.result().poses)
    print(
        f"{options.file}: walls at {math.degrees(angle):.1f} degrees: the map is turned by "
        f"{-math.degrees(angle):.1f}",
        file=sys.stderr,
    )
    return start._replace(pose=Pose2(start.pose.x, start.pose.y, start.pose.theta - angle))
