import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from slam.maps.windowed import bin_limits, bin_of
from tests.slam.naive import sigmoid


@given(st.integers(1, 20), st.floats(-30.0, 30.0))
def test_the_bin_is_that_of_the_probability(bins: int, log_odds: float) -> None:
    place = bins * sigmoid(log_odds)
    assume(abs(place - round(place)) > 1e-9 or not 0 < round(place) < bins)
    assert bin_of(log_odds, bin_limits(bins)) == min(int(place), bins - 1)


@pytest.mark.parametrize("bins", [1, 2, 3, 4, 10])
def test_bins_are_equally_wide_and_begin_at_their_limits(bins: int) -> None:
    limits = bin_limits(bins)
    assert [sigmoid(limit) for limit in limits] == pytest.approx(np.arange(1, bins) / bins)
    assert [bin_of(limit, limits) for limit in limits] == list(range(1, bins))
    below = [bin_of(math.nextafter(limit, -math.inf), limits) for limit in limits]
    assert below == list(range(bins - 1))


def test_what_is_sure_is_in_the_outermost_bins() -> None:
    limits = bin_limits(5)
    assert bin_of(-math.inf, limits) == 0
    assert bin_of(math.inf, limits) == 4
