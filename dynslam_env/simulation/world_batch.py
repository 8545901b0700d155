"""WorldBatch: n simulated worlds that step together. The single environment has a batch of one."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.faults.episode_faults import EpisodeFaults
from dynslam_env.faults.fault import Setting, Surroundings
from dynslam_env.sensors.effect_scanner import scanner_of
from dynslam_env.sensors.laser import Scanner
from dynslam_env.sensors.odometry import NoiseStreams, Odometry, StepMotion, read_velocities
from dynslam_env.simulation.config import WorldConfig
from dynslam_env.simulation.contacts import CONTACT_COLUMNS
from dynslam_env.simulation.fleet import Fleet
from dynslam_env.simulation.robot import DifferentialDrive
from dynslam_env.simulation.task import TaskProgress
from dynslam_env.simulation.world import CONTROL_DT, PHYSICS_DT, World
from dynslam_env.simulation.world_step import UNMOVED
from dynslam_env.simulation.world_table import MOTION_NOISE, SCAN_NOISE, WorldTable
from dynslam_env.worlds.layout import Generator, Layout
from dynslam_env.worlds.start_checks import check_inside, check_start
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.validation import instance

Rows = NDArray[np.int64]


class WorldBatch:
    """The worlds, and arrays with a row per world: observations, rewards, ends.

    drive          true poses and velocities
    velocities     (n, 2) float32, of the last step by odometry, m/s and rad/s, within their bounds
    progress       rewards and ends
    displacements  (n, 3) of the last step by odometry, m, m, rad
    odometry       (n, 3) float32, `displacements` within the bounds of the observation space
    ranges         (n, beams) m; no echo is inf, no reading NaN
    scans          (n, beams) float32, `ranges` within the bounds of the observation space
    contacts       (n, 5) of the last step: see `CONTACT_COLUMNS`
    collided       (n,) bool, contact in the last step
    faults         of each world; None where the environment has none

    With more than one thread the physics and lasers of the worlds run in parallel; the results are
    the same.
    """

    def __init__(self, config: WorldConfig, n: int, threads: int = 1):
        self.config = config
        self._threads, self._table = Threads(threads), WorldTable(n)
        self.drive = DifferentialDrive(config.robot, n, CONTROL_DT, PHYSICS_DT)
        self.progress = TaskProgress(config.task, n)
        self.displacements, self._before, self._noise = (np.zeros((n, 3)) for _ in range(3))
        self.odometry = np.zeros((n, 3), dtype=np.float32)
        self.velocities = np.zeros((n, 2), dtype=np.float32)
        self._sensor = config.odometry.sensor(n, config.robot.wheel_base)
        self._fastest = np.array([config.robot.max_speed, config.robot.max_turn])
        self.ranges = np.zeros((n, config.laser.beams))
        self.scans = np.zeros((n, config.laser.beams), dtype=np.float32)
        self.contacts = np.zeros((n, len(CONTACT_COLUMNS)))
        self.collided = np.zeros(n, dtype=np.bool_)
        self.layouts: list[Layout] = [None] * n  # type: ignore[list-item]
        self.worlds: list[World] = [None] * n  # type: ignore[list-item]
        self.scanners: list[Scanner] = [None] * n  # type: ignore[list-item]
        self.faults: list[EpisodeFaults | None] = [None] * n
        self._noise_streams = NoiseStreams(n)
        self._at_once, self._door_speed = False, config.doors.speed
        self._actions = np.zeros((n, 2))

    def reset(
        self,
        i: int,
        rng: np.random.Generator,
        start: Pose2 | None = None,
        place: Generator | None = None,
    ) -> None:
        """Start an episode in world `i`; all its randomness comes from `rng`.

        start  pose, instead of the layout's
        place  draws the layout, instead of the configured world

        Layout, doors, laser, odometry and people have separate streams, so that episodes that
        differ in one of them share everything else. Raises InputError for an invalid start.
        """
        config = self.config
        layout_rng, doors_rng, laser_rng, odometry_rng, people_rng = rng.spawn(5)
        layout = (place or config.world).layout(layout_rng)
        instance("what the world's layout(rng) gives", layout, Layout)
        if start is not None:
            check_inside(layout, start)
            layout = replace(layout, start=start)
        check_start(layout, layout.start, config.robot.radius, config.doors.open_angle)
        world = World(layout, config.robot, config.doors, config.people, doors_rng, people_rng)
        self.layouts[i], self.worlds[i] = layout, world
        self.scanners[i] = scanner_of(config.laser, laser_rng)
        self._noise_streams.reset(i, odometry_rng)
        self.drive.place(i, world.robot)
        self.progress.reset(i, layout, self.drive.poses[i])
        self._sensor.reset(i)
        self.displacements[i] = self.odometry[i] = self.velocities[i] = 0.0
        self.contacts[i], self.collided[i] = 0.0, False
        if config.faults:  # a stream of their own, which leaves the others as they are
            setting = Setting(config.laser, CONTROL_DT)
            self.faults[i] = EpisodeFaults(config.faults, setting, odometry_rng)
        self._bind(i)
        self._scan(i)

    @property
    def ready(self) -> bool:
        """Every world has been reset."""
        return all(world is not None for world in self.worlds)

    def discard(self, i: int) -> None:
        """Discard world `i`: it needs a reset."""
        self.worlds[i] = None  # type: ignore[call-overload]

    def step(self, which: Rows, actions: Array) -> None:
        """Step worlds `which` by CONTROL_DT seconds; actions (n, 2), clipped to -1 .. 1."""
        if not self._table.bound:  # of a copy
            for i in range(len(self.worlds)):
                self._bind(i)
        if self.config.faults:
            self._begin_faults(which, actions)
        self._actions = actions
        self._threads.each(self._advance, which)
        if not self._at_once:
            self._sense(which)

    def contact_columns(self) -> dict[str, NDArray[Any]]:
        """(n,) columns of `contacts` by name: bool, and the impulse in N s."""
        flags, impulses = self.contacts.T[:-1] > 0.0, self.contacts[:, -1].copy()
        return dict(zip(CONTACT_COLUMNS, (*flags, impulses), strict=True))

    def scan_arrived(self, i: int) -> bool:
        """Whether a scan of world `i` arrived in the last step; false only by a fault."""
        faults = self.faults[i]
        return faults is None or not faults.no_scan

    def close(self) -> None:
        """Stop the threads."""
        self._threads.close()

    def _sense(self, which: Rows) -> None:
        """As `WorldTable.sense`, for any odometry, but without the scans."""
        self.drive.read_bodies(which)
        motion = StepMotion(self._before, self.drive.poses, self.drive.rolled)
        self._sensor.read(which, motion, self._noise, self.displacements, self.odometry)
        for i in which.tolist() if self.config.faults else ():
            self._faults(i).disturb_odometry(self.displacements[i], self.odometry[i])
        read_velocities(which, self.displacements, CONTROL_DT, self._fastest, self.velocities)
        self.progress.update(which, self.drive.poses, self.collided, CONTROL_DT)

    def _faults(self, i: int) -> EpisodeFaults:
        faults = self.faults[i]
        assert faults is not None
        return faults

    def _begin_faults(self, which: Rows, actions: Array) -> None:
        """Begin the step of the faults of worlds `which`, and carry robots away."""
        wrong = which[~np.isfinite(actions[which]).all(axis=1)]
        if len(wrong):
            raise _wrong_action(actions[wrong[0]])
        for i in which.tolist():
            faults, time = self._faults(i), (self.worlds[i].steps + 1) * CONTROL_DT
            faults.advance(time)
            place = faults.carry(self._surroundings(i), time)
            if place is not None:
                self._put_robot(i, place)

    def _put_robot(self, i: int, place: Pose2) -> None:
        self.worlds[i].put_robot(place)
        self.drive.place(i, self.worlds[i].robot)
        self.progress.carried(i, self.drive.poses[i])
        self.scanners[i].carried()

    def _surroundings(self, i: int) -> Surroundings:
        world, pose = self.worlds[i], Pose2.of(self.drive.poses[i])
        return Surroundings(
            pose, self.config.robot.radius, world.segments, world.first_edge, self.layouts[i].path
        )

    def _advance(self, which: Rows) -> None:
        """Step the physics of worlds `which`, then scan."""
        remains = self._table.begin(which, self._actions, self._door_speed)
        if remains < 0:
            raise _wrong_action(self._actions[-1 - remains])
        if remains:
            for i in which[self._table.remains[which] > 0].tolist():
                self._finish(i, int(self._table.remains[i]))
        if self._at_once:
            self._table.sense(which)
        else:
            self._scan_each(which.tolist())

    def _finish(self, i: int, remains: int) -> None:
        """Do what remains to be done of the step of world `i`."""
        world = self.worlds[i]
        world.finish_step(remains)
        if remains & UNMOVED:
            self.drive.bodies[i] = world.robot
            self.collided[i] = world.contacts.any
            self.contacts[i] = world.contacts.row() if world.contacts.any else 0.0
        if remains & MOTION_NOISE:
            self._noise_streams.draw(i)
        if remains & SCAN_NOISE and self._at_once:
            self.scanners[i].draw()

    def _scan_each(self, rows: list[int]) -> None:
        for i in rows:
            self._scan(i)
        for i in rows if self.config.faults else ():
            self._faults(i).disturb_scan(self.ranges[i], self.scans[i])

    def _scan(self, i: int) -> None:
        world, rows = self.worlds[i], (self.ranges[i], self.scans[i])
        self.scanners[i].look(world.robot, world.segments, world.first_edge, *rows)

    def _bind(self, i: int) -> None:
        """Let the table know world `i`, and where the arrays are now."""
        if self.worlds[i] is None:
            return
        config, scanner = self.config, self.scanners[i]
        plain = type(scanner) is Scanner and not config.laser.dropout
        self._at_once = plain and type(config.odometry) is Odometry and not config.faults
        if not plain:  # a stand-in, which never looks
            scanner = Scanner(config.laser, np.random.default_rng(0))
            scanner.taken[:] = 1
        self._table.bind(i, self.worlds[i], scanner)
        if not self._table.bound_to(self.progress.positions.paths):
            self._table.bind_fleet(self._fleet(scanner))

    def _fleet(self, scanner: Scanner) -> Fleet:
        """The arrays, where they are now; `scanner` is any of those that look alike."""
        drive, noise, progress, odometry = (
            self.drive, self._noise_streams, self.progress, self.config.odometry
        )  # fmt: skip
        plain = odometry if isinstance(odometry, Odometry) else Odometry()
        errors = plain.bias, plain.alpha1, plain.alpha2, plain.alpha3, plain.alpha4
        return Fleet(
            drive.scale, drive.settings, drive.poses, drive.velocities, drive.wheels, drive.chords,
            drive.speeds, drive.rolled, drive.bodies, self._before, self._noise, noise.drawn,
            noise.taken, np.array(errors), self.displacements, self.odometry, self._fastest,
            self.velocities, self.collided, *progress.positions, np.array([progress.reach]),
            *progress.task_terms, progress.terms, progress.rewards, progress.ends,
            scanner.settings, scanner.fan, self.ranges, self.scans,
        )  # fmt: skip


def _wrong_action(action: Array) -> InputError:
    return InputError(f"an action is two finite numbers from -1 to 1, got {action}")


def actions_of(given: Any, shape: tuple[int, ...]) -> Array:
    """Actions of this shape as float64; raises InputError for anything else."""
    actions = np.asarray(given)
    if actions.shape != shape or actions.dtype.kind not in "fiu":
        raise InputError(
            f"actions are numbers from -1 to 1 in an array of shape {shape}, "
            f"got {actions.dtype} of shape {actions.shape}"
        )
    return actions.astype(np.float64)


class Threads:
    """A pool of `count` threads, including the caller's."""

    def __init__(self, count: int):
        self._count = count
        self._pool = ThreadPoolExecutor(count - 1) if count > 1 else None

    def __reduce__(self) -> tuple[type[Threads], tuple[int]]:
        """A copy has threads of its own."""
        return Threads, (self._count,)

    def each(self, call: Callable[[Rows], None], rows: Rows) -> None:
        """Call `call` with parts of `rows`, all of them together; an error is raised again.

        All calls have ended when this returns or raises.
        """
        if self._pool is None or len(rows) < self._count:
            return call(rows) if len(rows) else None
        parts = [rows[k :: self._count] for k in range(self._count)]
        others = [self._pool.submit(call, part) for part in parts[1:]]
        try:
            call(parts[0])
        finally:
            wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        """Stop the threads; no calls are possible afterwards."""
        if self._pool is not None:
            self._pool.shutdown()
