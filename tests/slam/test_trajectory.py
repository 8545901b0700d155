import math
import tracemalloc

import numpy as np
import pytest

from slam.errors import InputError
from slam.trajectory import Trajectory


def test_poses_between_are_interpolated_and_held_at_the_ends() -> None:
    path = Trajectory(np.array([1.0, 3.0]), np.array([[0.0, 0.0, 0.0], [2.0, 4.0, 1.0]]))
    found = path.at(np.array([0.0, 1.0, 2.5, 3.0, 9.0]))
    expected = [[0, 0, 0], [0, 0, 0], [1.5, 3, 0.75], [2, 4, 1], [2, 4, 1]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_headings_turn_the_short_way() -> None:
    headings = np.radians([170.0, -170.0, 160.0])
    path = Trajectory(np.arange(3.0), np.column_stack([np.zeros((3, 2)), headings]))
    found = np.degrees(path.at(np.array([0.25, 0.75, 1.5]))[:, 2])
    np.testing.assert_allclose(found, [175, -175, 175], atol=1e-9)


def test_a_moment_of_a_long_trajectory_copies_nothing_of_it() -> None:
    path = Trajectory(np.arange(100_000.0), np.zeros((100_000, 3)))
    path.at(np.array([0.5]))  # what is made once
    tracemalloc.start()
    path.at(np.array([1.5]))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 0.1 * path.times.nbytes


@pytest.mark.parametrize(
    ("times", "poses", "said"),
    [
        ([0.0, 1.0], np.zeros((3, 3)), "times"),
        ([0.0, 1.0], np.zeros((2, 2)), "poses"),
        ([[0.0]], np.zeros((1, 3)), "times"),
        ([0.0, math.nan], np.zeros((2, 3)), "finite"),
        ([0.0], np.full((1, 3), math.inf), "finite"),
        ([0.0, 2.0, 2.0], np.zeros((3, 3)), "row 2"),
        ([0.0, 2.0, 1.0, 3.0], np.zeros((4, 3)), "row 2"),
    ],
)
def test_refused_with_what_was_wrong(times, poses, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Trajectory(np.array(times), poses)
