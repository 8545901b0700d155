"""A robot whose odometry fails, or that is carried elsewhere, is found again; doors are no loss."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from agents import record_path
from dynslam_env import CarriedAway, Gap, Loop, Odometry, OdometryScale, Slip
from dynslam_env.faults.fault import Fault
from slam import make
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.particle_filter import ParticleFilter
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, wrap_angle
from slam.graph.local_map import Keyframe
from slam.interface import LOST_DISTANCE, LOST_TURN, Estimate, Slam
from slam.recovery.places import Surroundings
from slam.recovery.watch import Watch
from slam.scan import Scan
from slam.sensor_models.beam import Beam
from tests.slam.recovery.drawn_room import room

WHEELS = Odometry(bias=0.02, alpha1=4e-4, alpha2=1e-4, alpha3=4e-4, alpha4=1e-4)
CALIBRATED = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)
SEEDS = (201, 202)
VARIANTS = ("static-ml", "dynamic-graph", "static-pf")


@cache
def drive(fault: str, seed: int) -> Episode:
    faults = {
        "none": [],
        "slip": [Slip(0.8, math.radians(20.0), at=15.0)],
        "turn": [Slip(0.0, math.radians(90.0), at=15.0)],
        "carried": [CarriedAway(at=15.0)],
    }[fault]
    return record_path("DoorCorridor-v0", seed, odometry=WHEELS, faults=faults)


@cache
def judged(fault: str, seed: int, variant: str) -> tuple[np.ndarray, np.ndarray]:
    """(n,) whether the pose is wrong, and the probability of being lost, at every scan."""
    episode = drive(fault, seed)
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    wrong = (np.hypot(*away[:, :2].T) > LOST_DISTANCE) | (
        np.abs(wrap_angle(away[:, 2])) > LOST_TURN
    )
    return wrong, result.lost


@pytest.mark.parametrize(
    ("fault", "seed"), [(fault, seed) for fault in ("slip", "turn", "carried") for seed in SEEDS]
)
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_is_found_again(variant: str, fault: str, seed: int) -> None:
    wrong, _ = judged(fault, seed, variant)
    assert not wrong[-1]
    assert wrong.sum() < 100  # scans, 0.1 s each
    if fault == "carried":
        before, _ = judged(fault, seed, variant + "/no-recovery")
        assert before[-1]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_says_that_it_was_carried_as_long_as_it_is_not_found(variant: str, seed: int) -> None:
    wrong, lost = judged("carried", seed, variant)
    noticed = np.flatnonzero(lost > 0.5)
    assert 0 <= noticed[0] - np.flatnonzero(wrong)[0] < 50  # scans: within 5 s
    assert (lost[wrong] <= 0.5).sum() < 20  # scans that are sure and wrong
    assert (lost[~wrong] <= 0.5).all()


CARRIED = CarriedAway(at=(10.0, 20.0))


def carried(
    env: str, variant: str, seed: int, fault: Fault = CARRIED
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) whether the position is wrong, and `lost`, at every scan of a robot that was carried."""
    faults = [OdometryScale(1.01), fault]
    steps = 500  # of 0.1 s
    episode = record_path(env, seed, odometry=CALIBRATED, faults=faults, max_episode_steps=steps)
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    return np.hypot(*away[:, :2].T) > LOST_DISTANCE, result.lost


@pytest.mark.parametrize(
    ("env", "variant", "seed"),
    [
        (
            "DoorLoop-v0",
            "static-ml",
            112,
        ),  # the scan changes a little, the map contradicts the next
        ("DoorLoop-v0", "static-ml", 113),  # the first scan fits there little better than here
        ("DoorLoop-v0", "static-ml", 358),  # by two doors: the scan hardly changes, the map does
        ("DoorLoop-v0", "dynamic-graph", 358),  # the same
        ("DoorCorridor-v0", "static-ml", 127),  # doors moved there: it shows more of its surface
        ("DoorOffice-v0", "dynamic-graph", 117),  # the map shows nothing of it, and no place fits
        ("DoorOffice-v0", "static-ml", 128),  # into a room that looks like this one turned round
        ("DoorOffice-v0", "static-ml", 88),  # the same; the first scan fits there little better
    ],
)
def test_a_robot_that_was_carried_to_where_it_looks_alike_is_told(
    env: str, variant: str, seed: int
) -> None:
    off, lost = carried(env, variant, seed)
    assert off.any()
    assert lost[off].max() > 0.5
    assert not off[-1]


def test_new_ground_that_looks_like_old_ground_is_no_alarm_where_doors_move() -> None:
    off, lost = carried("DoorLoop-v0", "static-ml", 368, Slip(0.4, at=(10.0, 20.0)))
    assert not off.any()
    assert lost.max() <= 0.5


def test_a_laser_that_sees_nothing_during_a_doubt_is_no_error() -> None:
    faults = [OdometryScale(1.01), CarriedAway(at=(10.0, 20.0))]
    episode = record_path("DoorCorridor-v0", 133, odometry=CALIBRATED, faults=faults)
    robot = make("static-ml", true_start(episode))
    blinded = 0
    for displacement, scan in zip(episode.displacements(), episode.scans, strict=True):
        if blinded < 20 and 14.5 < scan.time < 19.0:
            scan = replace(scan, ranges=np.full_like(scan.ranges, np.inf))
            blinded += 1
        assert np.isfinite(robot.update(displacement, scan).lost)
    assert blinded == 20


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph", "static-pf"])
def test_a_laser_that_sees_nothing_after_a_gap_is_no_error(variant: str) -> None:
    robot, ahead = make(variant, Pose2()), 0.02
    for k in range(20):
        seen = replace(room(Pose2(ahead * k, 0.0, 0.0)), time=0.1 * k)
        robot.update(Pose2(ahead if k else 0.0, 0.0, 0.0), seen)
    blind = replace(room(), ranges=np.full(180, np.inf), time=9.0)
    estimate = robot.update(Pose2(2.0, 0.0, 0.0), blind)
    assert estimate.pose.x == pytest.approx(2.38, abs=0.05)
    assert math.isfinite(estimate.score)


def test_a_doubt_that_was_dropped_is_told_until_old_ground_agrees() -> None:
    """People walk before a robot that was found again: no place fits until the checks are used
    up."""
    off, lost = carried("DoorCrowd-v0", "static-ml", 103)
    assert not off[300:].any()
    assert lost[345:353].min() == 0.3
    assert 0.019 < lost[355:360].min() <= lost[355:360].max() <= 0.02
    assert 0.019 < lost[355:430].min() <= lost[355:430].max() < 0.03


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph"])
def test_wheels_that_turn_90_degrees_in_a_room_are_corrected(variant: str) -> None:
    """Within 0.2 s they turn by 40 degrees, and new ground is on the way."""
    fault = [OdometryScale(1.01), Slip(0.0, math.radians(90.0), at=(10.0, 20.0))]
    episode = record_path("DoorOffice-v0", 110, odometry=CALIBRATED, faults=fault)
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < LOST_DISTANCE


@pytest.mark.parametrize(
    ("world", "seed", "jump"),
    [("DoorLoop-v0", 341, (0.8, 0.0)), ("DoorCorridor-v0", 340, (0.0, math.pi / 2)),
     ("DoorOffice-v0", 342, (20.0, 2.0))],
)  # fmt: skip
@pytest.mark.parametrize("variant", VARIANTS)
def test_odometry_that_jumps_is_not_believed(
    variant: str, world: str, seed: int, jump: tuple[float, float]
) -> None:
    """From one scan to the next, as after a reset."""
    fault = [OdometryScale(1.01), Slip(*jump, at=(10.0, 20.0), duration=0.1)]
    episode = record_path(world, seed, odometry=CALIBRATED, faults=fault)
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < LOST_DISTANCE
    assert np.abs(wrap_angle(away[:, 2])).max() < LOST_TURN
    assert result.lost.max() < 0.5


@pytest.mark.parametrize(("world", "seed"), [("DoorLoop-v0", 440), ("DoorCorridor-v0", 443)])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_wrong_turn_between_scans_that_are_far_apart_is_noticed(
    variant: str, world: str, seed: int
) -> None:
    """A scan each 1.5 s, or 0.8 m, on new ground: the one before shows how far the robot turned."""
    fault = [OdometryScale(1.01), Slip(0.0, math.radians(90.0), at=(10.0, 20.0))]
    episode = record_path(world, seed, odometry=CALIBRATED, faults=fault)
    thinned = Episode(episode.scans[::15], episode.odometry)
    truth = episode.known_truth("this test").poses[::15]
    away = run(make(variant, Pose2.of(truth[0])), thinned).online - truth
    assert np.hypot(*away[:, :2].T).max() < LOST_DISTANCE


def test_wheels_that_slip_before_a_door_that_moves_are_told() -> None:
    """They slip on after the doubt began, so its first scan does not fit where the robot is now."""
    fault = [OdometryScale(1.01), Slip(0.4, at=(10.0, 20.0))]
    episode = record_path("DoorCorridor-v0", 145, odometry=CALIBRATED, faults=fault)
    result = run(make("static-ml", true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    off = np.hypot(*away[:, :2].T) > LOST_DISTANCE
    assert off.any()
    assert result.lost[off].max() > 0.5
    assert not off[250:].any()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("variant", ["static-ml", "static-pf"])
def test_moving_doors_are_no_loss(variant: str, seed: int) -> None:
    wrong, lost = judged("none", seed, variant)
    assert not wrong.any()
    assert lost.max() < 0.5


@pytest.mark.parametrize(
    "build",
    [partial(make, "static-ml"), lambda start: ParticleFilter(start, particles=1, watch=Watch())],
    ids=["ml", "pf"],
)
def test_nothing_is_drawn_while_it_is_lost(build: Callable[[Pose2], Slam]) -> None:
    episode = drive("carried", SEEDS[0])
    robot = build(true_start(episode))
    drawn, lost = [], []
    for displacement, scan in zip(episode.displacements(), episode.scans, strict=True):
        lost.append(robot.update(displacement, scan).lost > 0.5)
        drawn.append(int(robot.map().observed.sum()))
    (stays,) = np.nonzero(np.array(lost[:-1]) & np.array(lost[1:]))
    assert len(stays) > 3
    assert all(drawn[k] == drawn[k + 1] for k in stays)


def test_after_a_gap_onto_new_ground_particles_follow_the_odometry() -> None:
    """The map shows nearly nothing of the first scan, and any match of it bends the way."""
    faults = [OdometryScale(1.01), Gap(10.0, at=(10.0, 20.0))]
    episode = record_path(
        "DoorLoop-v0", 240, odometry=CALIBRATED, faults=faults, max_episode_steps=500
    )
    result = run(make("static-pf", true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < LOST_DISTANCE


def test_particles_are_watched_by_an_endpoint_alone() -> None:
    with pytest.raises(InputError, match="reads the map by an Endpoint, got a Beam"):
        ParticleFilter(sensor_model=Beam(), watch=Watch())


def test_all_particles_go_on_where_it_is_found() -> None:
    episode = drive("carried", SEEDS[0])
    robot = ParticleFilter(true_start(episode), particles=5, watch=Watch())
    result = run(robot, episode)
    assert (result.lost > 0.5).any()
    assert robot.astray is None
    path = robot.trajectory()
    assert path.shape == result.online.shape
    np.testing.assert_allclose(path[-1], robot.pose)
    off = path - episode.known_truth("this test").poses
    assert np.hypot(*off[-100:, :2].T).max() < 0.1


def test_a_graph_draws_what_was_mapped_apart_where_it_was_found() -> None:
    episode = drive("carried", SEEDS[1])
    truth = episode.known_truth("this test").poses
    result = run(make("dynamic-graph", true_start(episode)), episode)
    online, revised = (
        np.hypot(*(poses - truth)[:, :2].T) > LOST_DISTANCE
        for poses in (result.online, result.poses)
    )
    assert online.sum() > 30
    assert revised.sum() < online.sum() / 2  # what is left: before it was told


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph"])
def test_same_input_same_poses(variant: str) -> None:
    episode = drive("carried", SEEDS[1])
    first, second = (run(make(variant, true_start(episode)), episode).online for _ in range(2))
    assert np.array_equal(first, second)


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph"])
def test_new_ground_that_looks_like_a_place_on_the_map_is_no_proof(variant: str) -> None:
    """Around a corner, people before the laser, into a passage that looks like the first one."""
    episode = record_path("DoorLoop-v0", 1001, world=Loop(laps=1, people=4))
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert (result.lost <= 0.5).all()
    assert np.hypot(*away[:, :2].T).max() < 0.1


@pytest.mark.parametrize(("world", "seed"), [("Loop", 91), ("Loop", 100), ("Office", 102)])
def test_new_ground_after_a_gap_is_drawn_where_the_odometry_leads(world: str, seed: int) -> None:
    """The map explains a third of the scan after the gap, by walls of the passage before."""
    faults = [OdometryScale(1.01), Gap(10.0, (10.0, 20.0))]
    episode = record_path(f"Door{world}-v0", seed, odometry=CALIBRATED, faults=faults)
    result = run(make("static-ml", true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < LOST_DISTANCE + 0.05
    assert result.lost[-1] < 0.01


def test_a_match_that_follows_a_leaf_for_a_moment_speaks_for_no_other_place() -> None:
    """The robot, turned by 7 degrees, then drives along a passage that looks like the last one."""
    episode = record_path("DoorLoop-v0", 7706, difficulty="hard")
    result = run(make("static-ml", true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < 0.2


@pytest.mark.parametrize(
    ("variant", "seed", "scans"),
    [
        ("static-ml", 2107, 400),  # two scans speak for another place, with others between them
        ("dynamic-graph", 2157, 760),  # it comes on little by little: the map shows half of it here
        ("hmm-ml", 3021, 760),  # all scans since then speak for it, but the first one does not
    ],
)
def test_a_door_before_new_ground_that_looks_like_another_place_is_no_proof(
    variant: str, seed: int, scans: int
) -> None:
    """A block looks like itself turned by 90 or 180 degrees."""
    laps, steps = Loop(laps=3), scans
    episode = record_path("DoorLoop-v0", seed, "moving", world=laps, max_episode_steps=steps)
    result = run(make(variant, true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < 0.2


def test_new_ground_seen_piece_by_piece_is_no_place_far_away() -> None:
    """A door moves before a new passage, and the local map explains a quarter of it; another one,
    6 m away, looks the same."""
    episode = record_path("DoorLoop-v0", 7626, "moving", max_episode_steps=450)
    result = run(make("dynamic-graph", true_start(episode)), episode)
    away = result.online - episode.known_truth("this test").poses
    assert (result.lost <= 0.5).all()
    assert np.hypot(*away[:, :2].T).max() < 0.1


def test_a_robot_whose_scans_were_continuous_is_near_unless_it_was_put_somewhere() -> None:
    watch = Watch()
    reach, turn = watch.demands.within or (math.inf, 0.0)
    assert reach == 2.0
    assert turn == math.pi
    watch.suspected = 1
    assert watch.demands.within is None
    watch.suspected = 0
    watch.placed()
    assert watch.demands.within is None


def test_where_a_long_loop_closes_the_robot_is_likely_as_near_as_errors_lead() -> None:
    watch = Watch()
    watch.arriving, watch.suspected, watch._driven = True, 2, 99.0
    assert watch.demands.likely == math.inf
    watch._driven = 200.0
    assert watch.demands.likely == pytest.approx(8.0)
    watch.arriving = False
    assert watch.demands.likely == math.inf


def test_nobody_tells_a_particle_filter_that_it_comes_from_new_ground() -> None:
    watch = Watch()
    ParticleFilter(watch=watch)
    assert watch.arriving is None
    watch.found(sure=True)
    assert watch.arriving is None


def test_a_robot_that_stands_after_a_correction_stays_where_it_was_corrected_to() -> None:
    slam = MaximumLikelihood(watch=Watch())
    slam.update(Pose2(), room())
    assert slam.watch is not None
    there = Pose2(0.25, 0.02, 0.01)
    slam.watch.corrected = lambda match: there
    corrected = slam.update(Pose2(0.2, 0.0, 0.0), room(there)).pose
    assert corrected == pytest.approx(there, abs=1e-3)
    later = replace(room(there), time=0.1)
    assert slam.update(Pose2(), later).pose == pytest.approx(corrected)


def test_who_goes_on_on_new_ground_is_less_sure_if_the_robot_seemed_to_be_carried() -> None:
    estimate = Estimate(Pose2(), np.zeros((3, 3)), 0.0, True)
    for jump, told in ((None, 0.3), (Keyframe(room(), Pose2()), 0.6)):
        watch = Watch()
        watch._jump = jump
        watch.found(sure=False)
        assert watch.told(estimate).lost == told
        assert watch.take_unsettled()
        assert not watch.take_unsettled()
        watch.found(sure=True)
        assert watch.told(estimate).lost < 0.01
        assert not watch.take_unsettled()


class Agreeing:
    """A map that explains and contradicts these shares of a scan, by the x of its pose, m."""

    def __init__(self, shares: dict[float, tuple[float, float]]):
        self._shares = shares

    def shares(self, points: Array, pose: Pose2) -> tuple[float, float]:
        return self._shares[pose.x]

    def log_likelihood(self, scan: Scan, poses: Array) -> Array:
        return np.zeros(len(poses))


@pytest.mark.parametrize(
    ("before", "now", "checks", "probability"),
    [
        ((0.99, 0.0), (0.6, 0.2), 8, 0.3),
        ((0.99, 0.0), (0.6, 0.2), 15, 0.3),
        ((0.99, 0.0), (0.6, 0.2), 16, 0.95),
        ((0.9, 0.0), (0.6, 0.2), 8, 0.001),  # the ground was not known well,
        ((0.99, 0.15), (0.6, 0.2), 8, 0.001),  # or contradicted as much before,
        ((0.99, 0.0), (0.9, 0.1), 8, 0.001),  # or the map agrees
        ((0.99, 0.0), (0.25, 0.14), 16, 0.001),  # or the ground is new
    ],
)
def test_a_doubt_goes_on_where_the_map_disagrees_with_ground_that_it_knew_well(
    before: tuple[float, float], now: tuple[float, float], checks: int, probability: float
) -> None:
    """By the map that is searched, in which the SLAM's frame lies 10 m farther on."""
    scan, watch = room(), Watch()
    watch._jump = watch._before_jump = Keyframe(scan, Pose2(1.0))
    watch._checks = checks - 1
    endpoint: Any = Agreeing({11.0: before, 12.0: now})
    surroundings = Surroundings(endpoint, Pose2(10.0))
    assert watch._settled(0.3, scan, Pose2(2.0), lambda: surroundings) == probability
    assert watch.take_unsettled() == (probability == 0.001)
