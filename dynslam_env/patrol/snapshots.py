"""Snapshots of a patrol: what a robot knows at one moment, and its maps as long as it lasts."""

from __future__ import annotations

from functools import partial

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.patrol.config import PatrolConfig
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.simulation.robot import Robot
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Slam
from slam.scan import Scan


def snapshot_of(
    patroller: Patroller, slam: Slam, scan: Scan, robot: Robot, config: PatrolConfig
) -> PatrolSnapshot:
    """What a robot knows after its last `scan`; its maps must be read before its next step."""
    time = scan.time
    return PatrolSnapshot(
        time, Pose2.of(slam.pose), patroller.estimate.covariance, scan, robot, config.limits,
        config.period, partial(_map, patroller, slam, time), partial(_beliefs, patroller, time),
        partial(_doors, patroller, time),
    )  # fmt: skip


def _map(patroller: Patroller, slam: Slam, time: float) -> OccupancyGrid:
    _check_current(patroller, time)
    return slam.map()


def _beliefs(patroller: Patroller, time: float) -> Beliefs:
    _check_current(patroller, time)
    return patroller.memory.beliefs(time)


def _doors(patroller: Patroller, time: float) -> list[DoorBelief]:
    _check_current(patroller, time)
    return patroller.memory.door_beliefs(time)


def _check_current(patroller: Patroller, time: float) -> None:
    if patroller.time != time:
        raise RuntimeError("a snapshot's maps must be read before the environment's step")
