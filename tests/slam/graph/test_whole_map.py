import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.graph.local_map import LocalMap
from slam.graph.whole_map import WholeMap
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from tests.slam.worlds import loop, scan_at

POSES = [Pose2.of(pose) for pose in loop(30)]


def anew(make, places, poses):
    """The map built anew."""
    grid = make()
    for place, frame in zip(places, poses, strict=True):
        for scan, pose in place.keyframes:
            grid.integrate(scan, Pose2.of(frame) @ pose)
    return grid.cells.grid()


def assert_same(one, other) -> None:
    assert one.spec == other.spec
    np.testing.assert_array_equal(one.occupied, other.occupied)
    np.testing.assert_array_equal(one.observed, other.observed)


class Course:
    """Growing local maps along the room, and their estimated poses."""

    def __init__(self):
        self.places, self.poses, self.k = [], np.zeros((0, 3)), 0

    def scan(self):
        self.k += 1
        return scan_at(POSES[self.k % 30], time=0.7 * self.k)

    def grow(self) -> None:
        self.places[-1].add(self.scan(), Pose2(0.05 * len(self.places[-1].keyframes)))

    def begin(self) -> None:
        self.places.append(LocalMap((), self.scan()))
        self.poses = np.vstack([self.poses, POSES[self.k % 30]])

    def move(self, by: float) -> None:
        self.poses = self.poses + np.array([by, 0.0, 0.0])


@pytest.mark.parametrize("make", [Static, Histogram])
@settings(max_examples=20)
@given(st.lists(st.sampled_from(["grow", "begin", "move", "draw"]), max_size=14))
@example(["draw", "grow"])
@example(["draw", "grow", "begin", "draw", "grow"])
def test_it_is_the_map_made_anew(make, program) -> None:
    course, whole = Course(), WholeMap(make)
    course.begin()
    for step in program:
        if step == "move":
            course.move(0.25)
        elif step == "draw":
            whole.map(course.places, course.poses)
        else:
            getattr(course, step)()
    found = whole.map(course.places, course.poses)
    assert_same(found, anew(make, course.places, course.poses))


def test_what_hardly_moved_stays_where_it_was_drawn_until_it_adds_up() -> None:
    course, whole = Course(), WholeMap(Static)
    course.begin()
    first = whole.map(course.places, course.poses)
    start = course.poses
    for _ in range(3):
        course.move(0.003)
        assert_same(whole.map(course.places, course.poses), first)
    course.move(0.003)
    assert_same(whole.map(course.places, course.poses), anew(Static, course.places, course.poses))
    assert np.abs(course.poses - start).max() > 0.01


def test_a_turn_moves_it_too() -> None:
    course, whole = Course(), WholeMap(Static)
    course.begin()
    whole.map(course.places, course.poses)
    course.poses = course.poses + np.array([0.0, 0.0, 0.05])
    assert_same(whole.map(course.places, course.poses), anew(Static, course.places, course.poses))


def test_the_map_is_a_copy_and_of_nothing_there_is_none() -> None:
    course, whole = Course(), WholeMap(Static)
    assert whole.map([], np.zeros((1, 3))).observed.sum() == 0
    course.begin()
    first = whole.map(course.places, course.poses)
    kept = first.occupied.copy()
    course.grow()
    whole.map(course.places, course.poses)
    np.testing.assert_array_equal(first.occupied, kept)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_what_was_forgotten_stays_until_the_map_is_made_anew(number: int) -> None:
    course, whole = Course(), WholeMap(Static)
    for _ in range(3):
        course.begin()
        course.grow()
    before = whole.map(course.places, course.poses)
    for _ in range(2):  # the second time after more was drawn
        assert_same(whole.map(course.places, course.poses), before)
        whole.forget(number)
        del course.places[number]
        course.poses = np.delete(course.poses, number, axis=0)
        assert_same(whole.map(course.places, course.poses), before)
        number = len(course.places) - 1
        course.begin()
        before = whole.map(course.places, course.poses)
    course.move(0.3)
    assert_same(whole.map(course.places, course.poses), anew(Static, course.places, course.poses))


def test_what_is_forgotten_before_it_was_drawn_is_not_drawn() -> None:
    course, whole = Course(), WholeMap(Static)
    course.begin()
    whole.map(course.places, course.poses)
    course.begin()
    course.begin()
    whole.forget(1)
    del course.places[1]
    course.poses = np.delete(course.poses, 1, axis=0)
    assert_same(whole.map(course.places, course.poses), anew(Static, course.places, course.poses))
