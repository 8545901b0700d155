"""A building whose corridors look alike: a robot is carried across it, or draws it twice."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from agents import record_path
from dynslam_env import CarriedAway, Loop, Odometry, OdometryScale
from slam import make
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.geometry import Pose2
from slam.interface import LOST_DISTANCE
from slam.maps.static import Static
from slam.metrics.lost import LostScores, score_lost
from slam.motion.gaussian import Prediction
from slam.recovery.misfit import HELD, WINDOW, Misfit
from slam.recovery.watch import Watch
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton, climbed
from slam.sensor_models.endpoint import Endpoint

CALIBRATED = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)
BLOCK = Loop(length=70.0, breadth=40.0, outer_doors=8, inner_doors=5, laps=2)
SECOND_LAP = 385.0  # s, when it begins


@cache
def drive(seed: int) -> Episode:
    """Round a block; in the second lap the robot is carried 45 m and more."""
    return record_path(
        "DoorLoop-v0", seed, "moving", world=BLOCK, max_episode_steps=6500, odometry=CALIBRATED,
        faults=[OdometryScale(1.01), CarriedAway(distance=45.0, at=(420.0, 560.0))],
    )  # fmt: skip


@cache
def scores(seed: int, variant: str = "static-ml") -> LostScores:
    episode = drive(seed)
    result = run(make(variant, true_start(episode)), episode)
    times = np.array([scan.time for scan in episode.scans])
    return score_lost(times, result.online, episode.known_truth("a test").poses, result.lost)


@pytest.mark.parametrize("seed", [5600, 5601, 5602])
def test_a_robot_that_is_carried_across_a_building_that_looks_alike_is_found(seed: int) -> None:
    found = scores(seed)
    carried = found.losses[-1]
    assert carried.begin > SECOND_LAP + 30.0
    assert carried.end is not None
    assert carried.end - carried.begin < 60.0
    assert found.sure_and_wrong < 0.05
    assert found.false_alarms == 0


def test_a_graph_is_told_by_what_it_drew_long_before_that_it_was_carried() -> None:
    carried = scores(5602, "dynamic-graph").losses[-1]
    assert carried.begin > SECOND_LAP + 30.0
    assert carried.end is not None  # it was sure and wrong to the end
    assert carried.end - carried.begin < 60.0


def test_a_robot_that_is_lost_on_new_ground_goes_on_there() -> None:
    episode = record_path("DoorLoop-v0", 5712, "moving", world=BLOCK, max_episode_steps=1700)
    result = run(make("dynamic-graph", true_start(episode)), episode)
    truth = episode.known_truth("a test").poses
    assert result.lost.max() > 0.5  # at a corner, where a match was wrong by some degrees
    assert 0.05 < result.lost[-1] < 0.5  # it was found at no place of the map
    assert np.hypot(*(result.online[-1] - truth[-1])[:2]) < 2.0  # 36 m off a minute later


def test_a_map_that_is_drawn_beside_itself_where_a_loop_closes_is_corrected_at_once() -> None:
    drifted = scores(5602).losses[0]  # by more than LOST_DISTANCE; it lasted for 83 s
    assert drifted.begin == pytest.approx(SECOND_LAP, abs=10.0)
    assert drifted.end is not None
    assert drifted.end - drifted.begin < 5.0
    assert LOST_DISTANCE == 0.3


def room(pose: Pose2 = Pose2()) -> Scan:
    """A scan in the middle of a room of 4 x 3 m, from a pose in it."""
    angles = np.radians(np.arange(-180.0, 180.0, 2.0))
    c, s = np.cos(angles + pose.theta), np.sin(angles + pose.theta)
    with np.errstate(divide="ignore"):
        x = np.where(c > 0, 2.0 - pose.x, 2.0 + pose.x) / np.abs(c)
        y = np.where(s > 0, 1.5 - pose.y, 1.5 + pose.y) / np.abs(s)
    return Scan(np.minimum(x, y), angles, max_range=8.0)


def reading() -> Endpoint:
    """The room, drawn several times."""
    known, endpoint = Static(), Endpoint()
    for _ in range(5):
        endpoint.refresh(known, known.integrate(room(), Pose2()))
    return endpoint


def test_a_robot_that_stands_after_a_correction_stays_where_it_was_corrected_to() -> None:
    slam = MaximumLikelihood(watch=Watch())
    slam.update(Pose2(), room())
    assert slam.watch is not None
    there = Pose2(0.25, 0.02, 0.01)
    slam.watch.corrected = lambda match: there
    assert slam.update(Pose2(0.2, 0.0, 0.0), room(Pose2(0.2, 0.0, 0.0))).pose == there
    later = replace(room(Pose2(0.2, 0.0, 0.0)), time=0.1)
    assert slam.update(Pose2(), later).pose == pytest.approx(there)


def test_climbs_in_one_call_are_climbs() -> None:
    endpoint, points = reading(), room().points
    starts = np.array([[0.1, -0.05, 0.05], [-0.08, 0.02, -0.1], [0.0, 0.0, 0.0]])
    wide, limits = np.array([0.3, 0.3, 0.1]), GaussNewton().limits
    tops, values = climbed(starts, points, endpoint.reading(1), endpoint.reading(0), wide, limits)
    assert tops == pytest.approx(np.zeros((3, 3)), abs=0.02)
    priors = [
        Prediction(Pose2.of(start), Pose2(), wide).log_density(top[None])[0]
        for start, top in zip(starts, tops, strict=True)
    ]
    assert values == pytest.approx(endpoint.log_likelihood(room(), tops) + priors, abs=1e-3)


def test_what_a_map_does_not_know_is_not_wrong() -> None:
    endpoint = reading()
    inside, walls, beyond = [[0.5, 0.5]], [[2.0, 0.0], [0.0, 1.5]], [[6.0, 0.0], [0.0, -5.0]]
    points = np.array(inside + walls + beyond)
    assert endpoint.known_shares(points, Pose2()) == pytest.approx((0.4, 0.2))
    assert endpoint.known_shares(points[:0], Pose2()) == (0.0, 0.0)


def test_what_stays_unusual_becomes_usual() -> None:
    misfit = Misfit()
    for explained in [0.98] * 200 + [0.5] * WINDOW:
        misfit.take((explained, 1.0 - explained))
    assert misfit.due
    for _ in range(HELD + 400):
        misfit.take((0.5, 0.5))
    assert not misfit.due
