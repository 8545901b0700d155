import numpy as np
import pytest

from dynslam_env.navigation.doors_found import doors_found
from tests.dynslam_env.navigation.drawn import believed

CORRIDOR = """
..............
..............
####~~~~~~####
..............
..............
"""


def test_what_changes_between_two_free_sides_is_a_door():
    (door,) = doors_found(believed(CORRIDOR))
    assert door.centre == pytest.approx([7 * 0.15, 2.5 * 0.15])
    assert door.flips == pytest.approx(0.1)
    assert door.age == 1.0
    assert door.cells == 6


def test_what_changes_all_along_is_no_door():
    assert doors_found(believed("~" * 30 + "\n" + "." * 30 + "\n")) == []


def test_a_lone_cell_is_none():
    assert doors_found(believed(".....\n..~..\n.....\n")) == []


def test_it_was_seen_when_a_part_of_it_was():
    beliefs = believed(CORRIDOR)
    beliefs.age[2, 4:7] = 0.0
    beliefs.age[2, 7:] = 50.0
    assert doors_found(beliefs)[0].age < 50.0
    assert np.isfinite(beliefs.age).all()
