"""Does a session stay bounded, and as exact as one of which nothing is dropped?

    python -m docs.making.sixty_visits DoorCorridor-v0 0.5 21

maps 60 visits of half a minute in 20 days, of the campaign with seed 21, twice: pruned as
`dynslam map --onto` does it, and with every scan kept. Both are fed the same drives. It prints the
table of docs/weeks.md: CPU time is that of placing, mapping, layers and doors.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dynslam_cli.recordings.campaign import recorded  # pyright: ignore[reportMissingImports]

from dynslam_env import WORLDS, Campaign
from dynslam_env.simulation.config import WorldConfig
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.layers import layers
from slam.registry import make
from slam.sessions.continuation import continued
from slam.sessions.door_memory import remembered
from slam.sessions.pruning import pruned
from slam.sessions.relocalisation import certain, compared
from slam.sessions.session import Session, session_of

VARIANT, DAYS, VISITS = "dynamic-graph", 20, 3
TENS = (10, 20), (20, 30), (50, 60)  # visits of a row of the table, counted from 0


class Visited(NamedTuple):
    """A visit: scans and bytes of the session after it, CPU s, ATE in m; NaN if it was not
    placed."""

    scans: int
    size: int
    seconds: float
    ate: float


class Building:
    """The session of a building, visit by visit.

    keep  what is kept of a session after each visit
    """

    def __init__(self, keep: Callable[[Session], Session]):
        self._keep, self._session = keep, None
        self.visits: list[Visited] = []

    def visit(self, episode: Episode) -> None:
        """Place, map, and learn the doors."""
        begun = time.process_time()
        ate = self._mapped(episode)
        assert self._session is not None
        made = layers(self._session.scans, self._session.poses)
        self._session = replace(self._session, doors=remembered(self._session, made.doors))
        seconds = time.process_time() - begun
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "session.npz"
            self._session.save(file)
            size = file.stat().st_size
        self.visits.append(Visited(len(self._session.scans), size, seconds, ate))

    def _mapped(self, episode: Episode) -> float:
        known = self._session
        if known is None:
            robot = make(VARIANT, true_start(episode), 0)
        else:
            try:
                robot = continued(known, VARIANT, certain(compared(known, episode)).pose, 0)
            except InputError:
                return np.nan
        poses = run(robot, episode).poses
        new = session_of(episode, poses)
        self._session = new if known is None else self._keep(known.followed_by(new.scans, poses))
        return _error(poses, episode.known_truth("a score").poses)


def _error(poses: Array, truth: Array) -> float:
    """Root mean square error of positions, m, in the frame of the building."""
    return float(np.sqrt(((poses - truth)[:, :2] ** 2).sum(axis=1).mean()))


def main(env: str, minutes: float, seed: int) -> None:
    """Print the visits one by one, then the table."""
    world = WorldConfig.of({"world": WORLDS[env][1].get("world")}).world
    campaign = Campaign(world, days=DAYS, visits=VISITS, minutes=minutes, seed=seed)
    bounded, whole = Building(pruned), Building(lambda session: session)
    for number, one in enumerate(campaign.plan()):
        episode = recorded(env, one, {})
        for building in (bounded, whole):
            building.visit(episode)
        print(number, *bounded.visits[-1], *whole.visits[-1], flush=True)
    print("\n| visits | scans kept | session.npz | CPU of a visit | ATE, mean (largest) |")
    print("|---|---|---|---|---|")
    for name, building in (("", bounded), (", nothing dropped", whole)):
        for first, end in TENS:
            print(_row(f"{first + 1} to {end}{name}", building.visits[first:end]))
    print("\nlast ten visits over visits 11 to 20:", *_growth(bounded.visits))
    ate = np.array([[1e3 * v.ate for v in one.visits] for one in (bounded, whole)])
    worse = ate[0] - ate[1]
    print(f"the last visit: ATE {ate[0, -1]:.1f} mm, {ate[1, -1]:.1f} mm with nothing dropped")
    print(f"pruned minus whole, mm: mean {np.nanmean(worse):.1f}, at most {np.nanmax(worse):.1f}, "
          f"at least {np.nanmin(worse):.1f}")  # fmt: skip


def _row(name: str, visits: Sequence[Visited]) -> str:
    scans, size, seconds, _ = np.mean(visits, axis=0)
    ate = 1e3 * np.array([one.ate for one in visits])
    placed = f"{np.isfinite(ate).sum()} of {len(ate)}"
    return (
        f"| {name} | {scans:,.0f} | {size / 1e6:.2f} MB | {seconds:.2f} s | "
        f"{np.nanmean(ate):.1f} ({np.nanmax(ate):.1f}) mm | {placed} placed |"
    )


def _growth(visits: Sequence[Visited]) -> list[str]:
    before, after = (np.mean(visits[a:b], axis=0)[:3] for a, b in (TENS[0], TENS[-1]))
    names = "scans", "bytes", "CPU"
    return [f"{name} x {x:.2f}" for name, x in zip(names, (after / before).tolist(), strict=True)]


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]))
