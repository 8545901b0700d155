"""Film of a run on a recording without truth: the growing map, the robot, its path, its echoes.

It shows the estimates as they were during the run, so that loop closures can be seen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageColor

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, transform_points
from slam.io.files import AnyPath
from slam.maps.snapshot import MapSnapshot

from .canvas import GREYS, MapCanvas
from .estimate_on_canvas import draw_path, draw_robot
from .film import Colours, write_film
from .map_panel import Box, MapPanel
from .style import DYNAMIC, ESTIMATE, INK, LOST, PAPER, UNKNOWN

MIN_ASPECT, MAX_ASPECT = 0.35, 1.0  # height / width of the picture
MIXED_COLOURS = 48  # in the palette, beside the exact ones
LAST_FRAME_TIME = 2.5  # s
ECHOES = DYNAMIC


def write_map_film(
    path: AnyPath,
    episode: Episode,
    snapshots: Sequence[MapSnapshot],
    title: str,
    lost: Array,
    fps: float = 15.0,
    width: int = 800,
) -> None:
    """Write the film as `path` (.gif or .mp4), one frame per snapshot.

    snapshots  of a run on `episode`, from a `SnapshotRecorder`; the last one sets the view
    title      the beginning of the line above the picture
    lost       (n,) `Estimate.lost` at each scan; while it is above 0.5, the film shows it
    fps        frames per second
    width      of the picture, pixels

    Raises InputError without a snapshot, and as `write_film`.
    """
    if not snapshots:
        raise InputError(f"{path}: no film of a run without a scan")
    frames = _Frames(episode, snapshots, title, lost, width)
    write_film(frames, path, fps, LAST_FRAME_TIME, Colours(_exact_colours(), MIXED_COLOURS))


class _Frames(Sequence[Image.Image]):
    """The frames, each drawn when it is accessed."""

    def __init__(
        self,
        episode: Episode,
        snapshots: Sequence[MapSnapshot],
        title: str,
        lost: Array,
        width: int,
    ):
        self._episode, self._snapshots, self._title, self._lost = episode, snapshots, title, lost
        self._blank = MapCanvas(_view(snapshots[-1]), width)

    def __len__(self) -> int:
        return len(self._snapshots)

    def __getitem__(self, number):  # pyright: ignore[reportIncompatibleMethodOverride]
        snapshot, canvas = self._snapshots[number], self._blank.copy()
        scan, pose = self._episode.scans[snapshot.scan], Pose2.of(snapshot.poses[-1])
        lost = self._lost[: len(snapshot.poses)]
        canvas.grid(snapshot.grid)
        draw_path(canvas, snapshot.poses, lost)
        canvas.dots(transform_points(pose, scan.points), ECHOES, 1.2)
        draw_robot(canvas, pose, float(lost[-1]))
        time = scan.time - self._episode.scans[0].time
        legend = [("", INK), ("echoes  ", ECHOES), ("estimated path", ESTIMATE)]
        canvas.title([(f"{self._title}, {time:.0f} s", INK), *legend])
        return canvas.finished()


def _view(last: MapSnapshot) -> Box:
    """The box of the final map, neither too flat nor too tall."""
    box = MapPanel("", last.grid, last.poses).box
    return box.shaped(min(max(box.height / box.width, MIN_ASPECT), MAX_ASPECT))


def _exact_colours() -> np.ndarray:
    """(n, 3) the greys of maps, our colours, and mixtures of lines with the map below them."""
    greys = np.repeat(GREYS[:, None], 3, axis=1)
    lines = np.array([ImageColor.getrgb(colour) for colour in (ESTIMATE, ECHOES, LOST)])
    below = np.array([ImageColor.getrgb(colour) for colour in (PAPER, "#000000", UNKNOWN)])
    own = np.array([ImageColor.getrgb(colour) for colour in (PAPER, INK, UNKNOWN)])
    return np.vstack([greys, own, lines, ((lines[:, None] + below) // 2).reshape(-1, 3)])
