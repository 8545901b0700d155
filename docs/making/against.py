"""`python -m docs.making.against CHECKOUT LOG [VARIANT ...] [--rounds N]`: the processor time that
a matched scan of a log takes, by that of another checkout of the project (`git worktree add`).

Each round is a process of each that drives the log twice, one thread, and counts the second time,
`finish` of a graph included. Prints ms a matched scan, and the median ratio with all of them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parents[2]
DRIVE = """
import sys, time
from dataclasses import replace
from pathlib import Path
import slam
from slam.benchmark.run import true_start
from slam.io.formats import read_log
episode = read_log(Path(sys.argv[1])).episode
moves = episode.displacements() if hasattr(episode, "displacements") else episode.motions()
moves = list(moves)
for _ in range(2):  # the first time kernels are loaded
    scans, matched = [replace(scan) for scan in episode.scans], 0
    robot = slam.make(sys.argv[2], true_start(episode))
    begun = time.process_time()
    for move, scan in zip(moves, scans, strict=True):
        matched += robot.update(move, scan).matched
    getattr(robot, "finish", lambda: None)()
    ms = 1e3 * (time.process_time() - begun) / matched
print(ms)
"""


def cost(checkout: Path, log: Path, variant: str) -> float:
    """Processor time a matched scan, ms, of the code of a checkout."""
    own = {"PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", DRIVE, str(log), variant],
        cwd=checkout, env=os.environ | own, stdout=subprocess.PIPE, check=True, text=True,
    )  # fmt: skip
    return float(done.stdout)


def main(checkout: Path, log: Path, variants: list[str], rounds: int) -> None:
    """Print a line for each variant."""
    for variant in variants:
        costs = [(cost(HERE, log, variant), cost(checkout, log, variant)) for _ in range(rounds)]
        ratios = sorted(own / other for own, other in costs)
        own, other = (median(some) for some in zip(*costs, strict=True))
        every = ", ".join(f"{ratio:.2f}" for ratio in ratios)
        print(
            f"{variant} on {log.name}: {own:.3f} ms against {other:.3f} ms, "
            f"{median(ratios):.2f} times ({every})",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkout", type=Path)
    parser.add_argument("log", type=Path)
    parser.add_argument("variants", nargs="*", default=["static-ml", "dynamic-graph"])
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    main(given.checkout.resolve(), given.log.resolve(), given.variants, given.rounds)
