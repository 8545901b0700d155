"""A day in one place: cost, memory and error of a SLAM over many laps of a loop."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import NamedTuple

import gymnasium as gym
import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

import slam
from agents.scripted_path import ScriptedPath
from dynslam_env import DoorWorldEnv, Loop
from slam.algorithms.graph_slam import GraphSlam
from slam.benchmark.results import Result
from slam.geometry import Array, Pose2
from slam.interface import Slam
from slam.scan import Scan

from ..console.process_memory import resident_mb
from ..console.progress import ProgressTracker

SCANS, SEED = 100_000, 0  # of the drive: 2.8 hours, 5 km, 124 laps
ENDLESS = 10**4, 10**9  # laps and steps of the world: more than are driven
LAP = 40.0  # m of path
WARM_UP_SCANS = 300
PARTS = 5  # of the drive, whose costs are compared


class Step(NamedTuple):
    """What the SLAM is given at a scan, and the true pose."""

    displacement: Pose2
    scan: Scan
    truth: Pose2


def long_rows(variants: Sequence[str], scans: int, track: ProgressTracker) -> list[Result]:
    """One row per variant: the whole drive, scan by scan, with fresh noise and moving doors."""
    return [_row(variant, scans, track) for variant in variants]


def long_table(rows: list[Result]) -> Table:
    """The table for a terminal."""
    title = f"DoorLoop-v0, {rows[0]['scans']:,} scans in {rows[0]['laps']:.0f} laps"
    table = Table(box=HORIZONTALS, title=title)
    table.caption, table.caption_justify = COLUMN_LEGEND, "left"
    table.add_column("what", no_wrap=True)
    for heading in ("CPU ms, 1st", "last fifth", "99 %", "MB, 1st", "last", "error, mm", "maps"):
        table.add_column(heading, justify="right")
    for row in rows:
        first, *_, last = row["cpu_ms"]
        maps = "" if row["begun"] is None else f"{row['kept']} of {row['begun']}"
        table.add_row(
            row["what"], f"{first:.2f}", f"{last:.2f}", f"{row['cpu_ms_99'][-1]:.1f}",
            f"{row['mb'][0]:.0f}", f"{row['mb'][-1]:.0f}", f"{row['error_mm'][-1]:.0f}", maps,
        )  # fmt: skip
    return table


COLUMN_LEGEND = (
    "CPU ms: of the processor per scan, in the first and in the last fifth of the drive; 99 %: of "
    "a scan in the last fifth; MB: growth of the process until the end of each; error: RMS of the "
    "position in the last fifth, when it was estimated; maps: local maps kept and begun, of a graph"
)


def _row(variant: str, scans: int, track: ProgressTracker) -> Result:
    robot = _warmed_up(variant)
    before, path, memory = resident_mb(), 0.0, []
    seconds, errors = np.ones(scans), np.ones(scans)
    steps = world(scans)
    for k in track(range(scans), f"long, {variant}"):
        step = next(steps)
        if k == 0:
            robot = slam.make(variant, step.truth)
        begun = time.process_time()
        estimate = robot.update(step.displacement, step.scan)
        seconds[k] = time.process_time() - begun
        errors[k] = math.dist(estimate.pose[:2], step.truth[:2])
        path += math.hypot(*step.displacement[:2])
        if (k + 1) * PARTS >= scans * (len(memory) + 1):
            memory.append(resident_mb() - before)
    parts = np.array_split(1e3 * seconds, PARTS)
    graph = robot if isinstance(robot, GraphSlam) else None
    return {
        "what": variant,
        "scans": scans,
        "laps": path / LAP,
        "cpu_ms": [float(part.mean()) for part in parts],
        "cpu_ms_99": [float(np.percentile(part, 99)) for part in parts],
        "mb": memory,
        "error_mm": [1e3 * _rms(part) for part in np.array_split(errors, PARTS)],
        "kept": None if graph is None else len(graph.places),
        "begun": None if graph is None else graph.places[-1].ordinal + 1,
    }


def _rms(values: Array) -> float:
    return math.sqrt(np.square(values).mean())


def _warmed_up(variant: str) -> Slam:
    """A SLAM after the first scans, which compile its kernels."""
    robot = slam.make(variant)
    for displacement, scan, _ in world(WARM_UP_SCANS):
        robot.update(displacement, scan)
    return robot


def world(scans: int) -> Iterator[Step]:
    """The drive, simulated in a process of its own, whose memory is not the SLAM's."""
    context = get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_simulate, args=(theirs, scans), daemon=True)
    process.start()
    theirs.close()
    with ours:
        angles = ours.recv()
        for _ in range(scans):
            displacement, scan, truth = ours.recv()
            yield Step(displacement, replace(scan, angles=angles), truth)  # one array of angles
    process.join()


def _simulate(pipe: Connection, scans: int) -> None:
    """Drive laps of the loop, and send the angles of the beams, then a `Step` for each scan."""
    laps, steps = ENDLESS
    env = gym.make("dynslam_env:DoorLoop-v0", world=Loop(laps=laps), max_episode_steps=steps)
    env.reset(seed=SEED)
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    driver = ScriptedPath(place.layout.path, lambda: place.pose, place.robot)
    pipe.send(place.scan.angles)
    pipe.send(Step(Pose2(), place.scan, place.pose))
    for _ in range(scans - 1):
        env.step(driver.predict()[0])
        pipe.send(Step(place.displacement, place.scan, place.pose))
