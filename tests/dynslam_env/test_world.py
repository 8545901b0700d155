import math

import numpy as np
import pytest

from dynslam_env import Corridor, Door, Doors, Layout, Robot
from dynslam_env.world import CONTROL_DT, World
from slam import InputError, Pose2

RADIUS = 0.22
ROOM = np.array([(0.0, 0, 6, 0), (6, 0, 6, 6), (6, 6, 0, 6), (0, 6, 0, 0), (3, 2.9, 3, 3.1)])
NIMBLE = Robot(acceleration=100.0, turn_acceleration=100.0)
NEVER = Doors(dwell_min=1e6, dwell_max=1e6, open_share=0.0)


def world(start, walls=ROOM, doors=(), law=NEVER, robot=NIMBLE, seed=0):
    layout = Layout(walls, tuple(doors), start, np.zeros((1, 2)))
    return World(layout, robot, law, np.random.default_rng(seed))


def dent(world):
    """How far the robot is inside a wall or a leaf, m."""
    centre = np.array([world.pose.x, world.pose.y])
    a, b = world.segments[:, :2], world.segments[:, 2:]
    along = ((centre - a) * (b - a)).sum(1) / ((b - a) ** 2).sum(1)
    nearest = a + np.clip(along, 0, 1)[:, None] * (b - a)
    return RADIUS - np.hypot(*(nearest - centre).T).min()


@pytest.mark.parametrize("heading", np.linspace(0, math.tau, 24, endpoint=False))
def test_the_robot_never_enters_a_wall_by_more_than_1_cm(heading):
    driven, rng, hit = world(Pose2(2.0, 2.5, heading)), np.random.default_rng(0), False
    for _ in range(80):
        driven.step(1.2, rng.uniform(-0.5, 0.5))
        hit |= driven.collided
        assert dent(driven) < 0.01
    assert hit
    assert 0 < driven.pose.x < 6
    assert 0 < driven.pose.y < 6


def test_nor_at_full_speed_wherever_the_physics_steps_fall():
    for start in np.arange(0.0, 0.12, 0.002):
        driven = world(Pose2(4.5 + start, 1.5, 0.0))
        for _ in range(20):
            driven.step(1.2, 0.0)
            assert dent(driven) < 0.01
        assert driven.collided
        assert abs(dent(driven)) < 0.004  # pressed on, it stands at the surface


def test_a_collision_is_over_when_the_robot_has_backed_off():
    driven = world(Pose2(5.7, 1.5, 0.0))
    collided = []
    for v in (0.8, 0.8, 0.8, -0.8, -0.8, -0.8):
        driven.step(v, 0.0)
        collided.append(driven.collided)
    assert collided[0] is False
    assert collided[2] is True
    assert collided[-1] is False


@pytest.mark.parametrize("seed", range(4))
def test_nor_in_the_corridor_with_its_doors(seed):
    layout = Corridor().layout(np.random.default_rng(seed))
    driven = World(layout, NIMBLE, Doors(), np.random.default_rng(seed))
    rng, v, omega = np.random.default_rng(seed), 0.0, 0.0
    for i in range(300):
        if i % 15 == 0:
            v, omega = rng.choice([-1.2, 1.2]), rng.uniform(-3, 3)
        driven.step(v, omega)
        assert dent(driven) < 0.01


@pytest.mark.parametrize(("v", "omega"), [(1.0, 0.0), (0.5, 1.0), (-0.4, 3.0), (0.0, 5.2)])
def test_free_driving_follows_the_arc(v, omega):
    grips = Robot(acceleration=100, turn_acceleration=100, traction=1e4)
    driven = world(Pose2(2.0, 3.0, 0.7), robot=grips)
    driven.step(v, omega)  # what is asked for takes hold one physics step later
    turned = omega * CONTROL_DT
    arc = Pose2(v * CONTROL_DT, 0.0, 0.0)
    if omega:
        arc = Pose2(v / omega * math.sin(turned), v / omega * (1 - math.cos(turned)), turned)
    for _ in range(3):
        before = driven.pose
        driven.step(v, omega)
        assert np.array(before.between(driven.pose)) == pytest.approx(np.array(arc), abs=3e-4)
        assert driven.velocity == pytest.approx((v, omega), abs=1e-6)


def test_wheels_and_accelerations_stay_within_a_pioneers():
    driven, rng = world(Pose2(3.0, 1.5, 0.0), robot=Robot()), np.random.default_rng(0)
    previous = command = 0.0, 0.0
    for i in range(300):
        if i % 10 == 0:
            command = rng.uniform(-1.2, 1.2), rng.uniform(-5.2, 5.2)
        driven.step(*command)
        v, omega = driven.velocity
        assert abs(v) + abs(omega) * 0.33 / 2 <= 1.2 + 1e-6
        if not driven.collided:
            assert abs(v - previous[0]) <= 0.3 * CONTROL_DT + 1e-6
            assert abs(omega - previous[1]) <= 1.745 * CONTROL_DT + 1e-6
        previous = v, omega


DOORWAY = np.array([(0.0, -2, 0, 1), (0.9, -2, 0.9, 1), (0, 1, -2, 1), (0.9, 1, 3, 1)])
DOOR = Door((0.0, 1.0), 0.0, 1, 0.898, 0.04)  # opens to the north


def test_a_door_can_be_pushed():
    driven = world(Pose2(0.55, 0.3, math.pi / 2), DOORWAY, [DOOR])
    opened, touched = 0.0, False
    for _ in range(60):
        driven.step(0.4, 0.0)
        opened, touched = max(opened, driven.door_angles[0]), touched or driven.collided
        assert dent(driven) < 0.01
    assert touched
    assert opened > math.radians(45)
    assert driven.pose.y > 2.0


def test_a_pushed_door_falls_shut_again():
    driven = world(Pose2(0.55, 0.3, math.pi / 2), DOORWAY, [DOOR])
    for _ in range(100):
        driven.step(0.4, 0.0)
    assert driven.pose.y > 3.0
    assert driven.door_angles[0] == pytest.approx(0.0, abs=0.02)


def test_a_static_door_cannot_be_pushed():
    driven = world(Pose2(0.55, 0.3, math.pi / 2), DOORWAY, [DOOR], Doors("static", open_share=0.0))
    for _ in range(60):
        driven.step(0.4, 0.0)
        assert dent(driven) < 0.01
    assert driven.door_angles[0] == 0.0
    assert driven.pose.y < 1.0


def test_a_moving_door_waits_for_a_robot_in_its_way():
    waiting = world(Pose2(0.5, 1.4, math.pi / 2), DOORWAY, [DOOR], Doors(open_share=1.0))
    waiting._schedule = Once(1.0)
    start, angles = waiting.pose, []
    for _ in range(60):
        waiting.step(0.0, 0.0)
        angles.append(waiting.door_angles[0])
        assert dent(waiting) < 0.01
    assert math.radians(20) < angles[-1] < math.radians(80)
    assert np.ptp(angles[-20:]) < 1e-3  # it stands
    assert math.dist(start[:2], waiting.pose[:2]) < 0.02
    assert waiting.collided
    for _ in range(60):
        waiting.step(0.5, 0.0)
    assert waiting.door_angles[0] == pytest.approx(0.0, abs=0.02)  # then it closes


class Once:
    """Every door flips once."""

    def __init__(self, time):
        self._time = time

    def due(self, time):
        flips = [0] if time >= self._time else []
        self._time = math.inf if flips else self._time
        return flips


def test_a_door_swings_in_one_to_two_seconds_and_stops_at_its_stop():
    swinging = world(Pose2(0.5, -1.0, 0.0), DOORWAY, [DOOR])
    swinging._schedule = Once(0.0)
    angles = []
    for _ in range(30):
        swinging.step(0.0, 0.0)
        angles.append(swinging.door_angles[0])
    opened = np.array(angles)
    duration = CONTROL_DT * np.argmax(opened > math.pi / 2 - 0.02)
    assert 1.0 <= duration <= 2.0
    assert opened.max() < math.pi / 2 + 0.01
    assert opened[-1] == pytest.approx(math.pi / 2, abs=1e-3)


def test_static_and_moving_doors_begin_alike():
    layout = Corridor().layout(np.random.default_rng(0))
    begin = [
        World(layout, Robot(), Doors(law), np.random.default_rng(5)).door_angles
        for law in ("static", "moving")
    ]
    assert begin[0].tobytes() == begin[1].tobytes()
    assert 0 < (begin[0] > 1).sum() < 8


@pytest.mark.parametrize("command", [(1.2, 5.2), (-0.5, 4.0), (0.1, 0.1), (0.0, 0.0)])
def test_a_command_too_fast_for_a_wheel_is_slowed_on_the_same_arc(command):
    v, omega = Robot().feasible(*command)
    assert abs(v) + abs(omega) * 0.33 / 2 <= 1.2 + 1e-12
    assert v * command[1] == pytest.approx(omega * command[0])
    if abs(command[0]) + abs(command[1]) * 0.33 / 2 <= 1.2:
        assert (v, omega) == command


@pytest.mark.parametrize(("name", "value"), [("radius", 0), ("max_speed", -1), ("traction", None)])
def test_wrong_robots_are_refused(name, value):
    with pytest.raises(InputError, match=f"Robot.{name} must be a finite number above 0"):
        Robot(**{name: value})
