"""One drive with two beliefs about the doors, and the sums from which their scores are made."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import agents
from dynslam_env.patrol.belief_map import BeliefMap
from dynslam_env.patrol.door_looks import looked
from dynslam_env.patrol.doors_known import CLOSED_ANGLE, DoorsKnown, closed
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.simulation.laws import Uniform
from dynslam_env.worlds.layout import Layout
from slam.benchmark.results import Result
from slam.geometry import Array, Pose2
from slam.scan import Scan

LAWS = {"fast": Uniform(), "slow": Uniform(60.0, 400.0)}
DURATIONS = {"fast": 200.0, "slow": 400.0}  # s, of an episode
SCORE_EVERY = {"fast": 2, "slow": 5}  # decisions between two scorings
BELIEFS = ("old", "new")
GROUPS = ("fresh", "stale", "never")
FRESH_AGE = 1.0  # s since a door was last looked at
LOOK_BEAMS = 3  # beams that reach a doorway, for it to count as looked at
BINS = 10  # of probability, for calibration


class TwoBeliefs(DynamicMap):
    """The old belief, and the new one from the same scans."""

    def __init__(self) -> None:
        super().__init__()
        self.other = BeliefMap()

    def look(self, scan: Scan, pose: Pose2) -> float:
        """See `DynamicMap`."""
        self.other.look(scan, pose)
        return super().look(scan, pose)


def drive(world: str, law: str, agent: str, seed: int) -> list[Result]:
    """The row of one drive: for each group of looks and each belief the sums of `Sums`."""
    env = DoorPatrolEnv(world=world, doors=LAWS[law], memory=TwoBeliefs)
    observation, _ = env.reset(seed=seed)
    driver, state = agents.make(agent, env, seed), None
    sums, error = Sums(env.place.layout), 0.0
    steps = round(DURATIONS[law] / env.period)
    for k in range(steps):
        action, state = driver.predict(observation, state, np.array([k == 0]), deterministic=True)
        observation, *_, info = env.step(action)
        sums.watch(env)
        if k % SCORE_EVERY[law] == 0:
            sums.add(env)
        error += info["slam"]["position_error"] ** 2
    ate = float(np.sqrt(error / steps))
    row = {"world": world, "law": law, "agent": agent, "seed": seed, "ate": ate}
    return [row | sums.plain()]


class Sums:
    """Sums over doors and times: count, P(closed), closed by the truth, squared error.

    layout  of the episode: its doors are those asked for
    """

    def __init__(self, layout: Layout):
        self._doors, self._places = DoorsKnown(layout), _places(layout)
        self._looked = np.full(len(layout.doors), -np.inf)
        self._sums = np.zeros((len(BELIEFS), len(GROUPS) * BINS, 4))

    def watch(self, env: DoorPatrolEnv) -> None:
        """Note which doors the last scan looked at, by the truth."""
        reached = looked(env.place.scan, env.place.pose, self._places)[:, 0]
        self._looked[reached >= LOOK_BEAMS] = env.time

    def add(self, env: DoorPatrolEnv) -> None:
        """Ask both beliefs for all doors."""
        memory, truth = env.patroller.memory, env.place.physics.openings < CLOSED_ANGLE
        assert isinstance(memory, TwoBeliefs)
        groups = self._groups(env.time)
        for b, belief in enumerate((memory, memory.other)):
            p = closed(self._doors.near(belief, env.time))
            bins = np.minimum((p * BINS).astype(np.int64), BINS - 1)
            parts = np.column_stack([np.ones(len(p)), p, truth, (p - truth) ** 2])
            np.add.at(self._sums[b], groups * BINS + bins, parts)

    def _groups(self, time: float) -> NDArray[np.int64]:
        """(d,) indices into GROUPS."""
        return np.where(time - self._looked <= FRESH_AGE, 0, np.where(self._looked >= 0.0, 1, 2))

    def plain(self) -> dict[str, Any]:
        """For JSON: (groups, beliefs, BINS, 4)."""
        sums = self._sums.reshape(len(BELIEFS), len(GROUPS), BINS, 4).swapaxes(0, 1)
        return {"sums": np.round(sums, 6).tolist()}


def _places(layout: Layout) -> Array:
    """(d, 4) middles of the closed leaves, m; their directions, rad; widths, m."""
    rows = []
    for door in layout.doors:
        along = np.array([np.cos(door.closed), np.sin(door.closed)])
        across = np.array([-along[1], along[0]])
        middle = np.array(door.hinge) + 0.5 * (
            door.width * along - door.swing * door.thickness * across
        )
        rows.append([*middle, door.closed, door.width])
    return np.array(rows).reshape(-1, 4)
