import itertools

import numpy as np

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.benchmark.run import run
from slam.geometry import Pose2
from slam.maps.static import Static
from slam.motion.threshold import MotionThreshold
from tests.slam.worlds import beam, drive

ALWAYS = MotionThreshold(0.0, 0.0, 0.0)


def test_motions_add_up_exactly() -> None:
    slam, pose = DeadReckoning(Pose2(1.0, 2.0, 3.0)), Pose2(1.0, 2.0, 3.0)
    for displacement in np.random.default_rng(0).normal(size=(50, 3)):
        pose = pose @ Pose2.of(displacement)
        estimate = slam.update(Pose2.of(displacement), beam(1.0))
        assert estimate.pose == slam.pose == pose
        assert not estimate.matched


def test_an_episodes_odometry_comes_out_as_it_went_in() -> None:
    episode = drive(20)
    poses = run(DeadReckoning(), episode).poses
    np.testing.assert_allclose(poses, episode.odometry.poses, atol=1e-9)


def test_the_map_lies_where_the_odometry_says() -> None:
    slam, grid = DeadReckoning(keyframes=ALWAYS), Static()
    pose = Pose2()
    for displacement in (Pose2(), Pose2(0.3, 0.1, 0.5), Pose2(0.2, 0.0, -1.0)):
        pose = pose @ displacement
        slam.update(displacement, beam(1.0))
        grid.integrate(beam(1.0), pose)
    expected = grid.cells.grid()
    np.testing.assert_array_equal(slam.map().occupied, expected.occupied)
    np.testing.assert_array_equal(slam.map().observed, expected.observed)
    assert slam.map().spec == expected.spec


def test_only_keyframes_are_mapped() -> None:
    slam = DeadReckoning(keyframes=MotionThreshold(distance=0.5, turn=9.0, time=99.0))
    seen = []
    for _ in range(7):
        slam.update(Pose2(0.2), beam(1.0))
        seen.append(int(slam.map().observed.sum()))
    # mapped at 0.2 m (the first scan), then every third time, 0.6 m of 12 cells farther on
    assert [b - a for a, b in itertools.pairwise(seen)] == [0, 0, 12, 0, 0, 12]


def test_the_map_that_is_given_out_is_a_copy() -> None:
    slam = DeadReckoning(keyframes=ALWAYS)
    slam.update(Pose2(), beam(1.0))
    given = slam.map()
    before = given.occupied.copy(), given.observed.copy()
    slam.update(Pose2(0.0, 0.3), beam(1.0))
    np.testing.assert_array_equal(given.occupied, before[0])
    np.testing.assert_array_equal(given.observed, before[1])
    assert not np.array_equal(slam.map().observed, before[1])
