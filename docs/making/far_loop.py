"""`python -m docs.making.far_loop [FIRST NUMBER VARIANT ...]`: two laps of 940 m.

A passage around a block of 300 x 170 m, with moving doors, and the paper's odometry: where the
first lap ends the map has drifted by metres. Prints of each drive and variant the position's error
in both laps, what is told of it, and the time of a scan; about a minute each.
"""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

import numpy as np

from agents import record_path
from dynslam_env import Loop
from slam.benchmark.run import build, warm_up
from slam.episode import Episode
from slam.geometry import Array
from slam.metrics.lost import ALARM_LEVEL

WORLD = Loop(length=300.0, breadth=170.0, outer_doors=40, inner_doors=30, laps=2)
STEPS = 100_000  # more than two laps take
FIRST, NUMBER, VARIANTS = 7700, 3, ("static-ml", "dynamic-graph")
PARTS = 5  # of a drive, of which times are means


class Driven(NamedTuple):
    """A drive of n scans.

    off    (n,) m, error of the position when it was estimated
    lost   (n,) probability of being lost
    times  (n,) ms, of the processor
    """

    off: Array
    lost: Array
    times: Array


def driven(variant: str, episode: Episode, truth: Array) -> Driven:
    """Drive once."""
    robot, rows = build(variant, episode), []
    pairs = zip(episode.displacements(), episode.scans, truth, strict=True)
    for displacement, scan, pose in pairs:
        begin = time.process_time()
        estimate = robot.update(displacement, scan.bare())
        spent = 1000.0 * (time.process_time() - begin)
        rows.append((np.hypot(*np.subtract(estimate.pose, pose)[:2]), estimate.lost, spent))
    return Driven(*np.array(rows).T)


def report(seed: int, variant: str, path: Array, found: Driven) -> None:
    """Print what happened."""
    second = path > path[-1] / 2.0
    off, times = found.off, found.times
    parts = " ".join(f"{part.mean():.2f}" for part in np.array_split(times, PARTS))
    print(
        f"{seed} {variant}: RMS {np.sqrt((off[~second] ** 2).mean()):.2f} m in the first lap, "
        f"{np.sqrt((off[second] ** 2).mean()):.2f} m in the second, {off[-1]:.2f} m at the end; "
        f"lost {100 * (found.lost > ALARM_LEVEL).mean():.1f} % of the time, at the end "
        f"{found.lost[-1]:.2f}; ms a scan {times.mean():.2f} (fifths {parts}), 99th percentile "
        f"{np.percentile(times, 99):.1f}, most {times.max():.0f}",
        flush=True,
    )


def main(first: int, number: int, variants: tuple[str, ...]) -> None:
    """Drive and print."""
    for seed in range(first, first + number):
        episode = record_path("DoorLoop-v0", seed, "moving", world=WORLD, max_episode_steps=STEPS)
        truth = episode.known_truth("this script").poses
        path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T))])
        for variant in variants:
            warm_up(variant, episode)
            report(seed, variant, path, driven(variant, episode, truth))


if __name__ == "__main__":
    given = sys.argv[1:]
    numbers = [int(text) for text in given[:2]] or [FIRST, NUMBER]
    main(numbers[0], numbers[1], tuple(given[2:]) or VARIANTS)
