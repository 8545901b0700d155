import math

import numpy as np
import pytest

from dynslam_env import DoorWorldEnv, Layout, Odometry, Robot, Slip, WheelEncoders
from dynslam_env.sensors.odometry import StepMotion, read_velocities
from slam import InputError, Pose2

BASE = 0.33  # m
FINE = 1e9  # ticks per metre
ROOM = np.array([(0, 0, 12, 0), (12, 0, 12, 8), (12, 8, 0, 8), (0, 8, 0, 0)], dtype=float)


def room(start):
    return Layout(ROOM, (), start, np.array([(1.0, 1.0)]))


def counted(encoders, rolled, noise=None):
    """(steps, n, 3) displacements that n robots hear, whose wheels turn `rolled` (steps, n, 2)."""
    rolled = np.asarray(rolled, dtype=float)
    steps, n, _ = rolled.shape
    sensor, heard = encoders.sensor(n, BASE), []
    for k in range(steps):
        motions, observed = np.empty((n, 3)), np.empty((n, 3), np.float32)
        drawn = np.zeros((n, 3)) if noise is None else noise[k]
        motion = StepMotion(np.zeros((n, 3)), np.zeros((n, 3)), rolled[k])
        sensor.read(np.arange(n), motion, drawn, motions, observed)
        assert (observed == motions.astype(np.float32)).all()
        heard.append(motions)
    return np.array(heard)


def total(motions):
    pose = Pose2()
    for motion in motions:
        pose = pose @ Pose2.of(motion)
    return pose


def drive(env, actions):
    """True and heard total displacement, and the observed velocities."""
    env.reset(seed=0)
    start, heard, velocities = env.pose, Pose2(), []
    for action in actions:
        observation = env.step(np.array(action, np.float32))[0]
        heard = heard @ env.displacement
        velocities.append(observation["velocity"])
    return start.between(env.pose), heard, np.array(velocities)


CURVES = [(0.5 + 0.4 * math.sin(k / 9), 0.15 * math.cos(k / 13)) for k in range(200)]


@pytest.mark.parametrize("robot", [Robot(), Robot(wheel_base=0.8, radius=0.4, acceleration=1.0)])
def test_without_errors_and_contacts_the_wheels_tell_the_truth(robot):
    env = DoorWorldEnv(world=room(Pose2(2.0, 2.0, 0.0)), robot=robot, odometry=WheelEncoders())
    moved, heard, _ = drive(env, CURVES)
    assert math.hypot(moved.x, moved.y) > 2.0
    assert math.dist(heard[:2], moved[:2]) < 0.01
    assert math.remainder(heard.theta - moved.theta, math.tau) == pytest.approx(0.0, abs=0.002)


def test_wheels_that_push_a_wall_are_heard_to_turn():
    start, push = Pose2(11.77, 2.0, 0.0), [(0.5, 0.0)] * 50
    moved, heard, velocities = drive(
        DoorWorldEnv(world=room(start), odometry=WheelEncoders()), push
    )
    assert moved.x < 0.011
    assert heard.x - moved.x > 0.1
    step = Robot().acceleration * 0.1  # m/s: the drive starts each step from the body's velocity
    assert velocities[-1] == pytest.approx([step, 0.0], abs=1e-6)
    moved, heard, velocities = drive(DoorWorldEnv(world=room(start)), push)  # the paper's odometry
    assert heard.x == pytest.approx(moved.x, abs=0.002)
    assert abs(velocities[-1]).max() < 1e-6


def test_ticks_are_counted_and_none_is_lost():
    rolled = np.random.default_rng(0).uniform(-0.01, 0.02, (300, 4, 2))
    heard = counted(WheelEncoders(ticks_per_metre=100.0), rolled)
    ways = np.hypot(heard[..., 0], heard[..., 1]) * np.sign(heard[..., 0])
    half = heard[..., 2] / 2
    arcs = ways / np.sinc(half / math.pi)
    left, right = arcs - BASE * half, arcs + BASE * half
    for wheel, sign in ((left, -1), (right, 1)):
        ticks = wheel * 100.0
        assert np.abs(ticks - np.round(ticks)).max() < 1e-6
        true = (rolled[..., 0] + sign * BASE / 2 * rolled[..., 1]).cumsum(axis=0) * 100.0
        behind = true - ticks.cumsum(axis=0)
        assert (behind > -1e-6).all()
        assert (behind < 1.0 + 1e-6).all()


def test_another_episode_begins_with_empty_counters():
    sensor = WheelEncoders(ticks_per_metre=10.0).sensor(2, BASE)
    motions, observed = np.empty((2, 3)), np.empty((2, 3), np.float32)
    both, rolled = np.arange(2), np.full((2, 2), (0.06, 0.0))
    motion = StepMotion(np.zeros((2, 3)), np.zeros((2, 3)), rolled)
    sensor.read(both, motion, np.zeros((2, 3)), motions, observed)
    assert motions[:, 0].tolist() == [0.0, 0.0]
    sensor.reset(0)
    sensor.read(both, motion, np.zeros((2, 3)), motions, observed)
    assert motions[:, 0] == pytest.approx([0.0, 0.1])


def test_a_larger_right_wheel_bends_a_straight_drive_to_the_left_of_what_is_heard():
    """Borenstein and Feng: with E_d the wheels' ways are told as (1 + E_d) / 2 and its share."""
    ratio = 1.02
    heard = counted(WheelEncoders(FINE, wheel_ratio=ratio), np.full((100, 1, 2), (0.05, 0.0)))
    left, right = 5.0 * (1 + ratio) / 2, 5.0 * (1 + ratio) / (2 * ratio)
    assert heard[:, 0, 2].sum() == pytest.approx((right - left) / BASE, abs=1e-6)
    assert heard[:, 0, 2].sum() < -0.2
    assert np.hypot(heard[..., 0], heard[..., 1]).sum() == pytest.approx((left + right) / 2, 1e-4)


def test_a_wrong_base_scales_turns_and_slip_scales_all():
    turn = np.full((50, 1, 2), (0.0, 0.1))
    assert counted(WheelEncoders(FINE, base_ratio=1.1), turn)[:, 0, 2].sum() == pytest.approx(5.5)
    curve = np.full((50, 1, 2), (0.02, 0.01))
    heard = counted(WheelEncoders(FINE, slip=0.1), curve)
    assert heard[:, 0, 2].sum() == pytest.approx(0.55, abs=1e-6)
    assert np.hypot(heard[..., 0], heard[..., 1]).sum() == pytest.approx(1.1, rel=1e-4)


@pytest.mark.parametrize("steps", [1, 10])
def test_the_deviation_of_a_wheel_grows_with_the_root_of_its_way(steps):
    n, sigma, way = 4000, 0.02, 0.5
    noise = np.random.default_rng(0).standard_normal((steps, n, 3))
    rolled = np.full((steps, n, 2), (way / steps, 0.0))
    heard = counted(WheelEncoders(FINE, sigma=sigma), rolled, noise)
    turns = heard[..., 2].sum(axis=0)
    expected = math.sqrt(2 * way) * sigma / BASE
    assert turns.std() == pytest.approx(expected, rel=5 / math.sqrt(2 * n))
    assert abs(turns.mean()) < 5 * expected / math.sqrt(n)


@pytest.mark.parametrize(
    "moved", [(0.1, 0.0, 0.0), (-0.1, 0.0, 0.0), (0.08, 0.01, 0.25), (0.0, 0.0, 0.3), (0, 0, 0)]
)
def test_velocities_are_those_of_the_arc_to_the_displacement(moved):
    velocities, limits = np.empty((1, 2), np.float32), np.array([9.0, 9.0])
    read_velocities(np.zeros(1, np.int64), np.array([moved], float), 0.1, limits, velocities)
    v, omega = velocities[0].tolist()
    half = omega * 0.1 / 2
    chord = v * 0.1 * np.sinc(half / math.pi)
    assert omega == pytest.approx(moved[2] / 0.1, abs=1e-6)
    assert chord == pytest.approx(math.copysign(math.hypot(*moved[:2]), moved[0]), abs=1e-6)


def dead_reckoning(velocities):
    """The pose to which velocities (n, 2) lead, each for 0.1 s."""
    return total(
        (v * 0.1 * np.sinc(w / 20 / math.pi) * math.cos(w / 20),
         v * 0.1 * np.sinc(w / 20 / math.pi) * math.sin(w / 20), w * 0.1)
        for v, w in velocities.astype(float)
    )  # fmt: skip


@pytest.mark.parametrize("odometry", [Odometry(), WheelEncoders(wheel_ratio=1.05, sigma=0.01)])
def test_dead_reckoning_by_velocity_errs_as_the_odometry_does(odometry):
    env = DoorWorldEnv(world=room(Pose2(2.0, 2.0, 0.0)), odometry=odometry)
    moved, heard, velocities = drive(env, CURVES)
    by_velocity = dead_reckoning(velocities)
    assert math.dist(heard[:2], moved[:2]) > 0.5
    assert math.dist(by_velocity[:2], heard[:2]) < 0.02
    assert env.reset(seed=1)[0]["velocity"].tolist() == [0.0, 0.0]


def test_a_slip_is_heard_in_the_velocity():
    quiet = Odometry(bias=0.0, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
    env = DoorWorldEnv(world=room(Pose2(2.0, 2.0, 0.0)), odometry=quiet, faults=[Slip(0.4, at=1.0)])
    velocities = drive(env, [(0.0, 0.0)] * 20)[2]
    assert np.abs(velocities[:, 0]).max() == pytest.approx(0.8, abs=1e-5)
    assert np.abs(velocities[:, 0]).sum() * 0.1 == pytest.approx(0.4, abs=1e-5)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"ticks_per_metre": 0.0}, "ticks_per_metre"),
        ({"wheel_ratio": -1.0}, "wheel_ratio"),
        ({"base_ratio": math.nan}, "base_ratio"),
        ({"slip": -0.1}, "slip"),
        ({"sigma": math.inf}, "sigma"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=f"WheelEncoders.{message} must be"):
        WheelEncoders(**wrong)


def test_other_odometry_is_refused():
    with pytest.raises(InputError, match="an Odometry or WheelEncoders"):
        DoorWorldEnv(odometry="good")  # type: ignore[arg-type]
