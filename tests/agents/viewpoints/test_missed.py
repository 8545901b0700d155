"""Missed: what a look did not show is not promised again for a while."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.chooser import _same
from agents.viewpoints.missed import DURATION, Missed
from agents.viewpoints.table import ViewpointTable
from dynslam_env.navigation.door_belief import HORIZONS, DoorBelief

POINTS = np.array([[0.0, 0.0], [0.5, 0.0], [5.0, 0.0]])
DOORS = np.array([[1.0, 2.0, 0.0, 0.9], [3.0, 2.0, 0.0, 0.9]])


def after_a_look(ages: tuple[float, float]) -> Missed:
    """A look around at the first viewpoint from 90 s to 100 s; the doors' ages after it."""
    known = np.zeros(len(HORIZONS))
    beliefs = [
        DoorBelief(place, 0.5, age, True, known, known)
        for place, age in zip(DOORS, ages, strict=True)
    ]
    missed = Missed()
    missed.compare(POINTS[0], DOORS, beliefs, 100.0, 90.0)
    return missed


def table() -> ViewpointTable:
    around = np.ones((3, 2), np.bool_)
    return ViewpointTable(POINTS, DOORS, around, np.ones((3, 3)), np.ones((3, 3, 2), np.bool_))


def test_a_door_that_was_not_seen_is_missed_from_there_and_nearby() -> None:
    found = after_a_look((4.0, 50.0)).among(table(), 101.0)
    assert found.tolist() == [[False, True], [False, True], [False, False]]


def test_a_look_that_shows_all_misses_nothing() -> None:
    assert not after_a_look((4.0, 0.0)).among(table(), 101.0).any()


def test_it_is_promised_again_later() -> None:
    missed = after_a_look((4.0, np.inf))
    assert missed.among(table(), 99.0 + DURATION).any()
    assert not missed.among(table(), 101.0 + DURATION).any()


def test_a_doorway_that_became_known_meanwhile_changes_no_pairs() -> None:
    """The table promised the second doorway alone; it was seen. A new one is listed first."""
    known = np.zeros(len(HORIZONS))
    places, ages = [np.array([9.0, 9.0, 0.0, 0.9]), *DOORS], (np.inf, 50.0, 0.0)
    beliefs = [
        DoorBelief(place, 0.5, age, True, known, known)
        for place, age in zip(places, ages, strict=True)
    ]
    missed = Missed()
    missed.compare(POINTS[0], DOORS[1:], beliefs, 100.0, 90.0)
    assert not missed.among(table(), 101.0).any()


def test_a_table_is_for_the_same_doorways_in_the_same_order() -> None:
    assert _same(DOORS, DOORS + [0.1, 0.0, 0.0, 0.0])
    assert not _same(DOORS, DOORS[::-1])
    assert not _same(DOORS, DOORS[:1])
