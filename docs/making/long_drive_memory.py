"""`python -m docs.making.long_drive_memory [VARIANT ...]`: memory of SLAM variants over 2 km.

The growth of the process above the episode and compiled kernels, on Linux. It takes some minutes.
"""

from __future__ import annotations

import gc
import sys
from collections import deque
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from ctypes import CDLL
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from agents import record_path
from dynslam_env.worlds.loop import Loop
from slam.benchmark.run import Playback, build
from slam.episode import Episode
from slam.interface import Estimate, Revising, Slam

ROUND = Loop(length=330.0, breadth=170.0, outer_doors=40, inner_doors=30, laps=2)
SEED, STEPS = 7, 60_000
WARM_UP = 400  # scans
STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def megabytes(name: str) -> float:
    """VmRSS, or VmHWM: the highest one since the last `clear`."""
    lines = STATUS.read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def clear() -> None:
    """Begin anew with the highest memory."""
    CLEAR.write_text("5")


def run(drive: Iterable[Estimate], scans: int) -> None:
    """Take in so many more scans."""
    deque(islice(drive, scans), maxlen=0)


def warm_up(slam: Slam, episode: Episode) -> None:
    """Compile, or load, all kernels by a short drive to its end."""
    run(Playback(slam, episode), WARM_UP)
    if isinstance(slam, Revising):
        slam.finish()


def measure(variant: str, episode: Episode) -> str:
    """What to print of a variant."""
    warm_up(build(variant, episode), episode)
    gc.collect()
    CDLL(None).malloc_trim(0)  # what is free already is not free memory for the drive
    before, drive = megabytes("VmRSS"), iter(Playback(build(variant, episode), episode))
    clear()
    run(drive, len(episode.scans) - 1)
    driven = megabytes("VmHWM") - before
    clear()
    run(drive, 1)  # the last scan, with all work at the end
    return f"{variant}: {driven:.0f} MB in the drive, {megabytes('VmHWM') - before:.0f} at its end"


def main(variants: list[str]) -> None:
    """Print a line for each variant, measured in a process of its own."""
    episode = record_path("DoorLoop-v0", SEED, "moving", world=ROUND, max_episode_steps=STEPS)
    truth = episode.known_truth("the length of a drive").poses
    length = np.hypot(*np.diff(truth[:, :2], axis=0).T).sum()
    print(f"{len(episode.scans)} scans, {length:.0f} m", flush=True)
    for variant in variants:
        with ProcessPoolExecutor(1, get_context("spawn")) as process:
            print(process.submit(measure, variant, episode).result(), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["static-ml", "dynamic-graph"])
