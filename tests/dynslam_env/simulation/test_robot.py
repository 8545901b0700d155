import math

import numpy as np
import pytest

from dynslam_env.simulation.robot import DifferentialDrive, Robot, command

N, DT = 20_000, 0.1
PIONEER = Robot()


def commanded(velocities, actions, robot=PIONEER):
    """(n, 2) velocities that the wheels ask for, from `velocities` (n, 2), all on the way."""
    drive = DifferentialDrive(robot, len(actions), DT, 0.01)
    drive.velocities[:] = velocities
    which, of_robots = np.arange(len(actions)), (drive.poses, drive.velocities, drive.wheels)
    rest = drive.chords, drive.speeds, drive.rolled
    assert command(which, actions, drive.scale, drive.settings, *of_robots, *rest) == -1
    omega = drive.wheels[:, 2]
    half = omega * DT / 2
    chord = np.sinc(half / math.pi)
    heading = velocities[:, 1] * 0.01 + half
    v = (drive.wheels[:, :2] * np.stack([np.cos(heading), np.sin(heading)], axis=1)).sum(1) / chord
    return np.stack([v, omega], axis=1)


def feasible(rng, robot=PIONEER):
    """(N, 2) velocities that the wheels can do, many of them at the limit."""
    turn = rng.uniform(-robot.max_turn, robot.max_turn, N)
    most = robot.max_speed - np.abs(turn) * robot.wheel_base / 2
    share = np.clip(rng.uniform(-1.5, 1.5, N), -1, 1)
    return np.stack([share * most, turn], axis=1)


@pytest.mark.parametrize("robot", [PIONEER, Robot(wheel_base=0.8, max_turn=2.5, acceleration=0.1)])
def test_no_command_asks_for_more_than_wheels_and_motors_can_do(robot):
    rng = np.random.default_rng(0)
    before = feasible(rng, robot)
    after = commanded(before, rng.uniform(-1.2, 1.2, (N, 2)), robot)
    change = np.abs(after - before).max(axis=0)
    assert change[0] <= robot.acceleration * DT + 1e-9
    assert change[1] <= robot.turn_acceleration * DT + 1e-9
    wheels = np.abs(after[:, 0]) + np.abs(after[:, 1]) * robot.wheel_base / 2
    assert wheels.max() <= robot.max_speed + 1e-9
    assert change == pytest.approx([robot.acceleration * DT, robot.turn_acceleration * DT])


def test_what_was_asked_for_is_reached_on_the_same_arc():
    velocities = np.zeros((3, 2))
    actions = np.array([[1.0, 1.0], [-1.0, 0.5], [0.3, 0.0]])
    for _ in range(100):
        velocities = commanded(velocities, actions)
    for (v, omega), (a, b) in zip(velocities, actions, strict=True):
        assert (v, omega) == pytest.approx(PIONEER.feasible(a * 1.2, b * 5.2))
