"""`python -m docs.making.looks_alike [VARIANT ...]`: drives in a building that looks alike.

Laps around a block of 70 x 40 m with moving doors; in the second of two laps some robots are
carried 45 m and more to where they have been. Prints of each variant and kind of drive how it ends,
how long it is wrong, and what it says of it; some minutes a variant.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agents import record_path
from dynslam_env import CarriedAway, Loop, Odometry, OdometryScale
from slam.benchmark.run import build, run
from slam.episode import Episode
from slam.metrics.lost import ALARM_LEVEL, LostScores, score_lost

BLOCK = Loop(length=70.0, breadth=40.0, outer_doors=8, inner_doors=5, laps=2)
WHEELS = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)  # as in the faults
CARRIED = CarriedAway(distance=45.0, at=(420.0, 560.0))  # m; s, in the second lap
SCALE = OdometryScale(1.01)
STEPS = 8000  # of 0.1 s
VARIANTS = "static-ml", "dynamic-ml", "dynamic-graph"
FAR = 1.0  # m
SOON = 20.0  # s


class Kind(NamedTuple):
    """A kind of drive."""

    laps: int
    carried: bool
    seeds: range

    def drive(self, seed: int) -> Episode:
        """The recording of one robot."""
        return record_path(
            "DoorLoop-v0", seed, "moving", world=replace(BLOCK, laps=self.laps),
            max_episode_steps=STEPS, odometry=WHEELS,
            faults=(SCALE, CARRIED) if self.carried else (SCALE,),
        )  # fmt: skip


KINDS = {
    "carried in the second lap": Kind(2, True, range(6020, 6030)),
    "two laps": Kind(2, False, range(6120, 6130)),
    "one lap": Kind(1, False, range(6240, 6260)),
}


class Judged(NamedTuple):
    """Of a drive.

    scores   see `score_lost`
    sure     whether it ends far off and does not tell
    drifts   s, how long it was wrong where it closed a loop; without those that the drive cut off
    carried  s, how long it was wrong after it was carried, infinite if to the end; None: it was not
    """

    scores: LostScores
    sure: bool
    drifts: list[float]
    carried: float | None


def judge(variant: str, episode: Episode, carried: bool) -> Judged:
    """Run a variant, and judge it."""
    result = run(build(variant, episode), episode)
    truth = episode.known_truth("a building that looks alike").poses
    times = np.array([scan.time for scan in episode.scans])
    steps = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    moment = times[int(steps.argmax()) + 1] if carried else np.inf
    scores = score_lost(times, result.online, truth, result.lost, result.revisions)
    off = float(np.hypot(*(result.online[-1, :2] - truth[-1, :2])))
    sure = off > FAR and bool(result.lost[-1] < ALARM_LEVEL)
    before = [loss for loss in scores.losses if loss.begin < moment - 1.0]
    drifts = [loss.end - loss.begin for loss in before if loss.end is not None]
    after = [loss for loss in scores.losses if loss.end is None or loss.end > moment]
    end = after[0].end if after else moment
    wrong = np.inf if end is None else end - moment
    return Judged(scores, sure, drifts, wrong if carried else None)


def rows(variants: list[str]) -> Iterator[str]:
    """The table, in Markdown."""
    yield ("| drives | variant | end off, sure | sure and wrong | false alarms | drift, s, median, "
           "most | found again | in 20 s |")  # fmt: skip
    yield "|---|---|---|---|---|---|---|---|"
    for name, kind in KINDS.items():
        drives = [kind.drive(seed) for seed in kind.seeds]
        for variant in variants:
            yield row(name, variant, [judge(variant, one, kind.carried) for one in drives])


def row(name: str, variant: str, judged: list[Judged]) -> str:
    """Of the table."""
    share = 100.0 * np.mean([one.scores.sure_and_wrong for one in judged])
    alarms = sum(one.scores.false_alarms for one in judged)
    drifts = [time for one in judged for time in one.drifts]
    drift = f"{len(drifts)}: {np.median(drifts):.0f}, {max(drifts):.0f}" if drifts else "-"
    times = [one.carried for one in judged if one.carried is not None]
    again, soon = (sum(time <= most for time in times) for most in (sys.float_info.max, SOON))
    found = f"{again} | {soon}" if times else "- | -"
    sure = sum(one.sure for one in judged)
    return (f"| {len(judged)}: {name} | `{variant}` | {sure} | {share:.1f} % | {alarms} | {drift} "
            f"| {found} |")  # fmt: skip


if __name__ == "__main__":
    for line in rows(sys.argv[1:] or [*VARIANTS]):
        print(line, flush=True)
