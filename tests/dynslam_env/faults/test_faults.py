"""Each fault does what it says, by the truth."""

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import (
    PATROLS,
    WORLDS,
    CarriedAway,
    DoorWorldEnv,
    Fault,
    FaultState,
    Gap,
    Lag,
    Laser,
    Loop,
    MissingBeams,
    Odometry,
    OdometryScale,
    People,
    Slip,
    WrongBeams,
)
from dynslam_env.faults.carried import CLEARANCE, along
from dynslam_env.worlds.clearance import gap
from slam import InputError, Pose2

from .drives import drive, onset, total

TRUE = Odometry(bias=0.0, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
EXACT = Laser(sigma=0.0)
STILL = (0.0, 0.0)


@pytest.fixture(scope="module")
def whole():
    return drive()


# -- the wheels --------------------------------------------------------------------------------


@pytest.mark.parametrize(("distance", "turn"), [(0.4, 0.0), (0.8, 0.0), (0.0, 0.5), (0.3, 1.0)])
def test_a_slip_is_a_motion_that_only_the_odometry_reports(distance, turn):
    made = drive([Slip(distance, turn, at=2.0)], odometry=TRUE, action=STILL)
    assert np.ptp(made.poses, axis=0).max() < 1e-9
    assert np.flatnonzero(made.moved.any(axis=1)).tolist() == [20, 21, 22, 23, 24]  # 0.5 s
    lengths = np.hypot(*made.moved[20:25, :2].T)
    assert lengths.sum() == pytest.approx(distance, abs=1e-12)
    assert abs(made.moved[:, 2].sum()) == pytest.approx(turn, abs=1e-12)
    assert abs(made.moved[:, 1]).max() < 1e-12  # along the heading
    assert made.told == pytest.approx(made.moved, abs=1e-6)


def test_a_slip_of_one_step_is_a_jump():
    made = drive([Slip(0.8, at=2.0, duration=0.1)], odometry=TRUE, action=STILL)
    assert np.flatnonzero(made.moved.any(axis=1)).tolist() == [20]
    assert abs(made.moved[20, 0]) == pytest.approx(0.8, abs=1e-12)


def test_slips_are_in_all_directions():
    ends = [total(drive([Slip(0.4, 0.3, at=1.0)], s, 15, action=STILL).moved) for s in range(30)]
    assert {(e.x > 0, e.theta > 0) for e in ends} == {(a, b) for a in (0, 1) for b in (0, 1)}


def test_a_slip_on_the_way_is_beside_what_is_driven(whole):
    made = drive([Slip(0.4, 0.0, at=4.0)])
    false = made.moved[:, 0] - whole.moved[:, 0]
    assert (made.poses == whole.poses).all()
    assert abs(false[40:45]) == pytest.approx(0.08, abs=0.003)  # along the heading after the step
    assert not false[:40].any()
    assert not false[45:].any()


def test_a_wrong_scale_is_of_translations_only(whole):
    made = drive([OdometryScale(1.2, at=3.0, duration=2.0)])
    scale = np.ones(81)
    scale[30:50] = 1.2
    assert (made.poses == whole.poses).all()
    assert made.moved[:, :2] == pytest.approx(whole.moved[:, :2] * scale[:, None], abs=1e-15)
    assert (made.moved[:, 2] == whole.moved[:, 2]).all()
    assert whole.moved[40:, 0].min() > 0.01


def test_the_odometrys_bounds_hold_in_the_observation():
    made = drive([Slip(20.0, math.pi, at=2.0)], action=STILL)
    assert abs(made.moved[:, 0]).max() == pytest.approx(4.0, abs=0.1)
    assert abs(made.told[:, 0]).max() == 1.0


# -- the laser ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("delay", "steps"), [(0.1, 1), (0.2, 2), (0.4, 4)])
def test_a_lag_gives_the_scan_of_some_time_ago(whole, delay, steps):
    made = drive([Lag(delay)])
    assert (made.moved == whole.moved).all()
    for k in range(81):
        assert made.ranges[k] == pytest.approx(whole.ranges[max(k - steps, 1 if k else 0)])
    assert (made.ranges[40] != whole.ranges[40]).any()


def test_a_lag_may_begin_and_end(whole):
    made = drive([Lag(0.4, at=3.0, duration=1.0)])
    late = [(made.ranges[k] == whole.ranges[k - 4]).all() for k in range(4, 81)]
    assert np.flatnonzero(late).tolist() == list(range(26, 36))
    assert (made.ranges[40:] == whole.ranges[40:]).all()


def test_a_gap_has_no_scans_and_the_odometry_goes_on(whole):
    made = drive([Gap(3.0, at=2.0)])
    assert np.flatnonzero(~made.arrived).tolist() == list(range(20, 50))
    assert np.isnan(made.ranges[20:50]).all()
    assert (made.observed[20:50] == 0.0).all()
    assert (made.ranges[made.arrived] == whole.ranges[made.arrived]).all()
    assert (made.moved == whole.moved).all()


def test_wrong_beams_are_anywhere(whole):
    made = drive([WrongBeams(0.2)])
    wrong = (made.ranges != whole.ranges)[1:]
    assert wrong.mean() == pytest.approx(0.2, abs=0.015)
    assert wrong.any(axis=0).all()  # drawn anew for each scan
    false = made.ranges[1:][wrong]
    assert false.min() < 0.1
    assert false.max() > 7.9
    assert false.mean() == pytest.approx(4.0, abs=0.2)


def test_missing_beams_have_no_echo(whole):
    made = drive([MissingBeams(0.3)])
    gone = (made.ranges != whole.ranges)[1:]
    heard = np.isfinite(whole.ranges[1:])
    assert gone[heard].mean() == pytest.approx(0.3, abs=0.015)
    assert np.isposinf(made.ranges[1:][gone]).all()
    assert (made.observed[1:][gone] == 8.0).all()


def test_observations_are_the_disturbed_ranges():
    made = drive([Lag(0.3), WrongBeams(0.1), MissingBeams(0.1), Gap(1.0, at=1.0)],
                 laser=Laser(dropout=0.1))  # fmt: skip
    shown = np.where(np.isposinf(made.ranges), 8.0, made.ranges)
    assert (made.observed == np.nan_to_num(shown, nan=0.0).astype(np.float32)).all()
    assert 0.1 < (made.observed == 0.0).mean() < 0.3


# -- carried away ------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_carried_back_to_where_it_was(seed):
    made = drive([CarriedAway(distance=1.5, at=6.0)], seed, odometry=TRUE)
    lifted, put = made.poses[59], made.poses[60]
    jump = np.hypot(*(put - lifted)[:2])
    assert 1.49 < jump < 3.0
    earlier = np.hypot(*(made.poses[:60] - put)[:, :2].T).argmin()
    assert made.poses[earlier] == pytest.approx(put, abs=0.02)
    assert np.hypot(*made.moved[60, :2]) < 0.01  # it starts from rest
    assert np.hypot(*made.moved[59, :2]) > 0.05
    after = total(made.moved[60:])
    true = Pose2.of(put).between(Pose2.of(made.poses[-1]))
    assert np.array(after) == pytest.approx(np.array(true), abs=0.02)  # nothing of the jump in it
    assert made.infos[60]["reward_terms"]["progress"] < 0.01


def test_the_scan_is_from_where_it_is_put_down():
    parts = {"laser": EXACT, "doors": "static"}
    made = drive([CarriedAway(distance=1.5, at=6.0)], **parts)
    env_ranges = drive(None, **parts).ranges
    earlier = np.hypot(*(made.poses[:60] - made.poses[60])[:, :2].T).argmin()
    now, then, before = (np.minimum(r, 8.0) for r in (made.ranges[60], *env_ranges[[earlier, 59]]))
    assert np.median(abs(now - then)) < 0.02
    assert np.median(abs(now - before)) > 0.02


def test_carried_to_a_new_place_of_the_path():
    made = drive([CarriedAway(to="new", distance=4.0, at=3.0)], name="DoorLoop-v0")
    away = np.hypot(*(made.poses[:30] - made.poses[30])[:, :2].T)
    assert away.min() > 3.99


def test_it_waits_for_a_place_far_enough():
    made = drive([CarriedAway(distance=2.0, at=1.0)])
    k = onset(made, "CarriedAway")
    assert np.hypot(*(made.poses[k - 2] - made.poses[0])[:2]) < 2.0
    assert np.hypot(*(made.poses[k - 1] - made.poses[0])[:2]) >= 2.0
    assert [info["faults"]["CarriedAway"] for info in made.infos].count(True) == 1


@pytest.mark.parametrize("name", ["DoorLoop-v0", "DoorCrowd-v0", "DoorOffice-v0"])
@pytest.mark.parametrize("to", ["visited", "new"])
def test_it_is_put_down_where_nothing_is(name, to):
    """Many times in a drive, at the truth of that step."""
    often = [CarriedAway(to=to, distance=1.0, at=float(at)) for at in range(3, 20, 2)]
    env = gym.make(name, faults=often).unwrapped
    assert isinstance(env, DoorWorldEnv)
    env.reset(seed=1)
    carried = 0
    for _ in range(200):
        _, _, _, _, info = env.step(np.array([0.4, 0.0], dtype=np.float32))
        if any(info["faults"].values()):
            carried += 1
            x, y = env.pose[:2]
            solids = np.concatenate([env.layout.walls, env.outline()])
            free = gap(np.array([(x, y, x, y)]), solids) - env.robot.radius
            assert free > CLEARANCE - 0.035  # a leaf moves 0.03 m in the step, a person too
    assert carried >= 4


def test_places_along_a_path():
    poses = along(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.5)]))
    assert poses[:, :2].tolist() == [[0, 0], [0.25, 0], [0.5, 0], [0.75, 0], [1, 0], [1, 0.25]]
    assert poses[:, 2] == pytest.approx([0, 0, 0, 0, math.pi / 2, math.pi / 2])
    assert along(np.zeros((1, 2))).shape == (0, 3)


# -- when, and what the info says --------------------------------------------------------------


def test_info_names_the_faults_that_act():
    made = drive([Slip(at=2.0), Gap(1.0, at=3.0), Slip(at=5.0)])
    for name, active in {"Slip": (20, 25), "Gap": (30, 40), "Slip 2": (50, 55)}.items():
        steps = [k for k, info in enumerate(made.infos) if info["faults"][name]]
        assert steps == list(range(*active))
        assert all(math.isnan(info["fault_times"][name]) for info in made.infos[: active[0]])
        since = [info["fault_times"][name] for info in made.infos[active[0] :]]
        assert since == pytest.approx([active[0] / 10] * len(since))


def test_times_are_drawn_from_their_range():
    starts = [onset(drive([Slip(at=(2.0, 6.0))], s, 70), "Slip") / 10 for s in range(15)]
    assert len(set(starts)) > 8
    assert 2.0 <= min(starts) < 3.5
    assert 4.5 < max(starts) <= 6.1


def test_the_same_seed_gives_the_same_faults():
    faults = [Slip(at=(1.0, 3.0)), WrongBeams(), MissingBeams(), Lag(),
              CarriedAway(distance=1.0, at=(3.0, 6.0)), Gap(1.0, at=(4.0, 7.0))]  # fmt: skip
    a, b, other = (drive(faults, seed) for seed in (5, 5, 6))
    for mine, theirs in zip(a[:-1], b[:-1], strict=True):
        assert mine.tobytes() == theirs.tobytes()
    assert [i["faults"] for i in a.infos] == [i["faults"] for i in b.infos]
    assert a.moved.tobytes() != other.moved.tobytes()


def test_a_fault_changes_no_random_number_of_anything_else(whole):
    """Nor of another fault, nor of the next episode."""
    made = drive([MissingBeams(0.5), Slip(at=(1.0, 6.0))])
    alone = drive([WrongBeams(0.5), Slip(at=(1.0, 6.0))])
    assert (made.poses == whole.poses).all()
    assert (made.moved == alone.moved).all()
    assert all(
        (a["door_angles"] == b["door_angles"]).all()
        for a, b in zip(made.infos, whole.infos, strict=True)
    )
    assert "faults" not in whole.infos[0]


def test_the_episode_after_is_the_same_with_faults_and_without():
    seen = []
    for faults in ((), [MissingBeams(at=5.0)]):
        env = DoorWorldEnv(faults=faults, people=People())
        env.reset(seed=4)
        seen.append(env.reset()[0]["scan"])
    assert (seen[0] == seen[1]).all()


def test_the_configuration_names_them():
    env = DoorWorldEnv(world=Loop(), faults=[Slip(0.8, at=(3.0, 4.0)), Lag()])
    assert env.config["faults"] == [
        {"type": "Slip", "distance": 0.8, "turn": 0.0, "at": [3.0, 4.0], "duration": 0.5},
        {"type": "Lag", "delay": 0.2, "at": 0.0, "duration": None},
    ]
    assert DoorWorldEnv(faults=None).config["faults"] == []


def any_value(value: Any) -> Any:
    """For values that the type checker refuses, too."""
    return value


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Slip(distance=-0.1), r"Slip\.distance must be a finite number of at least 0"),
        (lambda: Slip(turn=4.0), r"Slip\.turn must be a finite number from 0 to 3.14"),
        (lambda: Slip(duration=0.0), r"Slip\.duration must be a finite number above 0"),
        (lambda: Slip(at=-1.0), r"Slip\.at must be a time in s of at least 0, or a pair"),
        (lambda: Slip(at=(3.0, 2.0)), r"Slip\.at must be a time .* got \(3.0, 2.0\)"),
        (lambda: Slip(at=any_value("now")), r"Slip\.at must be a time"),
        (lambda: Slip(at=any_value((1.0, 2.0, 3.0))), r"Slip\.at must be a time"),
        (lambda: Gap(at=math.inf), r"Gap\.at must be a time"),
        (lambda: Gap(duration=0.0), r"Gap\.duration must be a finite number above 0"),
        (lambda: Lag(delay=math.nan), r"Lag\.delay must be a finite number from 0 to 60"),
        (lambda: Lag(duration=-1.0), r"Lag\.duration must be a finite number above 0"),
        (lambda: OdometryScale(0.0), r"OdometryScale\.factor must be a finite number above 0"),
        (lambda: WrongBeams(1.1), r"WrongBeams\.share must be a finite number from 0 to 1"),
        (lambda: MissingBeams(-0.1), r"MissingBeams\.share must be a finite number from 0 to 1"),
        (lambda: CarriedAway(to="home"), r"CarriedAway\.to must be one of 'visited', 'new'"),
        (lambda: CarriedAway(distance=0), r"CarriedAway\.distance must be a finite number above"),
        (lambda: drive(Slip(), steps=0), r"faults must be a list of faults \(Slip, "),
        (lambda: drive("Slip", steps=0), r"faults must be a list of faults"),
        (lambda: drive([Slip], steps=0), r"a fault must be one of Slip, OdometryScale, Lag"),
        (lambda: drive([3], steps=0), r"a fault must be one of .* got 3"),
    ],
)
def test_wrong_values_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


@pytest.mark.parametrize("name", [*WORLDS, *PATROLS])
def test_every_environment_takes_faults(name):
    env = gym.make(name, faults=[Slip(at=0.2), Gap(0.5, at=0.3), Slip(at=0.4)])
    _, info = env.reset(seed=0)
    assert info["faults"] == {"Slip": False, "Gap": False, "Slip 2": False}
    while info["time"] < 0.65:
        info = env.step(env.action_space.sample() * 0)[4]
    times = {"Slip": 0.2, "Gap": 0.3, "Slip 2": 0.4}
    assert info["fault_times"] == pytest.approx(times)


class Blinded(FaultState):
    def disturb_scan(self, ranges):
        if self.active:
            ranges[len(ranges) // 2 :] = np.inf


class Sun:
    def begin(self, rng, setting):
        return Blinded(start=rng.uniform(2.0, 3.0), duration=20 * setting.dt)


def test_a_fault_of_ones_own(whole):
    made = drive([Sun()])
    changed = np.isinf(made.ranges[:, 90:]).all(axis=1)
    assert changed.tolist() == [info["faults"]["Sun"] for info in made.infos]
    assert changed.sum() == 20
    assert (made.ranges[:, :90] == whole.ranges[:, :90]).all()
    assert isinstance(Sun(), Fault)
