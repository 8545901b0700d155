"""Surprising values lead to searches; a recording in which they mean nothing leads to few."""

import numpy as np

from slam.recovery.surprise import MEMORY, Surprise


def test_a_value_above_the_threshold_and_above_usual_ones_surprises():
    surprise = Surprise(10.0)
    assert [surprise.surprising(value) for value in (5.0, 10.0, 11.0)] == [False, False, True]
    assert not surprise.surprising(11.0, usual=12.0)


def test_one_dismissed_value_does_not_hide_the_next():
    surprise = Surprise(10.0)
    assert surprise.surprising(40.0)
    surprise.dismiss()
    assert surprise.surprising(40.0)


def test_values_that_mean_nothing_again_and_again_no_longer_surprise_but_larger_ones_do():
    surprise, searched = Surprise(10.0), 0
    for value in 30.0 + 10.0 * np.random.default_rng(0).random(1000):
        if surprise.surprising(value):
            searched += 1
            surprise.dismiss()
    assert searched < 500
    assert surprise.surprising(60.0)


def test_dismissed_values_are_forgotten():
    surprise = Surprise(10.0)
    for _ in range(30):
        surprise.surprising(40.0)
        surprise.dismiss()
    assert not surprise.surprising(35.0)
    for _ in range(3 * MEMORY):
        surprise.surprising(0.0)
    assert surprise.surprising(15.0)
