import math

import numpy as np
import pytest

from dynslam_env import Corridor, Coupled, Doors, Fixed, Scripted
from dynslam_env.simulation.doors import DoorMotors
from slam import InputError
from tests.dynslam_env import naive

DOORS = Corridor().layout(np.random.default_rng(0)).doors
DT = 0.1  # s


def flips(doors, count=8, until=2000.0, step=0.1, seed=0):
    """Times at which each door flips."""
    clock = doors.law.clock(count, np.random.default_rng(seed))
    times = [[] for _ in range(count)]
    for i in range(round(until / step)):
        for door in clock.flips_until(i * step):
            times[door].append(i * step)
    return times


def test_moving_doors_dwell_5_to_20_seconds():
    dwells = np.concatenate([np.diff([0.0, *times]) for times in flips(Doors())])
    assert 5.0 - 0.1 <= dwells.min() < 5.3
    assert 19.7 < dwells.max() <= 20.0 + 0.1
    deviation = 15 / math.sqrt(12 * len(dwells))
    assert dwells.mean() == pytest.approx(12.5, abs=5 * deviation)


def test_how_often_one_asks_changes_no_flip():
    coarse, fine = (flips(Doors(), step=step, until=100.0) for step in (1.0, 0.1))
    assert [len(times) for times in coarse] == pytest.approx([len(t) for t in fine], abs=1)
    for a, b in zip(coarse, fine, strict=True):
        n = min(len(a), len(b))
        assert np.abs(np.array(a[:n]) - b[:n]).max() <= 1.0


def test_static_doors_never_flip():
    assert not any(flips(Doors(law=Fixed()), until=100.0))
    assert Doors(law=Fixed()).fixed
    assert not Doors().fixed


def test_no_doors_no_flips():
    assert flips(Doors(), count=0, until=100.0) == []


# -- motors ----------------------------------------------------------------------------------------


def leaves(angles):
    """Rows as the physics has them, of which only the angle counts."""
    rows = np.full((len(DOORS), 6), np.nan)
    rows[:, 2] = angles
    return rows


def ends():
    """Where the leaves are when closed, and when open."""
    closed = np.array([door.closed for door in DOORS])
    return closed, closed + np.array([door.swing for door in DOORS]) * math.pi / 2


def test_motors_begin_at_rest_where_the_doors_are():
    is_open = np.arange(8) % 3 == 0
    motors = DoorMotors(DOORS, Doors(), is_open)
    closed, opened = ends()
    assert motors.targets == pytest.approx(np.where(is_open, opened, closed))
    assert motors.openings == pytest.approx(np.where(is_open, math.pi / 2, 0.0))
    assert motors.drive(leaves(motors.targets), DT) == 0
    assert not motors.rates.any()
    motors.flip(0)
    assert is_open[0]  # what was given stays as it is


def test_a_flipped_door_is_driven_the_other_way_and_back():
    motors = DoorMotors(DOORS, Doors(), np.zeros(8, dtype=bool))
    closed, opened = ends()
    motors.flip(2)
    assert motors.targets[2] == pytest.approx(opened[2])
    assert motors.drive(leaves(closed), DT) == 1
    assert np.flatnonzero(motors.rates).tolist() == [2]
    assert motors.rates[2] * DOORS[2].swing > 0
    assert motors.drive(leaves(closed), DT) == 0  # nothing new
    motors.flip(2)
    assert motors.targets == pytest.approx(closed)


def test_openings_are_zero_when_closed_and_positive_when_open():
    motors = DoorMotors(DOORS, Doors(), np.zeros(8, dtype=bool))
    shares = np.random.default_rng(0).uniform(-0.1, 1.1, 8)
    closed, opened = ends()
    motors.drive(leaves(closed + shares * (opened - closed)), DT)
    assert motors.openings == pytest.approx(shares * math.pi / 2)


def test_a_motor_is_never_too_fast_to_stop_at_the_end():
    doors = Doors()
    speed = doors.open_angle / doors.swing_time
    closed, opened = ends()
    slowest = doors.torque / doors.inertia(DOORS[0])  # rad/s^2 that the torque can brake
    for far in (1.5, 0.3, 0.1, 0.03, 0.01, 1e-4):
        motors = DoorMotors(DOORS, doors, np.zeros(8, dtype=bool))
        for i in range(8):
            motors.flip(i)
        motors.drive(leaves(opened - far * np.sign(opened - closed)), DT)
        rates = np.abs(motors.rates)
        assert (rates > 0).all()
        assert rates.max() <= speed + 1e-12
        assert (rates**2 / (2 * slowest) < far).all()
        assert (rates * DT <= far + 1e-12).all()
    motors.drive(leaves(opened), DT)
    assert not motors.rates.any()


def test_the_inertia_is_that_of_a_plate_about_its_edge():
    cells = (np.arange(2000) + 0.5) / 2000 * DOORS[0].width
    assert Doors(mass=7.0).inertia(DOORS[0]) == pytest.approx(7.0 * (cells**2).mean(), rel=1e-5)


def test_corners_agree_with_the_naive_reference():
    for door in DOORS:
        edges = naive.leaf(door, door.closed)
        c, s = math.cos(door.closed), math.sin(door.closed)
        free = np.array(door.hinge) + door.width * np.array([c, s])
        assert edges[0] == pytest.approx([*door.hinge, *free])
        to_where_it_opens = door.swing * np.array([-s, c])
        behind = (edges[2, :2] - door.hinge) @ to_where_it_opens
        assert behind == pytest.approx(-door.thickness)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"law": "revolving"}, "Doors.law must be a Law, got 'revolving'"),
        ({"open_share": 1.5}, "open_share must be a finite number from 0 to 1, got 1.5"),
        ({"open_angle": 2.0}, "open_angle"),
        ({"open_angle": 0.0}, "open_angle"),
        ({"torque": 0.0}, "torque must be a finite number above 0"),
        ({"mass": -1.0}, "mass must be a finite number above 0"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Doors(**wrong)


def test_leaves_are_fixed_however_deep_the_law_that_says_so():
    assert Doors(law=Fixed()).fixed
    assert Doors(law=Coupled(Fixed())).fixed
    assert Doors(law=Coupled(Coupled(Fixed()))).fixed
    assert not Doors(law=Coupled(Scripted())).fixed
