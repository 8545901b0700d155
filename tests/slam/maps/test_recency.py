"""Recency maps against sums over all observations by age, and the times until a cell changes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.recency import Recency
from slam.maps.static import Static
from tests.slam import naive
from tests.slam.maps.driving import (
    CLOSED,
    DOOR,
    EVIDENCE,
    HIDDEN,
    OPEN,
    RAYS,
    VALUES,
    again,
    beams_seen,
    drive,
    h,
    integrated,
    readings,
    scans_until,
    seen,
    watched,
)

gaps = st.sampled_from([0.0, 0.2, 1.0, 7.0, 300.0])
sequences = st.lists(
    st.tuples(gaps, st.sampled_from([CLOSED, OPEN, HIDDEN])), min_size=1, max_size=40
)


@given(sequences, st.lists(st.sampled_from([0.5, 5.0, 80.0, 2000.0]), min_size=1, max_size=4))
def test_what_was_seen_is_weighted_by_its_age(sequence, scales) -> None:
    grid = Recency(1.0, EVIDENCE, scales=tuple(scales))
    watched(grid, *readings(sequence))
    for cell, expected in naive.recency(beams_seen(readings(sequence)), scales, **VALUES).items():
        assert h(grid, cell) == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_against_the_reference(seed: int) -> None:
    history = again(drive(seed=seed), 40.0)
    grid = integrated(Recency(0.05, EVIDENCE, RAYS), history)
    expected = naive.recency(seen(history), grid.scales, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    for cell, mean in expected.items():
        assert h(grid, cell) == pytest.approx(mean, abs=1e-5)


def test_alone_a_scale_that_never_forgets_is_the_static_map() -> None:
    history = drive(seed=5)
    recency = integrated(Recency(scales=(math.inf,)), history).cells.grid()
    static = integrated(Static(), history).cells.grid()
    np.testing.assert_allclose(recency.occupied, static.occupied, atol=1e-6)


@pytest.mark.parametrize("scale", [2.0, 10.0])
@pytest.mark.parametrize("step", [0.05, 0.1])
def test_a_scale_follows_a_door_as_fast_as_it_promises(scale: float, step: float) -> None:
    grid = Recency(1.0, EVIDENCE, scales=(scale,))
    long = int(8 * scale / step)
    watched(grid, *[(step * k, CLOSED) for k in range(long)])
    opened = scans_until(grid, OPEN, step * long, step, lambda h: h < 0.5) * step
    assert opened == pytest.approx(scale * math.log(1 + 0.85 / 0.4), rel=0.1)
    begin = step * long + opened
    watched(grid, *[(begin + step * k, OPEN) for k in range(long)])
    closed = scans_until(grid, CLOSED, begin + step * long, step, lambda h: h > 0.5) * step
    assert closed == pytest.approx(scale * math.log(1 + 0.4 / 0.85), abs=3 * step)


def test_the_scales_one_after_the_other() -> None:
    grid = Recency(1.0, scales=(5.0, 60.0, 1500.0))
    step = 0.2
    watched(grid, *[(step * k, CLOSED) for k in range(10_000)])
    assert h(grid) > 0.99
    begin = step * 10_000
    waits = [scans_until(grid, OPEN, begin, step, lambda h, below=below: h < below) * step
             for below in (0.8, 0.4)]  # fmt: skip
    assert 4 < waits[0] < 12  # the scale of 5 s
    assert 60 < waits[0] + waits[1] < 120  # that of 60 s
    assert h(grid) > 0.3  # and that of 25 minutes still believes in the door


def test_ages_count_when_a_cell_is_seen_again() -> None:
    grid = Recency(1.0, scales=(5.0,))
    closed = watched(grid, *[(0.2 * k, CLOSED) for k in range(50)])[-1]
    assert watched(grid, (1000.0, HIDDEN)) == [closed]
    assert watched(grid, (1000.2, OPEN))[0] == pytest.approx(
        naive.sigmoid(math.log(0.25) - 0.4), abs=1e-6
    )


def test_days_later_it_still_tells_scans_apart() -> None:
    grid = Recency(1.0, EVIDENCE, scales=(2.0,))
    watched(grid, (0.0, HIDDEN))
    late = [(3 * 86_400 + 0.2 * k, CLOSED) for k in range(8)]
    expected = naive.recency(beams_seen(late), (2.0,), **VALUES)[DOOR]
    assert watched(grid, *late)[-1] == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("wrong", [(), (0.0,), (5.0, -1.0), (math.nan,)])
def test_scales_that_are_none_are_refused(wrong: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="scale"):
        Recency(scales=wrong)
