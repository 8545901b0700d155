"""SlowDoors: habits, doors that follow, and the times of flips."""

from __future__ import annotations

import numpy as np
import pytest

from dynslam_env.patrol.slow_doors import SlowDoors
from slam.errors import InputError


def flips(law: SlowDoors, doors: int, until: float, seed: int = 0) -> list[list[float]]:
    """The times of each door's flips."""
    clock, found = law.clock(doors, np.random.default_rng(seed)), [[] for _ in range(doors)]
    while (time := clock.next_flip) < until:
        for door in clock.flips_until(time):
            found[door].append(time)
    return found


def test_stays_are_within_the_limits() -> None:
    for times in flips(SlowDoors(coupled=0.0), 8, 5000.0):
        stays = np.diff(times)
        assert len(stays) > 5
        assert stays.min() > 60.0 - 1e-6
        assert stays.max() < 400.0 + 1e-6


def test_a_door_has_two_habits() -> None:
    times = flips(SlowDoors(coupled=0.0, spread=0.0), 1, 5000.0, seed=3)[0]
    stays = np.diff(times)
    assert np.allclose(stays[::2], stays[0])
    assert np.allclose(stays[1::2], stays[1])
    assert abs(stays[0] - stays[1]) > 1.0


def test_doors_that_follow_flip_soon_after_their_leader() -> None:
    leader, *others = flips(SlowDoors(coupled=1.0), 4, 3000.0)
    for times in others:
        lags = np.subtract(times, leader[: len(times)])
        assert len(times) >= len(leader) - 1
        assert lags.min() >= 0.0
        assert lags.max() <= 20.0


def test_the_same_generator_gives_the_same_flips() -> None:
    assert flips(SlowDoors(), 5, 2000.0, seed=7) == flips(SlowDoors(), 5, 2000.0, seed=7)


def test_the_shortest_stay_is_no_longer_than_the_longest() -> None:
    with pytest.raises(InputError, match="shortest <= longest"):
        SlowDoors(shortest=100.0, longest=90.0)
