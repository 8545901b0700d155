"""`python -m docs.making.laser_check LOG`: a laser's preset beside a recording of such a laser.

Prints a table of the noise, of lost echoes and of mixed pixels, of a recording of a SICK LMS200
and of simulated drives, all found by the same rules (`LaserStatistics`).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import record_path
from dynslam_env import DoorWorldEnv, Laser
from dynslam_env.sensors.laser_presets import laser_named
from slam.episode import Episode
from slam.geometry import Array
from slam.io.formats import read_log

STILL_SCANS = 10  # least number of scans in a row from one pose, for the noise
MOVED = 0.1  # m: a beam whose ranges differ by more meanwhile saw something that moved
NOISE_BINS = (0.5, 2.0, 4.0, 8.0, 16.0)  # m
SMOOTH = 0.1  # m, from beam to beam: the same surface
JUMP_BINS = (0.3, 0.6, 1.0, 2.0, 5.0)  # m, between the surfaces on both sides of a beam
BETWEEN = 0.1  # m from both surfaces
AWAY = 0.3  # m of path to the later scan that tells whether something is there
THROUGH = 0.3  # m: its beams go on behind the place by more
FOUND = 0.1  # m: or one of them ends there
SEEDS = range(5000, 5010)  # of the simulated drives

Rows = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class LaserStatistics:
    """What a laser did.

    scans, still  number of scans, and of those from a pose at which the robot stood
    noise         m, median standard deviation of a beam, by NOISE_BINS of its range
    no_echo       share of all beams
    lost          share of the beams between two beams on one smooth surface that have no echo
    edges         number of jumps of the range between smooth surfaces, by JUMP_BINS
    between       share of these jumps with a beam between them
    phantom       share of these beams, of those that a later scan tells about, where nothing is
    """

    scans: int
    still: int
    noise: list[float]
    no_echo: float
    lost: float
    edges: list[int]
    between: list[float]
    phantom: list[float]

    @property
    def mixed(self) -> Array:
        """Share of the jumps with a mixed pixel: a beam between the surfaces where nothing is."""
        return np.array(self.between) * self.phantom


class Drive(NamedTuple):
    """A drive: scans (n, beams), m, inf for no echo; poses (n, 3) of the laser; angles (beams,)."""

    scans: Array
    poses: Array
    angles: Array


def statistics(drives: Sequence[Drive], runs: Sequence[Array]) -> LaserStatistics:
    """Of drives, and of scans (m, beams) from one pose each."""
    scans = np.concatenate([drive.scans for drive in drives])
    counts = np.sum([_edges(drive) for drive in drives], axis=0)
    plain, between, phantoms, solid = counts
    edges = plain + between
    return LaserStatistics(
        len(scans), sum(map(len, runs)), _noise(runs), float(np.isinf(scans).mean()),
        _lost(scans), edges.tolist(), (between / np.maximum(edges, 1)).tolist(),
        (phantoms / np.maximum(phantoms + solid, 1)).tolist(),
    )  # fmt: skip


def _noise(runs: Sequence[Array]) -> list[float]:
    ranges, deviations = [np.empty(0)], [np.empty(0)]
    for run in runs:
        quiet = np.isfinite(run).all(axis=0)
        rows = run[:, quiet]
        rows = rows[:, np.ptp(rows, axis=0) < MOVED]
        ranges.append(rows.mean(axis=0))
        deviations.append(rows.std(axis=0, ddof=1))
    which = np.digitize(np.concatenate(ranges), NOISE_BINS)
    found = np.concatenate(deviations)
    bins = range(1, len(NOISE_BINS))
    return [float(np.median(found[which == k])) if (which == k).any() else np.nan for k in bins]


def _lost(scans: Array) -> float:
    """Of beams whose neighbours, two on each side, lie on one smooth surface."""
    a, b, c, d = scans[:, :-4], scans[:, 1:-3], scans[:, 3:-1], scans[:, 4:]
    with np.errstate(invalid="ignore"):
        smooth = (abs(b - a) < SMOOTH) & (abs(d - c) < SMOOTH) & (abs(c - b) < 2 * SMOOTH)
    return float(np.isinf(scans[:, 2:-2])[smooth].mean())


def _edges(drive: Drive) -> list[Array]:
    """By JUMP_BINS: jumps between smooth surfaces of two beams each without a beam between them,
    jumps with one; of these beams, those through which a later scan sees, and those that it
    confirms."""
    scans = drive.scans
    with np.errstate(invalid="ignore"):
        same = abs(np.diff(scans, axis=1)) < SMOOTH
        bare = scans[:, 2:-1] - scans[:, 1:-2]
        plain = abs(bare)[same[:, :-2] & same[:, 2:]]
        a, m, b = scans[:, 1:-3], scans[:, 2:-2], scans[:, 3:-1]
        inside = (m > np.minimum(a, b) + BETWEEN) & (m < np.maximum(a, b) - BETWEEN)
        found = same[:, :-3] & same[:, 3:] & inside
    rows, beams = np.nonzero(found)
    jumps = abs(b[found] - a[found])
    phantom, solid = _seen_again(drive, rows, beams + 2)
    return [_by_jump(values) for values in (plain, jumps, jumps[phantom], jumps[solid])]


def _seen_again(drive: Drive, rows: Rows, beams: Rows) -> tuple[Flags, Flags]:
    """Of readings: whether a later scan sees through their place, and whether it finds them."""
    path = np.r_[0.0, np.cumsum(np.hypot(*np.diff(drive.poses[:, :2], axis=0).T))]
    later = np.searchsorted(path, path[rows] + AWAY)
    known = later < len(path)
    later = np.where(known, later, 0)
    headings = drive.poses[rows, 2] + drive.angles[beams]
    reached = drive.scans[rows, beams]
    x = drive.poses[rows, 0] + reached * np.cos(headings) - drive.poses[later, 0]
    y = drive.poses[rows, 1] + reached * np.sin(headings) - drive.poses[later, 1]
    turned = np.arctan2(y, x) - drive.poses[later, 2]
    bearings, far = np.arctan2(np.sin(turned), np.cos(turned)), np.hypot(x, y)
    step = drive.angles[1] - drive.angles[0]
    place = np.rint((bearings - drive.angles[0]) / step).astype(np.int64)
    known &= (place >= 1) & (place < len(drive.angles) - 1)
    place = np.clip(place, 1, len(drive.angles) - 2)
    around = drive.scans[later[:, None], place[:, None] + np.arange(-1, 2)]
    beyond = (np.isfinite(around) & (around > (far + THROUGH)[:, None])).all(axis=1)
    solid = (abs(around - far[:, None]) < FOUND).any(axis=1)
    return known & beyond, known & solid


def _by_jump(jumps: Array) -> Array:
    return np.histogram(jumps, JUMP_BINS)[0]


def recorded(path: Path) -> LaserStatistics:
    """Of a recording, its poses by its odometry."""
    episode = read_log(path).episode
    drive = _drive(episode, episode.odometry.at(episode.times))
    moved = np.flatnonzero(np.abs(np.diff(drive.poses, axis=0)).max(axis=1) > 1e-6) + 1
    parts = np.split(np.arange(len(drive.scans)), moved)
    return statistics([drive], [drive.scans[part] for part in parts if len(part) >= STILL_SCANS])


def simulated(laser: Laser, env: str = "DoorOffice-v0") -> LaserStatistics:
    """Of drives along the path of a world, and of standing at its start."""
    episodes = [record_path(env, seed, laser=laser) for seed in SEEDS]
    drives = [_drive(episode, episode.known_truth("a check").poses) for episode in episodes]
    return statistics(drives, [_standing(env, seed, laser) for seed in SEEDS])


def _drive(episode: Episode, poses: Array) -> Drive:
    rows = [np.where(scan.no_echo, np.inf, scan.ranges) for scan in episode.scans]
    return Drive(np.array(rows), poses, episode.scans[0].angles)


def _standing(env_id: str, seed: int, laser: Laser) -> Array:
    env = gym.make(env_id, laser=laser, doors="static").unwrapped
    assert isinstance(env, DoorWorldEnv)
    env.reset(seed=seed)
    rows = []
    for _ in range(STILL_SCANS):
        env.step(np.zeros(2, dtype=np.float32))
        rows.append(env.scan.ranges)
    return np.array(rows)


def table(columns: dict[str, LaserStatistics]) -> str:
    """The statistics side by side, as Markdown."""
    found = list(columns.values())
    lines = [f"| | {' | '.join(columns)} |", "|---|" + "---|" * len(columns)]

    def row(name: str, cells: Iterable[str]) -> None:
        lines.append(f"| {name} | {' | '.join(cells)} |")

    row("scans, of these standing", (f"{s.scans:,}, {s.still:,}" for s in found))
    for k, (low, high) in enumerate(pairwise(NOISE_BINS)):
        row(f"noise at {low:g} to {high:g} m, mm", (f"{1e3 * s.noise[k]:.1f}" for s in found))
    row("beams without an echo, %", (f"{100 * s.no_echo:.2f}" for s in found))
    row("lost within a smooth surface, %", (f"{100 * s.lost:.3f}" for s in found))
    for k, (low, high) in enumerate(pairwise(JUMP_BINS)):
        cells = (f"{100 * s.mixed[k]:.1f} of {s.edges[k]:,}" for s in found)
        row(f"jumps of {low:g} to {high:g} m with a mixed pixel, %", cells)
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    preset = laser_named("SICK-LMS200")
    clean = Laser(max_range=preset.max_range)
    half = replace(preset, beams=361)
    columns = {Path(log).name.split(".")[0]: recorded(Path(log)) for log in sys.argv[1:]}
    columns |= {"SICK-LMS200": simulated(preset), "SICK-LMS200, 361 beams": simulated(half)}
    print(table(columns | {"Laser(), to 80 m": simulated(clean)}))


if __name__ == "__main__":
    main()
