"""Scores of a patrol over its whole time, by the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import ndimage

from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.worlds.layout import Layout
from slam.grid import GridSpec, OccupancyGrid
from slam.metrics.raster import rasterise
from slam.metrics.trajectory import FAILURE_ATE

MAP_PERIOD = 100  # control steps between two scorings of the SLAM's map: 10 s


class PatrolScorer:
    """Accumulates the scores of a patrol step by step.

    door_brier    squared difference between P(closed) by the dynamic map and the truth, mean over
                  doors and time
    f1_over_time  F1 at 5 cm of the SLAM's map, mean over the time
    slam_brier    the SLAM's map against the cells of doors as they stand, mean over the time
    ate           m, RMS error of the position, of each estimate when it was made
    coverage      share of the floor reachable with all doors open that the SLAM's final map has
                  observed
    path_length   m, driven
    contact       s in which the robot touched something
    reward        sum of the rewards
    regret_s      s, mean regret of the questions of the way, and `questions`, their number; in
                  `DoorPatrol-v1` only
    """

    def __init__(self, env: DoorPatrolEnv):
        self._env, self._period = env, env.period
        self._reward = self._contact = self._length = 0.0
        self._briers: list[float] = []
        self._errors: list[float] = []
        self._regrets: list[float] | None = None
        self._maps: list[dict[str, Any]] = []
        self._last = env.place.pose

    def step(self, reward: float, info: dict[str, Any]) -> None:
        """Add a step."""
        pose = self._env.place.pose
        self._length += math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        self._last = pose
        self._reward += reward
        self._contact += info["collision"] * self._period
        self._briers.append(info["door_brier"])
        self._errors.append(info["slam"]["position_error"])
        if "regrets" in info:
            self._regrets = [*(self._regrets or []), *info["regrets"]]
        if "f1_5cm" in info["slam"]:
            self._maps.append(info["slam"])

    def scores(self) -> dict[str, Any]:
        """The scores as plain data for JSON."""
        ate = math.sqrt(float(np.mean(np.square(self._errors))))
        asked = self._regrets
        told = {} if asked is None else {"regret_s": _mean(asked), "questions": len(asked)}
        return told | {
            "door_brier": _mean(self._briers),
            "f1_over_time": _mean([row["f1_5cm"] for row in self._maps]),
            "slam_brier": _mean([row["brier_now_door"] for row in self._maps]),
            "ate": ate,
            "failed": ate > FAILURE_ATE,
            "coverage": coverage(self._env.slam.map(), self._env.place.layout),
            "path_length": self._length,
            "contact": self._contact,
            "reward": self._reward,
        }


def coverage(grid: OccupancyGrid, layout: Layout) -> float:
    """Observed share of the floor that is reachable from the start with all doors open."""
    walls = layout.walls.reshape(-1, 2)
    low, high = walls.min(axis=0), walls.max(axis=0)
    spec = GridSpec.around((low[0], low[1]), (high[0], high[1]), grid.spec.resolution)
    rooms, _ = ndimage.label(~rasterise(layout.walls, spec))  # type: ignore[misc]
    start = spec.cells(np.array([layout.start[:2]]))[0]
    floor = np.argwhere(rooms == rooms[tuple(start)])
    cells = grid.spec.cells(spec.centres(floor))
    inside = ((cells >= 0) & (cells < grid.spec.shape)).all(axis=1)
    return float(grid.observed[tuple(cells[inside].T)].sum() / len(floor))


def _mean(values: Sequence[float | None]) -> float | None:
    """Mean of the finite values; None without any."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    return float(np.mean(known)) if known else None
