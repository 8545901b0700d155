"""The paper's experiment as trials: one episode, all variants on it, one result each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed

import slam
from agents import record_corridor
from dynslam_env.localizability import position_bounds
from slam.benchmark.configuration import configuration
from slam.benchmark.results import Result, versions
from slam.benchmark.run import run, true_start
from slam.metrics.judge import Judge

DOORS = ("static", "moving")


class Trial(NamedTuple):
    """One recorded drive: static and moving doors of one seed are a pair, the same drive."""

    seed: int
    doors: str


def trials(seeds: int) -> list[Trial]:
    """All pairs of `seeds` episodes, numbered from 0. Parameters were chosen on 1000 and up."""
    return [Trial(seed, doors) for seed in range(seeds) for doors in DOORS]


def results(todo: list[Trial], variants: list[str], jobs: int) -> Iterator[list[Result]]:
    """The results of each trial, in order, `jobs` trials at a time; the same for any `jobs`."""
    task = delayed(trial_results)
    return Parallel(n_jobs=jobs, return_as="generator")(task(t, variants) for t in todo)  # pyright: ignore


def trial_results(trial: Trial, variants: list[str]) -> list[Result]:
    """Record the episode and run each of the variants on it.

    `ate_bound` beside the scores is the episode's own, the same for all variants: the RMS over its
    scans of `position_bounds`, m.
    """
    episode = record_corridor(trial.seed, trial.doors)
    judge = Judge(episode)
    bound = float(np.sqrt((position_bounds(episode) ** 2).mean()))
    rows = []
    for variant in variants:
        robot = slam.make(variant, true_start(episode), trial.seed)
        done = run(robot, episode)
        rows.append(
            {
                "seed": trial.seed,
                "doors": trial.doors,
                "variant": variant,
                **judge.scores(done.poses, done.grid),
                "ate_online": judge.ate(done.online),
                "ate_bound": bound if math.isfinite(bound) else None,
                "scans": len(done.poses),
                "matched": done.matched,
                "seconds": done.seconds,
                "ms_per_matched_scan": done.ms_per_matched_scan,
                "slam": configuration(robot),
                "episode": episode.meta,
                "versions": versions(),
            }
        )
    return rows
