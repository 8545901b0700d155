"""The film of a run whose truth nobody knows: the map as it grows, the robot, its way, its echoes.

It shows what was believed on the way, not what is believed at the end: a loop that closes is seen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageColor

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, transform_points
from slam.io.files import AnyPath
from slam.snapshot import MapSnapshot

from .canvas import GREYS, MapCanvas
from .film import Colours, write_film
from .map_panel import Box, MapPanel
from .style import DYNAMIC, ESTIMATE, INK, PAPER, UNKNOWN

FLATTEST, TALLEST = 0.35, 1.0  # height / width of the picture
BLENDS = 48  # colours in the palette beside our own
HOLD = 2.5  # s that the last frame stays
ECHOES = DYNAMIC


def write_growth(
    path: AnyPath,
    episode: Episode,
    stages: Sequence[MapSnapshot],
    title: str,
    fps: float = 15.0,
    width: int = 800,
) -> None:
    """Write the film as `path` (.gif or .mp4): a frame a stage, each as believed at its time.

    stages  of a run on `episode`, as `SnapshotRecorder` keeps them; all fit the view of the last
    title   what the strip above begins with
    fps     frames a second
    width   of the picture, pixels

    Raises InputError without a stage, and as `write_film`.
    """
    if not stages:
        raise InputError(f"{path}: no film of a run without a scan")
    frames = _Frames(episode, stages, title, width)
    write_film(frames, path, fps, HOLD, Colours(_exact_colours(), BLENDS))


class _Frames(Sequence[Image.Image]):
    """The pictures, drawn when they are asked for."""

    def __init__(self, episode: Episode, stages: Sequence[MapSnapshot], title: str, width: int):
        self._episode, self._stages, self._title = episode, stages, title
        self._blank = MapCanvas(_view(stages[-1]), width)

    def __len__(self) -> int:
        return len(self._stages)

    def __getitem__(self, number):  # pyright: ignore[reportIncompatibleMethodOverride]
        stage, canvas = self._stages[number], self._blank.copy()
        scan, pose = self._episode.scans[stage.scan], Pose2.of(stage.poses[-1])
        canvas.grid(stage.grid)
        canvas.path(stage.poses[:, :2], ESTIMATE, 1.5)
        canvas.dots(transform_points(pose, scan.points), ECHOES, 1.2)
        canvas.robot(pose, ESTIMATE)
        time = scan.time - self._episode.scans[0].time
        legend = [("", INK), ("echoes  ", ECHOES), ("estimated path", ESTIMATE)]
        canvas.title([(f"{self._title}, {time:.0f} s", INK), *legend])
        return canvas.finished()


def _view(last: MapSnapshot) -> Box:
    """What the final map fits in, neither too flat nor too tall."""
    box = MapPanel("", last.grid, last.poses).box
    return box.shaped(min(max(box.height / box.width, FLATTEST), TALLEST))


def _exact_colours() -> np.ndarray:
    """(n, 3) the greys of maps, our colours, and those of lines half over a map."""
    greys = np.repeat(GREYS[:, None], 3, axis=1)
    lines = np.array([ImageColor.getrgb(colour) for colour in (ESTIMATE, ECHOES)])
    below = np.array([ImageColor.getrgb(colour) for colour in (PAPER, "#000000", UNKNOWN)])
    own = np.array([ImageColor.getrgb(colour) for colour in (PAPER, INK, UNKNOWN)])
    return np.vstack([greys, own, lines, ((lines[:, None] + below) // 2).reshape(-1, 3)])
