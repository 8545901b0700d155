"""WorldView: the ground truth of one world of a batch, and the inputs of a SLAM in it."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from dynslam_env.faults.episode_faults import names_of
from dynslam_env.sensors.laser import Scanner
from dynslam_env.simulation.pose_bounds import pose_bound
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.world import World
from dynslam_env.simulation.world_batch import WorldBatch
from dynslam_env.worlds.layout import Layout
from slam.geometry import Array, Pose2
from slam.metrics.cramer_rao import Bound
from slam.scan import Scan


class WorldView:
    """World `row` of a batch. `DoorWorldEnv` is one, of a batch of one world; the native vector
    environments show one of each world by `get_attr` and `call`.

    All but `robot` and `config` raise `gymnasium.error.ResetNeeded` before the first reset.
    """

    def __init__(self, batch: WorldBatch, row: int = 0):
        self._batch, self._row = batch, row
        self._scan: tuple[Scanner, float, bytes, Scan] | None = None  # the last one, and its source

    @property
    def layout(self) -> Layout:
        """The layout of this episode: walls, doors, start, path, routes."""
        return self._begun.layouts[self._row]

    @property
    def physics(self) -> World:
        """The simulated world of this episode."""
        return self._begun.worlds[self._row]

    @property
    def robot(self) -> Robot:
        """The robot's body and limits."""
        return self._batch.config.robot

    @property
    def pose(self) -> Pose2:
        """The true pose of the robot."""
        return Pose2.of(self._begun.drive.poses[self._row])

    @property
    def velocity(self) -> tuple[float, float]:
        """The true velocity of the robot: forward in m/s, turning in rad/s."""
        v, omega = self._begun.drive.velocities[self._row].tolist()
        return v, omega

    @property
    def displacement(self) -> Pose2:
        """Displacement in the last step by odometry, in the robot's frame at its beginning."""
        return Pose2.of(self._begun.displacements[self._row])

    @property
    def scanner(self) -> Scanner:
        """The laser of this episode; with effects it is an `EffectScanner`."""
        return self._begun.scanners[self._row]

    @property
    def scan(self) -> Scan:
        """The last scan, in double precision: no echo is inf, no reading NaN. One object until
        there is another, with what was computed of it: copy its ranges before you write to them."""
        batch, row = self._begun, self._row
        scanner, ranges, time = batch.scanners[row], batch.ranges[row], batch.worlds[row].time
        last, read = self._scan, ranges.tobytes()
        if last is None or last[0] is not scanner or last[1] != time or last[2] != read:
            last = self._scan = scanner, time, read, scanner.scan(ranges.copy(), time)
        return last[3]

    @property
    def scan_arrived(self) -> bool:
        """Whether a scan arrived in the last step; false only during a fault such as `Gap`."""
        return self._begun.scan_arrived(self._row)

    @property
    def scan_late(self) -> int:
        """Steps ago at which the last scan was taken; above 0 only during a fault such as `Lag`."""
        faults = self._begun.faults[self._row]
        return 0 if faults is None else faults.late()

    @property
    def fault_times(self) -> dict[str, float]:
        """Name of each fault -> s, end of the first step of its last occurrence; NaN before."""
        faults = self._begun.faults[self._row]
        if faults is None:
            return {}
        return dict(zip(names_of(self._batch.config.faults), faults.since(), strict=True))

    def outline(self) -> Array:
        """(e, 4) current edges of all movable solids: x1, y1, x2, y2 in m.

        Four edges of each door leaf, then eight of each person.
        """
        return self.physics.outline()

    def bound(self) -> Bound:
        """The Cramer-Rao bound of the pose given the last scan only and the true map."""
        return pose_bound(self._begun, self._row)

    @property
    def config(self) -> dict[str, Any]:
        """All parameters, as plain data for JSON."""
        return self._batch.config.plain()

    @property
    def _begun(self) -> WorldBatch:
        if self._batch.worlds[self._row] is None:
            raise gym.error.ResetNeeded("there is no world before reset()")
        return self._batch
