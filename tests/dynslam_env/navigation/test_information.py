import math

import numpy as np
import pytest

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.information import (
    MIN_RAY_PROBABILITY,
    RAYS,
    UNSEEN_OCCUPANCY,
    entropy,
    expected_bits,
)
from slam.grid import GridSpec
from tests.dynslam_env.navigation.drawn import believed


def random_beliefs(seed):
    rng = np.random.default_rng(seed)
    spec = GridSpec(0.15, -7, 3, 40, 50)
    observed = rng.random(spec.shape) < 0.8
    occupied = np.where(rng.random(spec.shape) < 0.1, 0.9, 0.05).astype(np.float32)
    age, flips = np.zeros(spec.shape, np.float32), np.zeros(spec.shape, np.float32)
    return Beliefs(spec, occupied, observed, age, flips)


def naive(beliefs, point, field_of_view, max_range):
    """Rays one after the other, cells in a set; the best of all windows of rays."""
    bits, spec, seen = entropy(beliefs), beliefs.spec, set()
    gains = []
    for k in range(RAYS):
        angle = math.tau * k / RAYS
        reach, gain = 1.0, 0.0
        for s in range(1, int(max_range / spec.resolution) + 1):
            there = np.array(point) + s * spec.resolution * np.array(
                [math.cos(angle), math.sin(angle)]
            )
            cell = tuple(spec.cells(there[None])[0])
            inside = 0 <= cell[0] < spec.rows and 0 <= cell[1] < spec.cols
            known = inside and beliefs.observed[cell]
            if inside and cell not in seen:
                gain += reach * bits[cell]
                seen.add(cell)
            elif not inside:
                gain += reach
            reach *= 1.0 - (beliefs.occupied[cell] if known else UNSEEN_OCCUPANCY)
            if inside and reach < MIN_RAY_PROBABILITY:
                break
        gains.append(gain)
    width = round(RAYS * field_of_view / math.tau)
    return max(sum(gains[(k + i) % RAYS] for i in range(width)) for k in range(RAYS))


@pytest.mark.parametrize("seed", range(3))
def test_bits_are_those_of_a_slow_loop(seed):
    beliefs = random_beliefs(seed)
    points = beliefs.spec.centres(np.array([(5, 5), (20, 25), (33, 12)])) + 0.011
    bits, _ = expected_bits(beliefs, points, math.pi, 3.0)
    wanted = [naive(beliefs, point, math.pi, 3.0) for point in points]
    np.testing.assert_allclose(bits, wanted, rtol=1e-5)


def test_the_best_heading_looks_where_nothing_is_known():
    known = believed(("." * 61 + "\n") * 61)
    known.observed[:, 45:] = False
    bits, headings = expected_bits(known, np.array([(4.0, 4.6)]), math.pi / 2, 4.0)
    assert abs(headings[0]) < math.radians(25)
    assert bits[0] > 0


def test_what_is_known_for_sure_tells_nothing():
    room = "#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n"
    bits, _ = expected_bits(believed(room), np.array([(2.0, 1.5)]))
    assert bits[0] == 0.0


def test_a_door_whose_state_is_not_known_is_worth_a_look():
    room = "#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 12 + "~" * 6 + "#" * 12 + "\n"
    bits, headings = expected_bits(believed(room), np.array([(2.2, 1.5)]))
    assert bits[0] >= 6.0
    assert -math.pi <= headings[0] <= 0.0  # down, where it is
