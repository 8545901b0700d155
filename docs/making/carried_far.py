"""`python -m docs.making.carried_far [VARIANT ...]`: carried across a building that looks alike.

Two laps around a block of 70 x 40 m with moving doors; in the second lap the robot is carried 45 m
and more to where it has been. Prints of each variant how it ends, how long it is wrong, and what it
says of it; ten drives, some minutes a variant.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from agents import record_path
from dynslam_env import CarriedAway, Loop, Odometry, OdometryScale
from slam.benchmark.run import build, run
from slam.episode import Episode
from slam.metrics.lost import ALARM_LEVEL, LostScores, score_lost

BLOCK = Loop(length=70.0, breadth=40.0, outer_doors=8, inner_doors=5, laps=2)
WHEELS = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)  # as in the faults
CARRIED = CarriedAway(distance=45.0, at=(420.0, 560.0))  # m; s, in the second lap
FAULTS = OdometryScale(1.01), CARRIED
SEEDS = range(5830, 5840)
STEPS = 8000  # of 0.1 s
VARIANTS = "static-ml", "dynamic-ml", "dynamic-graph"
FAR = 1.0  # m
SOON, LONGEST = 20.0, 1e6  # s


def drive(seed: int) -> Episode:
    """The recording of one robot."""
    return record_path(
        "DoorLoop-v0", seed, "moving", world=BLOCK, max_episode_steps=STEPS, odometry=WHEELS,
        faults=FAULTS,
    )  # fmt: skip


def judge(variant: str, episode: Episode) -> tuple[LostScores, bool, float]:
    """Its scores, whether it ends far off and does not tell, and for how long it is wrong after it
    was carried, s."""
    result = run(build(variant, episode), episode)
    truth = episode.known_truth("carried robots").poses
    times = np.array([scan.time for scan in episode.scans])
    steps = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    carried = times[int(steps.argmax()) + 1]
    found = score_lost(times, result.online, truth, result.lost, result.first)
    wrong = [loss for loss in found.losses if loss.end is None or loss.end > carried]
    end = wrong[0].end if wrong else carried
    off = float(np.hypot(*(result.online[-1, :2] - truth[-1, :2])))
    sure = off > FAR and bool(result.lost[-1] < ALARM_LEVEL)
    return found, sure, np.inf if end is None else end - carried


def rows(variants: list[str]) -> Iterator[str]:
    """The table, in Markdown."""
    yield "| variant | ends off, sure | found again | in 20 s | sure and wrong | false alarms |"
    yield "|---|---|---|---|---|---|"
    drives = [drive(seed) for seed in SEEDS]
    for variant in variants:
        judged = [judge(variant, one) for one in drives]
        off = sum(sure for _, sure, _ in judged)
        again, soon = (sum(time <= most for *_, time in judged) for most in (LONGEST, SOON))
        share = np.mean([found.sure_and_wrong for found, *_ in judged])
        alarms = sum(found.false_alarms for found, *_ in judged)
        yield f"| {variant} | {off} | {again} | {soon} | {100 * share:.1f} % | {alarms} |"


if __name__ == "__main__":
    for row in rows(sys.argv[1:] or [*VARIANTS]):
        print(row, flush=True)
