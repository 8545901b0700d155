"""The replay: the truth and several SLAMs on the same episode as an animated GIF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageColor

from slam.benchmark.run import Playback
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Slam
from slam.metrics.trajectory import ate

from .canvas import GREYS, MapCanvas, fan
from .estimate_on_canvas import draw_path, draw_robot
from .film import Colours, write_film
from .known_poses import known
from .map_panel import Box
from .style import DOORS, ESTIMATE, FAINT, INK, LOST, PAPER, TRUTH, UNKNOWN, WALLS

SHOWN_RANGE = 2.3  # m around the true path
WALL_MARGIN = 0.3  # m outside the walls
MIN_ASPECT = 0.6  # height / width; flatter panels are stacked
GAP = 4  # pixels between panels
MIXED_COLOURS = 48  # in the palette, beside the exact ones
LAST_FRAME_TIME = 2.5  # s
BEAMS, OUTSIDE = "#DDEFFA", "#E4E6EA"
LINES = (TRUTH, ESTIMATE, LOST, WALLS, DOORS)
EXACT_COLOURS = (PAPER, INK, UNKNOWN, BEAMS, OUTSIDE, *LINES)


class Snapshot(NamedTuple):
    """A SLAM after scan number `scan`.

    poses  (scan + 1, 3) as estimated at each scan up to this one
    grid   the map, a copy of its own
    lost   (scan + 1,) `Estimate.lost` at each of these scans
    """

    scan: int
    poses: Array
    grid: OccupancyGrid
    lost: Array


def take_snapshots(slam: Slam, episode: Episode, every: int = 5) -> list[Snapshot]:
    """Run `slam` over the episode; its state after every `every`th scan, and after the last."""
    if every < 1:
        raise InputError(f"snapshots are taken every 1 scan or more, got every={every}")
    playback, last = Playback(slam, episode), len(episode.scans) - 1
    snapshots = []
    for number, _ in enumerate(playback):
        if number % every == 0 or number == last:
            run = playback.result()
            snapshots.append(Snapshot(number, run.poses, run.grid, run.lost))
    return snapshots


def write_replay(
    path: str | PathLike[str],
    episode: Episode,
    runs: Mapping[str, Sequence[Snapshot]],
    fps: float = 10.0,
    width: int = 800,
) -> None:
    """Write the animation as a GIF: one frame per snapshot; the truth, then one panel per run.

    episode  with its truth
    runs     title -> snapshots (`take_snapshots`), at the same scans in every run
    fps      frames per second
    width    of the picture, pixels
    """
    truth = known(episode)
    scans = _common_scans(runs)
    frames = [_frame(panels, width) for panels in _panels(episode, truth, runs, scans, width)]
    write_film(frames, path, fps, LAST_FRAME_TIME, Colours(_exact_colours(), MIXED_COLOURS))


def _common_scans(runs: Mapping[str, Sequence[Snapshot]]) -> list[int]:
    numbers = [[snapshot.scan for snapshot in run] for run in runs.values()]
    if not numbers or not numbers[0]:
        raise InputError("a replay needs at least one run with at least one snapshot")
    if any(other != numbers[0] for other in numbers):
        raise InputError("the runs of a replay need snapshots at the same scans")
    return numbers[0]


def _panels(
    episode: Episode,
    truth: Truth,
    runs: Mapping[str, Sequence[Snapshot]],
    scans: Sequence[int],
    width: int,
) -> Iterator[list[Image.Image]]:
    """The panels of each frame, all of one size."""
    box = _shown(truth)
    columns = 1 if box.height < MIN_ASPECT * box.width else len(runs) + 1
    blank = MapCanvas(box, (width - GAP * (columns - 1)) // columns)
    floor = blank.copy()
    floor.shade_behind(truth.walls, Pose2.of(truth.poses[0]), OUTSIDE)
    for index, scan in enumerate(scans):
        beliefs = [_belief(blank.copy(), truth, title, run[index]) for title, run in runs.items()]
        yield [_true_world(floor.copy(), episode, truth, scan), *beliefs]


def _shown(truth: Truth) -> Box:
    """The surroundings of the true path within the walls."""
    ends = truth.walls.reshape(-1, 2)
    low = np.maximum(truth.poses[:, :2].min(axis=0) - SHOWN_RANGE, ends.min(axis=0) - WALL_MARGIN)
    high = np.minimum(truth.poses[:, :2].max(axis=0) + SHOWN_RANGE, ends.max(axis=0) + WALL_MARGIN)
    return Box(float(low[0]), float(high[0]), float(low[1]), float(high[1]))


def _true_world(canvas: MapCanvas, episode: Episode, truth: Truth, number: int) -> Image.Image:
    scan, pose = episode.scans[number], Pose2.of(truth.poses[number])
    ranges = np.nan_to_num(scan.ranges, nan=0.0, posinf=scan.max_range)
    beams = fan(pose @ scan.mount, ranges, scan.angles)
    canvas.polygon(beams, BEAMS)
    canvas.lines(truth.walls, INK, 2)
    canvas.lines(truth.doors[number], DOORS, 3)
    canvas.path(truth.poses[: number + 1, :2], TRUTH, 2)
    canvas.dots(beams[1:][scan.hit], ESTIMATE, 1.5)
    canvas.robot(pose, TRUTH)
    legend = [("", INK), ("doors  ", DOORS), ("echoes  ", ESTIMATE), ("true path", TRUTH)]
    canvas.title([(f"Truth, {scan.time:.1f} s", INK), *legend])
    return canvas.finished()


def _belief(canvas: MapCanvas, truth: Truth, title: str, snapshot: Snapshot) -> Image.Image:
    estimated, true = snapshot.poses, truth.poses[: snapshot.scan + 1]
    canvas.grid(snapshot.grid)
    canvas.lines(truth.walls, WALLS, 1)
    canvas.lines(truth.doors[snapshot.scan], DOORS, 1)
    canvas.path(true[:, :2], TRUTH, 2.5)
    draw_path(canvas, estimated, snapshot.lost)
    draw_robot(canvas, Pose2.of(estimated[-1]), float(snapshot.lost[-1]))
    canvas.ring(Pose2.of(true[-1]), TRUTH)
    off = 1000 * float(np.hypot(*(estimated[-1, :2] - true[-1, :2])))
    errors = f"off by {off:.0f} mm, ATE {1000 * ate(estimated, true):.0f} mm"
    canvas.title([(f"{title}:  {errors}", INK), ("", INK), ("estimated path", ESTIMATE)])
    return canvas.finished()


def _frame(panels: Sequence[Image.Image], width: int) -> Image.Image:
    """The panels below or beside one another."""
    across, down = panels[0].size
    columns = max(width // across, 1)
    rows = -(-len(panels) // columns)
    frame = Image.new("RGB", (width, rows * down + (rows - 1) * GAP), FAINT)
    for number, panel in enumerate(panels):
        row, column = divmod(number, columns)
        frame.paste(panel, (column * (across + GAP), row * (down + GAP)))
    return frame


def _exact_colours() -> np.ndarray:
    """(n, 3) the greys of maps, our colours, and mixtures of lines with the map below them."""
    own = np.array([ImageColor.getrgb(colour) for colour in EXACT_COLOURS])
    lines = np.array([ImageColor.getrgb(colour) for colour in LINES])
    below = np.array([ImageColor.getrgb(colour) for colour in (PAPER, "#000000", UNKNOWN)])
    greys = np.repeat(GREYS[:, None], 3, axis=1)
    return np.vstack([greys, own, ((lines[:, None] + below) // 2).reshape(-1, 3)])
