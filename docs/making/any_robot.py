"""`python -m docs.making.any_robot FIRST NUMBER [VARIANT ...] [--fault NAME]`: robots drawn at
random.

Each seed draws a laser, a world, the quality of the odometry, the speed, the distance between
scans, and in half of the drives a fault. Prints each drive that is wrong for a while, or
that raised a false alarm, and the table; about 10 s a drive and variant. With --fault, only the
seeds that draw it are driven.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agents import record_path
from docs.making.looks_alike import Judged, judge
from dynslam_env import (
    CarriedAway,
    Corridor,
    Gap,
    Lag,
    Laser,
    Loop,
    Odometry,
    OdometryScale,
    Office,
    Slip,
    WrongBeams,
)
from dynslam_env.sensors.laser_presets import laser_named
from scripts.trials.sources import sparser
from slam.episode import Episode
from slam.metrics.lost import Loss

VARIANTS = "static-ml", "dynamic-graph"
STEPS = 3000  # of 0.1 s
WHEN = (10.0, 60.0)  # s, when a fault happens
FULL = 359 / 360 * math.tau
LASERS: Mapping[str, Laser] = {
    "180 deg, 8 m": Laser(),
    "SICK LMS200": laser_named("SICK-LMS200"),
    "Hokuyo UTM-30LX": replace(laser_named("Hokuyo-UTM-30LX"), beams=361),
    "RPLIDAR A2": replace(laser_named("RPLIDAR-A2"), beams=400),
    "240 deg, 4 m": Laser(240, math.radians(240), 4.0, 0.06, 0.02),
    "360 deg, 3.5 m": Laser(360, FULL, 3.5, 0.12, 0.015),
    "120 beams, 10 m": Laser(120, FULL, 10.0, 0.15, 0.02, dropout=0.05),
    "120 deg, 12 m": Laser(120, math.radians(120), 12.0, sigma=0.015),
    "270 deg, 10 m": Laser(271, math.radians(270), 10.0, 0.05, 0.012),
}


class Robot(NamedTuple):
    """What a seed draws.

    every  of the scans, one of so many is kept
    """

    laser: str
    env: str
    world: Corridor | Loop | Office
    odometry: Odometry
    fault: str
    faults: tuple[CarriedAway | Gap | Lag | OdometryScale | Slip | WrongBeams, ...]
    speed: float
    every: int

    def drive(self, seed: int) -> Episode:
        """Its recording."""
        episode = record_path(
            self.env, seed, "moving", self.speed, world=self.world, laser=LASERS[self.laser],
            odometry=self.odometry, faults=self.faults, max_episode_steps=STEPS,
        )  # fmt: skip
        return sparser(episode, self.every)

    def __str__(self) -> str:
        world = self.world
        return (
            f"{self.laser}, {world.__class__.__name__} of {world.length:g} m, "
            f"{world.furniture} pieces of furniture, {world.people} people, "
            f"noise {math.sqrt(self.odometry.alpha1):g}, bias {self.odometry.bias:.2f}, "
            f"{self.fault}, {self.speed:g} m/s, one scan of {self.every}"
        )


def drawn(seed: int) -> Robot:
    """The robot of a seed."""
    draw = random.Random(seed)
    people, pieces = draw.choice((3, 8)), draw.choice((4, 10))
    env, world = draw.choice(
        (
            ("DoorCorridor-v0", Corridor()),
            ("DoorLoop-v0", Loop(laps=2)),
            ("DoorOffice-v0", Office()),
            ("DoorOffice-v0", Office(length=22.0, breadth=15.0, doors=8, furniture=pieces)),
            ("DoorLoop-v0", Loop(length=20.0, breadth=12.0, laps=2, furniture=pieces)),
            ("DoorCorridor-v0", Corridor(length=18.0, people=people)),
            ("DoorOffice-v0", Office(people=people)),
        )
    )
    variance = draw.choice((0.01, 0.02, 0.05, 0.1)) ** 2
    faults = {
        "slip": Slip(draw.uniform(0.3, 1.0), at=WHEN),
        "turn": Slip(0.0, math.radians(draw.uniform(15.0, 120.0)), WHEN),
        "lag": Lag(draw.choice((0.1, 0.2, 0.3))),
        "gap": Gap(draw.uniform(3.0, 10.0), WHEN),
        "scale": OdometryScale(draw.choice((0.85, 1.1, 1.2))),
        "carried": CarriedAway(at=WHEN),
        "wrong beams": WrongBeams(0.15),
    }
    fault = draw.choice((*["none"] * len(faults), *faults))
    return Robot(
        laser=draw.choice(tuple(LASERS)),
        env=env,
        world=world,
        odometry=Odometry(draw.choice((0.0, 0.0, 0.1, 0.35)), *[variance] * 4),
        fault=fault,
        faults=() if fault == "none" else (faults[fault],),
        speed=draw.choice((0.3, 0.55, 0.8)),
        every=draw.choice((1, 1, 2, 4)),
    )


def described(judged: Judged) -> str:
    """Its losses and false alarms."""
    parts = [_loss(loss) for loss in judged.scores.losses]
    alarms = f"{judged.scores.false_alarms} false alarms"
    return "; ".join([*parts, alarms, f"ends far off and sure: {judged.sure}"])


def _loss(loss: Loss) -> str:
    span = "to the end" if loss.end is None else f"for {loss.end - loss.begin:.1f} s"
    told = "not told" if loss.told is None else f"told after {loss.told - loss.begin:.1f} s"
    return f"wrong at {loss.begin:.0f} s, {span}, {told}"


def rows(judged: Mapping[str, list[Judged]]) -> Iterator[str]:
    """The table, in Markdown."""
    yield "| variant | drives | sure and wrong | end far off, sure | wrong at the end | alarms |"
    yield "|---|---|---|---|---|---|"
    for variant, runs in judged.items():
        share = 100.0 * np.mean([one.scores.sure_and_wrong for one in runs])
        sure, lost = sum(one.sure for one in runs), sum(one.scores.lost_at_end for one in runs)
        alarms = sum(one.scores.false_alarms for one in runs)
        hours = sum(one.scores.hours_right for one in runs)
        yield (f"| `{variant}` | {len(runs)} | {share:.2f} % | {sure} | {lost} "
               f"| {alarms} false in {hours:.1f} h |")  # fmt: skip


def main(first: int, number: int, variants: list[str], fault: str | None) -> None:
    """Judge the variants on the drives of the seeds, or of those that draw a fault."""
    judged: dict[str, list[Judged]] = {variant: [] for variant in variants}
    for seed in range(first, first + number):
        robot = drawn(seed)
        if fault not in (None, robot.fault):
            continue
        episode = robot.drive(seed)
        for variant, runs in judged.items():
            one = judge(variant, episode, carried=False)
            runs.append(one)
            if one.scores.losses or one.scores.false_alarms:
                print(f"{seed}, {variant}: {robot}: {described(one)}", flush=True)
    if not all(judged.values()):
        sys.exit(f"no seed from {first} on, of {number}, draws the fault {fault!r}")
    print("\n".join(rows(judged)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("number", type=int)
    parser.add_argument("variants", nargs="*", default=[*VARIANTS])
    parser.add_argument("--fault")
    given = parser.parse_intermixed_args()
    main(given.first, given.number, given.variants, given.fault)
