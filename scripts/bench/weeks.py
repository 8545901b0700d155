"""The suite `weeks`: is a robot that comes back on later days localised, and is its map of today?

One campaign (`dynslam_env.Campaign`) and one map model are one run. The first visits are mapped.
Each later visit is placed without a start pose, and then treated in two ways:

frozen  localised in the map of the first visits, which never changes
living  mapped onto the session of all visits before, and added to it

After the last visit, the week of each true door as it is remembered is kept for the page.
A visit counts as placed rightly if the start found is within 0.3 m and 10 degrees of the true one.
"""

from __future__ import annotations

import io
import time
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, replace
from typing import Any

import cloudpickle
import numpy as np

import slam
from dynslam_env import WORLDS, Campaign
from dynslam_env.simulation.config import WorldConfig
from slam.benchmark.results import Result, origin
from slam.benchmark.run import Run, build, run, true_start
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.layers import layers
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.ghosts import Ghosts
from slam.metrics.lost import is_wrong
from slam.sessions.continuation import continued, empty, localiser
from slam.sessions.door_memory import remembered
from slam.sessions.pruning import grown
from slam.sessions.redrawing import map_model_of
from slam.sessions.relocalisation import certain, compared
from slam.sessions.session import Session, session_of
from slam.sessions.static_layer import of_what_stands

from ..figures.door_weeks import learned_week
from ..recordings.campaign import recorded
from ..trials.jobs import Done, failure, file_name
from ..trials.sources import digest, simulator

LAYERED, ITS_VARIANT = "layers", "static-ml"  # localised in what always stands, of all scans so far
MAPPED, LATER = (0, 1), (3, 8, 13)  # days of the visits
PLACES = {"DoorCorridor-v0": 0.5, "DoorOffice-v0": 2.0}  # min of a visit
CELL = 0.05  # m


@dataclass(frozen=True)
class WeeksTrial:
    """One map model in one campaign: a job.

    env      one of PLACES
    variant  a SLAM variant MAP-ml or MAP-graph, or LAYERED
    seed     of the campaign
    builder  cloudpickled builder of a variant registered by the user; None for ours
    limit    time limit, s
    code     the code of the variant: see `code.Code`
    """

    env: str
    variant: str
    seed: int
    builder: bytes | None = None
    limit: float = 3600.0
    code: Mapping[str, str] | None = None

    def campaign(self) -> Campaign:
        """The campaign."""
        world = WorldConfig.of({"world": WORLDS[self.env][1].get("world")}).world
        return Campaign(
            world, days=max(LATER) + 1, visits=1, minutes=PLACES[self.env], seed=self.seed
        )

    def row(self) -> Result:
        """The part of the row that is known before the run."""
        key = digest({"env": self.env, "seed": self.seed, "simulator": simulator()})
        return {
            "run": f"{key}-{file_name(self.variant)}", "suite": "weeks", "condition": ["world"],
            "world": world_name(self.env), "variant": self.variant, "seed": self.seed,
            "episode": key, "error": None, "code": self.code, **origin(),
        }  # fmt: skip

    def __call__(self) -> Done:
        """Run and score; an exception of the tested code is a result."""
        try:
            if self.builder is not None and self.variant not in slam.variants():
                slam.register(self.variant, cloudpickle.loads(self.builder))
            with redirect_stderr(io.StringIO()):
                return Done(self.row() | self._scores())
        except Exception as error:
            return Done(self.row() | failure(error))

    def _scores(self) -> dict[str, Any]:
        begun = time.perf_counter()
        campaign = self.campaign()
        plan, middles = campaign.plan(), [door.middle for door in campaign.building().doors]
        building = Building(self.variant, self.seed)
        for day in MAPPED:
            building.visit(recorded(self.env, plan[day], {}))
        assert building.session is not None
        first, old = building.session, building.grid
        frozen, living = [], []
        for day in LATER:
            episode = recorded(self.env, plan[day], {})
            frozen.append(visit_scores(episode, building.localised(first, episode), old))
            done = building.visit(episode)
            living.append(visit_scores(episode, done, building.grid))
        return {
            **{f"frozen_{name}": value for name, value in _means(frozen).items()},
            **{f"living_{name}": value for name, value in _means(living).items()},
            "map_bytes": building.map_bytes,
            "session_bytes": _scan_bytes(building.session),
            "weeks": [learned_week(building.session.doors, middle) for middle in middles],
            "seconds": time.perf_counter() - begun,
        }


def world_name(env: str) -> str:
    """The world of an environment's id, as in results and options."""
    return env.removeprefix("Door").removesuffix("-v0").lower()


def slam_variant(variant: str) -> str:
    """The SLAM variant by which a map model of this suite maps."""
    return ITS_VARIANT if variant == LAYERED else variant


class Building:
    """What one robot knows of a building, visit by visit.

    session    all visits that were placed, pruned, with the doors that are remembered
    grid       the map after the last of them
    map_bytes  of the map model in memory
    """

    def __init__(self, variant: str, seed: int):
        self._layered = variant == LAYERED
        self._variant, self._seed = slam_variant(variant), seed
        empty(self._variant)  # raises for one that continues no map
        self.session: Session | None = None
        self.grid: OccupancyGrid | None = None
        self.map_bytes = 0

    def visit(self, episode: Episode) -> tuple[Run, Pose2] | None:
        """Map a visit onto what is known; the first one begins at its true pose. None, and nothing
        changed, if it cannot be placed."""
        if self.session is None:
            start, robot = true_start(episode), build(self._variant, episode, self._seed)
        else:
            known = self._standing(self.session)
            start = self._placed(known, episode)
            if start is None:
                return None
            robot = continued(known, self._variant, start, self._seed)
        done = run(robot, episode)
        session = grown(self.session, session_of(episode, done.poses))
        made = layers(session.scans, session.poses, believed=None if self._layered else done.grid)
        self.session = replace(session, doors=remembered(session, made.doors))
        self.grid = made.static_map() if self._layered else done.grid
        self.map_bytes = _map_bytes(robot)
        return done, start

    def localised(self, session: Session, episode: Episode) -> tuple[Run, Pose2] | None:
        """Localise a visit in the map of a session, which is not changed; None if it cannot be
        placed."""
        known = self._standing(session)
        start = self._placed(known, episode)
        if start is None:
            return None
        return run(localiser(known, self._variant, start, self._seed), episode), start

    def _standing(self, session: Session) -> Session:
        if not self._layered:
            return session
        return of_what_stands(session, layers(session.scans, session.poses))

    def _placed(self, session: Session, episode: Episode) -> Pose2 | None:
        """Where the visit begins in the map, drawn by the map model."""
        model = map_model_of(self._variant, CELL)
        try:
            return certain(compared(session, episode, map_model=model)).pose
        except InputError:
            return None


def visit_scores(
    episode: Episode, done: tuple[Run, Pose2] | None, grid: OccupancyGrid | None
) -> dict[str, float | None]:
    """Scores of one visit: how it was placed and localised, and of the map as one of today.

    off  share of the scans whose pose is wrong; 1 for a visit that was not placed
    ate  m, of visits placed rightly
    """
    truth, scorer = episode.known_truth("a score"), EpisodeScorer(episode, CELL)
    scores: dict[str, float | None] = {
        "right": 0.0, "wrong": 0.0, "unplaced": float(done is None), "off": 1.0, "ate": None,
    }  # fmt: skip
    if done is not None:
        made, start = done
        placed = not is_wrong(np.array([start]), truth.poses[:1])[0]
        scores["right" if placed else "wrong"] = 1.0
        scores["off"] = float(is_wrong(made.online, truth.poses).mean())
        scores["ate"] = scorer.ate(made.online) if placed else None
    assert grid is not None
    today = scorer.map_scores(grid, Pose2())
    ghosts = Ghosts(episode, CELL).score(grid)
    return scores | {
        "f1": today["f1_10cm"], "brier": today["brier_now_all"], "ghosts": ghosts.ghosts_per_m,
    }  # fmt: skip


def _means(visits: Sequence[dict[str, float | None]]) -> dict[str, float | None]:
    """The mean of each score over the visits that have it."""
    means: dict[str, float | None] = {}
    for name in visits[0]:
        values = [value for visit in visits if (value := visit[name]) is not None]
        means[name] = float(np.mean(values)) if values else None
    return means


def _map_bytes(robot: Any) -> int:
    """Bytes of the map in memory; of a graph, of all its maps."""
    if hasattr(robot, "nbytes"):
        return int(robot.nbytes)
    return int(robot.map_model.cells.tiles.nbytes)


def _scan_bytes(session: Session) -> int:
    """Bytes of the ranges and angles of the session's scans, before they are compressed."""
    return sum(scan.ranges.nbytes + scan.angles.nbytes for scan in session.scans)
