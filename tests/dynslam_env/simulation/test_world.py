import math

import numpy as np
import pytest

from dynslam_env import Corridor, Door, Doors, Fixed, People, Robot, Scripted, Uniform
from dynslam_env.simulation.world import CONTROL_DT, World
from slam import InputError, Pose2
from tests.dynslam_env.driven import NIMBLE, SHUT, Driven, place

ROOM = [(0.0, 0, 6, 0), (6, 0, 6, 6), (6, 6, 0, 6), (0, 6, 0, 0), (3, 2.9, 3, 3.1)]
FIXED = Doors(law=Fixed(), open_share=0.0)


def at(start, walls=ROOM, doors=(), law=SHUT, robot=NIMBLE):
    return Driven(place(walls, doors, start), robot, law)


@pytest.mark.parametrize("heading", np.linspace(0, math.tau, 24, endpoint=False))
def test_the_robot_never_enters_a_wall_by_more_than_1_cm(heading):
    driven, rng, hit = at(Pose2(2.0, 2.5, heading)), np.random.default_rng(0), False
    for _ in range(80):
        driven.step(1.2, rng.uniform(-0.5, 0.5))
        hit |= driven.collided
        assert driven.dent() < 0.01
    assert hit
    assert 0 < driven.pose.x < 6
    assert 0 < driven.pose.y < 6


def test_nor_at_full_speed_wherever_the_physics_steps_fall():
    for start in np.arange(0.0, 0.12, 0.002):
        driven = at(Pose2(4.5 + start, 1.5, 0.0))
        for _ in range(20):
            driven.step(1.2, 0.0)
            assert driven.dent() < 0.01
        assert driven.collided
        assert abs(driven.dent()) < 0.004  # pressed on, it stands at the surface


def told(driven):
    """What was touched in the last step."""
    columns = driven.batch.contact_columns()
    return {name: column.tolist()[0] for name, column in columns.items()}


def test_a_contact_names_what_was_touched_and_whether_it_still_is():
    driven, rows = at(Pose2(5.7, 1.5, 0.0)), []
    assert not any(told(driven).values())
    for v in (0.8, 0.8, 0.8, -0.8, -0.8):
        driven.step(v, 0.0)
        rows.append(told(driven))
    assert not any(rows[0].values())
    touching = {"wall": True, "door": False, "person": False, "at_end": True}
    assert {key: rows[2][key] for key in touching} == touching
    backed_off = {"wall": True, "at_end": False}  # it touched at the begin of the step
    assert {key: rows[3][key] for key in backed_off} == backed_off
    assert not any(rows[4].values())


@pytest.mark.parametrize("speed", [0.3, 0.6, 1.2])
def test_the_impulse_of_a_contact_is_the_momentum_that_it_takes(speed):
    """Inelastic, head-on: mass times speed, and the force of the wheels times 0.1 s at most."""
    driven, robot = at(Pose2(5.5, 1.5, 0.0)), NIMBLE
    while not driven.collided:
        driven.step(speed, 0.0)
    impulse = told(driven)["impulse"]
    momentum = robot.mass * speed
    assert momentum * 0.98 <= impulse <= momentum + robot.traction * CONTROL_DT


def test_doors_and_people_are_told_apart():
    leaf = Door((3.0, 1.0), math.pi / 2, 1, 0.9, 0.04)
    at_door = at(Pose2(2.4, 1.45, 0.0), doors=[leaf])
    standing = Driven(place(ROOM, (), Pose2(2.0, 1.5, 0.0),
                            [np.array([(3.0, 1.5), (3.0, 1.6)])]))  # fmt: skip
    for driven, name in ((at_door, "door"), (standing, "person")):
        for _ in range(30):
            driven.step(0.6, 0.0)
            if driven.collided:
                break
        touched = told(driven)
        assert touched.pop("impulse") > 0.0
        touched.pop("at_end")
        assert [kind for kind, is_touched in touched.items() if is_touched] == [name]


def test_a_collision_is_over_when_the_robot_has_backed_off():
    driven = at(Pose2(5.7, 1.5, 0.0))
    collided = []
    for v in (0.8, 0.8, 0.8, -0.8, -0.8, -0.8):
        driven.step(v, 0.0)
        collided.append(driven.collided)
    assert collided[0] is False
    assert collided[2] is True
    assert collided[-1] is False


@pytest.mark.parametrize("seed", range(4))
def test_nor_in_the_corridor_with_its_doors(seed):
    driven = Driven(Corridor(), NIMBLE, Doors(), seed=seed)
    rng, v, omega = np.random.default_rng(seed), 0.0, 0.0
    for i in range(300):
        if i % 15 == 0:
            v, omega = rng.choice([-1.2, 1.2]), rng.uniform(-3, 3)
        driven.step(v, omega)
        assert driven.dent() < 0.01


@pytest.mark.parametrize(("v", "omega"), [(1.0, 0.0), (0.5, 1.0), (-0.4, 3.0), (0.0, 5.2)])
def test_free_driving_follows_the_arc(v, omega):
    grips = Robot(acceleration=100, turn_acceleration=100, traction=1e4)
    driven = at(Pose2(2.0, 3.0, 0.7), robot=grips)
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
    driven, rng = at(Pose2(3.0, 1.5, 0.0), robot=Robot()), np.random.default_rng(0)
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


DOORWAY = [(0.0, -2, 0, 1), (0.9, -2, 0.9, 1), (0, 1, -2, 1), (0.9, 1, 3, 1)]
DOOR = Door((0.0, 1.0), 0.0, 1, 0.898, 0.04)  # opens to the north


def before_the_door(law=SHUT):
    return at(Pose2(0.55, 0.3, math.pi / 2), DOORWAY, [DOOR], law)


def test_a_door_can_be_pushed():
    driven = before_the_door()
    opened, touched = 0.0, False
    for _ in range(60):
        driven.step(0.4, 0.0)
        opened, touched = max(opened, driven.openings[0]), touched or driven.collided
        assert driven.dent() < 0.01
    assert touched
    assert opened > math.radians(45)
    assert driven.pose.y > 2.0


def test_a_pushed_door_falls_shut_again():
    driven = before_the_door()
    for _ in range(100):
        driven.step(0.4, 0.0)
    assert driven.pose.y > 3.0
    assert driven.openings[0] == pytest.approx(0.0, abs=0.02)


def test_a_static_door_cannot_be_pushed():
    driven = before_the_door(FIXED)
    for _ in range(60):
        driven.step(0.4, 0.0)
        assert driven.dent() < 0.01
    assert driven.openings[0] == 0.0
    assert driven.pose.y < 1.0


def test_a_moving_door_waits_for_a_robot_in_its_way():
    closing = Doors(law=Scripted(((1.0, 0),)), open_share=1.0)
    waiting = at(Pose2(0.5, 1.4, math.pi / 2), DOORWAY, [DOOR], closing)
    start, angles = waiting.pose, []
    for _ in range(60):
        waiting.step(0.0, 0.0)
        angles.append(waiting.openings[0])
        assert waiting.dent() < 0.01
    assert math.radians(20) < angles[-1] < math.radians(80)
    assert np.ptp(angles[-20:]) < 1e-3  # it stands
    assert math.dist(start[:2], waiting.pose[:2]) < 0.02
    assert waiting.collided
    for _ in range(60):
        waiting.step(0.5, 0.0)
    assert waiting.openings[0] == pytest.approx(0.0, abs=0.02)  # then it closes


def test_a_door_swings_in_one_to_two_seconds_and_stops_at_its_stop():
    opening = Doors(law=Scripted(((0.0, 0),)), open_share=0.0)
    swinging = at(Pose2(0.5, -1.0, 0.0), DOORWAY, [DOOR], opening)
    angles = []
    for _ in range(30):
        swinging.step(0.0, 0.0)
        angles.append(swinging.openings[0])
    opened = np.array(angles)
    duration = CONTROL_DT * np.argmax(opened > math.pi / 2 - 0.02)
    assert 1.0 <= duration <= 2.0
    assert opened.max() < math.pi / 2 + 0.01
    assert opened[-1] == pytest.approx(math.pi / 2, abs=1e-3)


def test_static_and_moving_doors_begin_alike():
    layout = Corridor().layout(np.random.default_rng(0))
    begin = [
        World(layout, Robot(), Doors(law=law), People(), *map(np.random.default_rng, (5, 6)))
        for law in (Fixed(), Uniform())
    ]
    openings, others = (world.openings for world in begin)
    assert (openings == others).all()
    assert 0 < (openings > 1).sum() < 8
    assert begin[0].segments == pytest.approx(begin[1].segments, abs=1e-12)


def test_walls_come_first_among_the_segments_and_the_outline_is_the_rest():
    layout = Corridor(people=2).layout(np.random.default_rng(0))
    for law in (Fixed(), Uniform()):
        parts = Robot(), Doors(law=law), People()
        world = World(layout, *parts, *map(np.random.default_rng, (5, 6)))
        assert (world.segments[: world.first_edge] == layout.walls).all()
        assert world.outline().shape == (4 * 8 + 8 * 2, 4)
        assert (world.outline() == world.segments[world.first_edge :]).all()
        assert not np.shares_memory(world.outline(), world.segments)


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
