"""`python -m docs.making.log_faults LOG [VARIANT ...]`: real logs whose odometry fails once.

The odometry of a recording is changed at a time that is drawn, while the robot drives. Prints of
each variant and fault how the runs end and what they say, compared with its run on the recording
as it is; some minutes a log.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slam.benchmark.run import Run, build, run
from slam.episode import Episode
from slam.geometry import Pose2, between, compose
from slam.io.formats import read_log
from slam.metrics.lost import score_lost
from slam.trajectory import Trajectory

VARIANTS = "static-ml", "dynamic-graph"
SEEDS = range(5)
MIDDLE = 0.35, 0.7  # of the stretches on which the robot drives: the fault is in these
STANDS = 3.0  # s
FAR, TURNED = 1.0, math.radians(10.0)  # m, rad: a run that ends so far off is lost

Fault = Callable[[Trajectory, float, float], Trajectory]


def jump(distance: float, turn: float) -> Fault:
    """Of the odometry, straight ahead or back, m, or to a side, rad."""

    def jumped(odometry: Trajectory, time: float, sign: float) -> Trajectory:
        here = Pose2.of(odometry.at(np.array([time]))[0])
        after = here @ Pose2(sign * distance, 0.0, sign * turn) @ here.inverse()
        return moved(odometry, time, after)

    return jumped


def set_to_zero(odometry: Trajectory, time: float, sign: float) -> Trajectory:
    """The driver of the wheels begins anew."""
    return moved(odometry, time, Pose2.of(odometry.at(np.array([time]))[0]).inverse())


def stands(odometry: Trajectory, time: float, sign: float) -> Trajectory:
    """The odometry is not heard for a while, and then catches up."""
    poses = odometry.poses.copy()
    poses[_during(odometry, time)] = odometry.at(np.array([time]))[0]
    return Trajectory(odometry.times, poses)


def misses(odometry: Trajectory, time: float, sign: float) -> Trajectory:
    """The wheels' counts of a while are lost."""
    silent, (a, b) = stands(odometry, time, sign), odometry.at(np.array([time, time + STANDS]))
    return moved(silent, time + STANDS, Pose2.of(a) @ Pose2.of(b).inverse())


def longer(odometry: Trajectory, time: float, sign: float) -> Trajectory:
    """All distances are 20 % too long, or too short."""
    poses = [Pose2.of(odometry.poses[0])]
    for x, y, theta in between(odometry.poses[:-1], odometry.poses[1:]).tolist():
        poses.append(poses[-1] @ Pose2(x * (1 + 0.2 * sign), y * (1 + 0.2 * sign), theta))
    return Trajectory(odometry.times, np.array(poses))


FAULTS: dict[str, Fault] = {
    "odometry jumps by 0.8 m": jump(0.8, 0.0),
    "by 45 degrees": jump(0.0, math.pi / 4),
    "by 90 degrees": jump(0.0, math.pi / 2),
    "is set to zero": set_to_zero,
    "stands for 3 s, and catches up": stands,
    "misses 3 s": misses,
    "20 % too long, or short": longer,
}


def moved(odometry: Trajectory, time: float, by: Pose2) -> Trajectory:
    """The odometry, its poses after `time`, s, moved by a transform of its world."""
    after = (odometry.times > time)[:, None]
    poses = np.where(after, compose(by, odometry.poses), odometry.poses)
    return Trajectory(odometry.times, poses)


def _during(odometry: Trajectory, time: float) -> NDArray[np.bool_]:
    return (odometry.times > time) & (odometry.times < time + STANDS)


def when(episode: Episode, rng: np.random.Generator) -> float:
    """A time between two scans, s, at which the robot drives."""
    times = episode.times
    steps = np.hypot(*np.diff(episode.odometry.at(times)[:, :2], axis=0).T)
    drives = np.flatnonzero(steps >= np.median(steps))
    k = drives[int(len(drives) * rng.uniform(*MIDDLE))]
    return float((times[k] + times[k + 1]) / 2)


def rows(episode: Episode, variants: list[str]) -> Iterator[str]:
    """The table, in Markdown."""
    yield "| fault | variant | end off | sure and wrong, % | false alarms |"
    yield "|---|---|---|---|---|"
    usual = {variant: run(build(variant, episode), episode) for variant in variants}
    for name, fault in FAULTS.items():
        for variant in variants:
            yield row(name, fault, variant, episode, usual[variant])


def row(name: str, fault: Fault, variant: str, episode: Episode, usual: Run) -> str:
    """Of the table."""
    off, wrong, alarms = 0, [], 0
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        changed = fault(episode.odometry, when(episode, rng), float(rng.choice([-1.0, 1.0])))
        result = run(build(variant, episode), replace(episode, odometry=changed))
        away = between(usual.online[-1:], result.online[-1:])[0]
        off += bool(math.hypot(*away[:2]) > FAR or abs(away[2]) > TURNED)
        scores = score_lost(
            episode.times, result.online, usual.poses, result.lost, result.revisions
        )
        wrong.append(scores.sure_and_wrong)
        alarms += scores.false_alarms
    return (f"| {name} | `{variant}` | {off} of {len(SEEDS)} | {100 * np.mean(wrong):.1f} "
            f"| {alarms} |")  # fmt: skip


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    log = read_log(Path(sys.argv[1])).episode
    for line in rows(log, sys.argv[2:] or [*VARIANTS]):
        print(line, flush=True)
