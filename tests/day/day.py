"""A day in one process: scans, steps or evaluations by the million, and whether memory is flat.

    python -m tests.day.day static-ml 1000000
    python -m tests.day.day dynamic-graph 1000000
    python -m tests.day.day steps 10000000
    python -m tests.day.day evaluations 1000

After each tenth a line tells the resident memory and the rate. The exit status is 1 if memory has
grown by more than FLAT_MB since the first tenth, beside the path that a graph keeps as its result.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import gymnasium as gym
import numpy as np

import slam
from dynslam_env import WORLDS
from scripts.console.process_memory import resident_mb
from scripts.speed.long import Step, world
from scripts.training.patrol_jobs import Patrol
from slam.algorithms.graph_slam import GraphSlam
from slam.graph.path import POSE_BYTES

PARTS = 10
FLAT_MB = 5.0  # that allocators may take and keep
DRIVE_SCANS, SEED = 4000, 0
PERIOD = 0.1  # s from scan to scan
LOST_M = 1.0
HELD = 12  # steps for which a random action is held
PATROL_STEPS = 20  # of an evaluation, 0.4 s each


class Part(NamedTuple):
    """After a part of the work.

    done  units of it
    mb    resident memory, MB
    kept  MB of it that are results
    rate  units a CPU second
    """

    done: int
    mb: float
    kept: float
    rate: float

    def grown(self, first: Part) -> float:
        """MB beside results that memory has grown by since the `first` part."""
        return self.mb - self.kept - (first.mb - first.kept)


def parts(work: Iterator[int], count: int) -> Iterator[Part]:
    """Do `count` units of work, of which each gives the bytes of its result that are kept; tells of
    each tenth."""
    kept = 0
    for number in range(PARTS):
        first, last = (count * k // PARTS for k in (number, number + 1))
        begun = time.process_time()
        kept += sum(itertools.islice(work, last - first))
        took = time.process_time() - begun
        yield Part(last, resident_mb(), kept / 1e6, (last - first) / max(took, 1e-9))


def scans(variant: str) -> Iterator[int]:
    """A SLAM on five laps of a loop there and back, again and again, its stamps going on."""
    there = list(world(DRIVE_SCANS))
    back = [
        Step(later.displacement.inverse(), step.scan, step.truth)
        for step, later in zip(there[-2::-1], there[:0:-1], strict=True)
    ]
    robot = slam.make(variant, there[0].truth)
    pose_bytes = POSE_BYTES if isinstance(robot, GraphSlam) else 0
    endless = itertools.chain(there[:1], itertools.cycle(there[1:] + back))
    for number, step in enumerate(endless):
        estimate = robot.update(step.displacement, replace(step.scan, time=PERIOD * number))
        error = math.dist(estimate.pose[:2], step.truth[:2])
        assert error < LOST_M, f"{error:.1f} m off at scan {number}"
        yield pose_bytes


def steps() -> Iterator[int]:
    """Random actions in all worlds, episode after episode, one world after the other."""
    rng = np.random.default_rng(SEED)
    worlds = [gym.make(name) for name in WORLDS]
    for episode, env in enumerate(itertools.cycle(worlds)):
        env.reset(seed=episode)
        action, over = np.zeros(2, np.float32), False
        for k in itertools.count():
            if k % HELD == 0:
                action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
            observation, reward, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
            assert math.isfinite(float(reward))
            assert all(np.isfinite(part).all() for part in observation.values())
            yield 0
            if over:
                break


def evaluations() -> Iterator[int]:
    """Episodes of `dynslam evaluate`."""
    for seed in itertools.count(SEED):
        agent = ("random", "wall-follower")[seed % 2]
        row = Patrol("corridor", "static-ml", agent, seed, PATROL_STEPS)().row
        assert row["error"] is None, row["error"]
        yield 0


WORKS: dict[str, Callable[[], Iterator[int]]] = {"steps": steps, "evaluations": evaluations}


def main() -> int:
    """The command line."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    options.add_argument("what", help="a SLAM variant, steps or evaluations")
    options.add_argument("count", type=int)
    given = options.parse_args()
    work = WORKS[given.what]() if given.what in WORKS else scans(given.what)
    begun, first, grown = time.monotonic(), None, 0.0
    for part in parts(work, given.count):
        first = first or part
        grown = part.grown(first)
        print(
            f"{part.done:>10,}  {part.mb:7.1f} MB, {part.kept:4.1f} of results, "
            f"{grown:+6.1f} beside them  {part.rate:9.0f} a CPU second  "
            f"{time.monotonic() - begun:6.0f} s",
            flush=True,
        )
    return int(grown > FLAT_MB)


if __name__ == "__main__":
    sys.exit(main())
