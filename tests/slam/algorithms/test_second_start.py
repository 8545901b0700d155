"""The first metres are mapped again, once the odometry's distances are known to be wrong."""

import copy
import pickle
import threading
from functools import cache

import numpy as np
import pytest

from agents import record_path
from dynslam_env import CarriedAway, Odometry, OdometryScale
from slam import make
from slam.algorithms.graph_slam import GraphSlam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.second_start import SecondStart
from slam.algorithms.variants import maximum_likelihood
from slam.benchmark.run import Playback, run, true_start
from slam.episode import Episode
from slam.geometry import Pose2
from slam.interface import Posterior
from slam.maps.static import Static
from slam.search.correlative import Correlative

WHEELS = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)
VARIANTS = ["static-ml", "dynamic-graph"]


@cache
def drive(factor: float, steps: int = 150) -> Episode:
    """Along a corridor, whose walls tell little of the distance driven."""
    faults = [OdometryScale(factor)]
    return record_path(
        "DoorCorridor-v0", 121, odometry=WHEELS, faults=faults, max_episode_steps=steps
    )


def started(variant: str, episode: Episode) -> MaximumLikelihood | GraphSlam:
    robot = make(variant, true_start(episode))
    assert isinstance(robot, MaximumLikelihood | GraphSlam)
    return robot


def errors(poses: np.ndarray, episode: Episode) -> np.ndarray:
    """(n,) m, of the positions."""
    away = poses - episode.known_truth("this test").poses
    return np.hypot(*away[:, :2].T)


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_first_metres_have_their_true_length(variant: str) -> None:
    episode = drive(1.2)
    result = run(started(variant, episode), episode)
    first = result.revisions[0]
    again = len(first)
    assert 20 < again < 120
    assert errors(result.online, episode)[: again - 1].max() > 0.3
    assert errors(result.online, episode)[again - 1 :].max() < 0.15
    assert errors(result.poses, episode).max() < 0.15
    assert result.poses[: again - 1] == pytest.approx(first[:-1], abs=0.05)


def test_without_a_second_start_they_stay_too_long() -> None:
    episode = drive(1.2)
    result = run(started("static-ml/no-recovery", episode), episode)
    assert errors(result.online, episode)[-1] > 0.3
    assert not result.revisions
    assert result.poses is result.online


@pytest.mark.parametrize("variant", VARIANTS)
def test_an_odometry_that_is_right_is_not_mapped_twice(variant: str) -> None:
    episode = drive(1.02)
    robot = started(variant, episode)
    run(robot, episode)
    assert len(robot.first_poses) == 0


@pytest.mark.parametrize("variant", VARIANTS)
def test_it_is_told_once_that_poses_were_revised(variant: str) -> None:
    episode = drive(1.2)
    robot = started(variant, episode)
    told = [k for k, e in enumerate(Playback(robot, episode), 1) if e.revised]
    again = len(robot.first_poses)
    assert told[0] == again > 0
    assert variant == "dynamic-graph" or told == [again]  # a graph closes loops, too


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_copy_made_before_goes_on_as_the_original(variant: str) -> None:
    episode = drive(1.2)
    robot = started(variant, episode)
    motions = list(zip(episode.displacements(), episode.scans, strict=True))
    for motion, scan in motions[:20]:
        robot.update(motion, scan)
    twin = copy.deepcopy(robot)
    poses = [[slam.update(*given).pose for given in motions[20:]] for slam in (robot, twin)]
    assert poses[0] == poses[1]
    assert len(robot.first_poses) == len(twin.first_poses) > 0


def test_the_poses_are_kept_when_a_robot_that_was_carried_is_found() -> None:
    faults = [OdometryScale(1.2), CarriedAway(at=20.0)]
    episode = record_path("DoorCorridor-v0", 121, odometry=WHEELS, faults=faults)
    result = run(make("static-ml", true_start(episode)), episode)
    assert (result.lost > 0.5).any()
    assert result.lost[-1] < 0.5
    (first,) = result.revisions
    assert 20 < len(first) < 120


def test_a_robot_that_is_placed_by_hand_stays_there() -> None:
    episode = drive(1.2)
    robot = started("static-ml", episode)
    assert isinstance(robot, MaximumLikelihood)
    for k, _ in enumerate(Playback(robot, episode)):
        if k == 5:
            robot.place(Pose2(5.0, 5.0, 0.0))
    assert len(robot.first_poses) == 0
    assert robot.pose.y > 4.0


class Locked(Static):
    """A map that cannot be copied."""

    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.Lock()


def test_a_map_that_cannot_be_copied_is_made_twice() -> None:
    episode = drive(1.2)
    robot = maximum_likelihood(Locked)(true_start(episode), np.random.default_rng(0))
    assert isinstance(robot, MaximumLikelihood)
    first = robot.map_model
    result = run(robot, episode)
    assert len(result.revisions[0]) > 20
    assert isinstance(robot.map_model, Locked)
    assert robot.map_model is not first


class Listened(Correlative):
    """A search that draws a number, as searches by random restarts do."""

    def __init__(self) -> None:
        super().__init__()
        self.drawn: list[float] = []

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        self.drawn.append(rng.random())
        return super().__call__(posterior, rng)


def test_the_second_time_the_same_numbers_are_drawn() -> None:
    episode = drive(1.2)
    robot = maximum_likelihood(Static, search=Listened)(
        true_start(episode), np.random.default_rng(5)
    )
    assert isinstance(robot, MaximumLikelihood)
    first, second = robot.search, None
    for _ in Playback(robot, episode):
        second = robot.search
    assert isinstance(first, Listened)
    assert isinstance(second, Listened)
    again = len(robot.first_poses)
    assert again > 20
    assert first is not second
    assert first.drawn[:20] == second.drawn[:20]
    assert first.drawn[0] == np.random.default_rng(5).random()


def test_nothing_is_left_of_the_first_time() -> None:
    """The map in which a lost robot is searched for is that of the second time."""
    episode = drive(1.2)
    robot = started("static-ml", episode)
    assert isinstance(robot, MaximumLikelihood)
    for _ in Playback(robot, episode):
        pass
    assert len(robot.first_poses) > 0
    endpoint = robot._surroundings().endpoint
    assert endpoint is robot.sensor_model
    assert endpoint.tiles is robot.map_model.cells.tiles
    assert pickle.loads(pickle.dumps(robot)).pose == robot.pose


def test_a_graph_begins_again_where_it_was_placed() -> None:
    episode = drive(1.2)
    ways = []
    for start, placed in ((true_start(episode), None), (Pose2(), true_start(episode))):
        robot = make("dynamic-graph", start)
        assert isinstance(robot, GraphSlam)
        if placed is not None:
            robot.place(placed)
        ways.append([estimate.pose for estimate in Playback(robot, episode)])
        assert len(robot.first_poses) > 0
    assert ways[0] == ways[1]


def test_a_map_made_by_a_function_without_a_name_can_be_pickled() -> None:
    episode = drive(1.2)
    robot = maximum_likelihood(lambda: Static(0.06))(true_start(episode), np.random.default_rng(0))
    assert isinstance(robot, MaximumLikelihood)
    motions = list(zip(episode.displacements(), episode.scans, strict=True))
    for given in motions[:10]:
        robot.update(*given)
    twin = pickle.loads(pickle.dumps(robot))
    poses = [[slam.update(*given).pose for given in motions[10:]] for slam in (robot, twin)]
    assert poses[0] == poses[1]
    assert len(robot.first_poses) == len(twin.first_poses) > 0


def test_a_robot_that_stood_too_long_is_not_mapped_twice() -> None:
    episode = drive(1.2)
    robot = started("static-ml", episode)
    robot.again = SecondStart(lambda: started("static-ml", episode), max_scans=20)
    for _ in Playback(robot, episode):
        pass
    assert len(robot.first_poses) == 0


@pytest.mark.parametrize("variant", VARIANTS)
def test_nothing_is_mapped_twice_in_a_map_that_was_there_before(variant: str) -> None:
    episode = drive(1.2)
    robot = started(variant, episode)
    robot.remember([(episode.scans[0], true_start(episode))])
    for _ in Playback(robot, episode):
        pass
    assert len(robot.first_poses) == 0
