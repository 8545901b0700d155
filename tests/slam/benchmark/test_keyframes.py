"""One rule for the scans between the keyframes of another system."""

import numpy as np
import pytest

from slam.benchmark.keyframes import anchored, filled
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import compose
from slam.scan import Scan
from slam.trajectory import Trajectory


def drive(poses) -> Episode:
    """Scans at 0, 0.1, 0.2 s ... with the odometry `poses`."""
    times = np.arange(len(poses), dtype=np.float64) / 10
    scans = tuple(Scan(np.ones(3), np.arange(3.0), 5.0, time=t) for t in times)
    return Episode(scans, Trajectory(times, np.array(poses, float)))


CIRCLE = [[np.cos(a), np.sin(a), a + np.pi / 2] for a in np.linspace(0, 9, 91)]


def test_keyframes_that_are_the_odometry_in_another_frame_give_the_odometry_there():
    episode, frame = drive(CIRCLE), np.array([3.0, -2.0, 2.5])
    poses = compose(frame, np.array(CIRCLE))
    found = filled(episode, Trajectory(episode.times[5:80:15], poses[5:80:15]))
    assert found.poses == pytest.approx(compose(frame, np.array(CIRCLE)), abs=1e-9)
    assert found.keyframes.tolist() == [5, 20, 35, 50, 65]
    again = anchored(found.poses, np.array(CIRCLE[0]))
    assert again[:, :2] == pytest.approx(np.array(CIRCLE)[:, :2], abs=1e-9)


def test_an_error_of_the_odometry_is_spread_over_the_time_between_two_keyframes():
    straight = [[0.1 * k, 0.0, 0.0] for k in range(11)]
    given = Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]]))
    found = filled(drive(straight), given).poses
    assert found[:, 0] == pytest.approx(0.2 * np.arange(11))
    assert found[:, 1] == pytest.approx(0.1 * np.arange(11))


def test_headings_are_averaged_the_shorter_way():
    still = [[0.0, 0.0, 0.0]] * 3
    given = Trajectory(np.array([0.0, 0.2]), np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.1]]))
    assert abs(filled(drive(still), given).poses[1, 2]) == pytest.approx(np.pi)


def test_before_the_first_and_after_the_last_keyframe_the_odometry_is_counted_from_it():
    straight = [[0.1 * k, 0.0, 0.0] for k in range(11)]
    found = filled(drive(straight), Trajectory(np.array([0.5]), np.array([[9.0, 0.0, np.pi]])))
    assert found.poses[:, 0] == pytest.approx(9.5 - 0.1 * np.arange(11))
    assert found.keyframes.tolist() == [5]


def test_stamps_that_are_rounded_fit_and_of_two_the_nearer_one_counts():
    straight = [[0.1 * k, 0.0, 0.0] for k in range(11)]
    given = Trajectory(np.array([0.496, 0.501]), np.array([[7.0, 0, 0], [8.0, 0, 0]]))
    assert filled(drive(straight), given).poses[5, 0] == 8.0


def test_stamps_of_another_clock_are_an_error_that_tells_both():
    given = Trajectory(np.array([0.0, 50.0, 51.0]), np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"1 of 3 poses .* 0.000 to 51.000 s, the scans .* 1.000"):
        filled(drive([[0.0, 0.0, 0.0]] * 11), given)
