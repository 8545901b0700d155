"""A robot that is driven through a layout in SI units, and how far it gets into things."""

from __future__ import annotations

import numpy as np

from dynslam_env import Doors, Laser, Layout, People, Robot, Scripted
from dynslam_env.simulation.config import WorldConfig
from dynslam_env.simulation.world_batch import WorldBatch
from slam import Pose2

NIMBLE = Robot(acceleration=100.0, turn_acceleration=100.0)
SHUT = Doors(law=Scripted(), open_share=0.0)  # nobody moves them, but they can be pushed
ALONE = np.zeros(1, dtype=np.int64)


def place(walls, doors=(), start=Pose2(), routes=()):  # noqa: B008
    """A layout by hand."""
    walls = np.asarray(walls, dtype=np.float64).reshape(-1, 4)
    return Layout(walls, tuple(doors), start, np.zeros((1, 2)), tuple(routes))


class Driven:
    """A batch of one; it steps with m/s and rad/s."""

    def __init__(
        self, layout, robot=NIMBLE, doors=SHUT, people=People(), seed=0, laser=None, odometry=None  # noqa: B008
    ):  # fmt: skip
        parts = {"world": layout, "robot": robot, "doors": doors, "people": people}
        parts |= {"laser": laser or Laser(beams=1), "odometry": odometry}
        self.batch, self.robot = WorldBatch(WorldConfig.of(parts), 1), robot
        self.batch.reset(0, np.random.default_rng(seed))
        self.world = self.batch.worlds[0]
        self.scanner = self.batch.scanners[0]

    def step(self, v=0.0, omega=0.0):
        command = np.array([[v / self.robot.max_speed, omega / self.robot.max_turn]])
        self.batch.step(ALONE, command)

    @property
    def pose(self):
        return Pose2.of(self.batch.drive.poses[0])

    @property
    def velocity(self):
        return tuple(self.batch.drive.velocities[0].tolist())

    @property
    def collided(self):
        return bool(self.batch.collided[0])

    @property
    def openings(self):
        return self.world.openings

    def dent(self):
        """How far the robot is inside of a wall, a leaf or a person, m; below zero: how far off."""
        centre = np.array([self.pose[:2]])
        return float(dents(centre, self.world.segments[None], self.robot.radius)[0])


def dents(centres, segments, radius):
    """(t,) m: how far discs at `centres` (t, 2) are inside the nearest of `segments` (t, n, 4)."""
    p, a, b = centres[:, None], segments[..., :2], segments[..., 2:]
    along = ((p - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
    nearest = a + np.clip(along, 0, 1)[..., None] * (b - a)
    return radius - np.sqrt(((nearest - p) ** 2).sum(-1)).min(-1)


class Track:
    """What happened while `driven` carried out commands (v, omega), one a control step."""

    def __init__(self, driven, commands):
        self.driven, self.walls = driven, driven.batch.layouts[0].walls
        frames = [self._frame()]
        collided, velocities = [], []
        for v, omega in commands:
            driven.step(v, omega)
            frames.append(self._frame())
            collided.append(driven.collided)
            velocities.append(driven.velocity)
        centres, segments, openings, people = zip(*frames, strict=True)
        self.centres, self.segments = np.array(centres), np.array(segments)
        self.openings, self.people = np.array(openings), np.array(people)
        self.collided, self.velocities = np.array(collided), np.array(velocities)

    def _frame(self):
        world = self.driven.world
        moving = world.segments.copy(), world.openings.copy(), world.people.copy()
        return self.driven.pose[:2], *moving

    def dent(self, which=slice(None)):
        """The worst that the robot was inside of `which` segments, m."""
        return float(dents(self.centres, self.segments[:, which], self.driven.robot.radius).max())

    def tunnelled(self):
        """The robot's centre went through a wall, or through a leaf while both moved."""
        layout = self.driven.batch.layouts[0]
        a, b = self.centres[:-1, None], self.centres[1:, None]
        through = bool(_cross(a, b, layout.walls[None, :, :2], layout.walls[None, :, 2:]).any())
        for door, openings in zip(layout.doors, self.openings.T, strict=True):
            angles = door.closed + door.swing * openings
            c, s = np.cos(angles), np.sin(angles)
            x, y = (self.centres - door.hinge).T
            seen = np.stack([c * x + s * y, c * y - s * x], axis=1)  # from the leaf
            middle = -door.swing * door.thickness / 2
            ends = np.array([(0.0, middle)]), np.array([(door.width, middle)])
            through |= bool(_cross(seen[:-1], seen[1:], *ends).any())
        return through


def _cross(a, b, p, q):
    """The ways from a to b (..., 2) cross those from p to q."""

    def side(u, v, w):
        return (v - u)[..., 0] * (w - u)[..., 1] - (v - u)[..., 1] * (w - u)[..., 0]

    return (side(a, b, p) * side(a, b, q) < 0) & (side(p, q, a) * side(p, q, b) < 0)
