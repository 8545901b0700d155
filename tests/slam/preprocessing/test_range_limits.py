import numpy as np
import pytest

from slam.errors import InputError
from slam.preprocessing.range_limits import with_ranges
from tests.slam.worlds import MAX_RANGE, drive


def test_nearer_echoes_are_no_readings_and_farther_ones_no_echoes() -> None:
    whole = drive(n=5)
    limited = with_ranges(whole, 1.0, 2.0)
    for before, after in zip(whole.scans, limited.scans, strict=True):
        assert (after.hit == ((before.ranges >= 1.0) & (before.ranges < 2.0))).all()
        assert (after.no_echo == (before.ranges >= 2.0)).all()
        assert not (after.hit | after.no_echo)[before.ranges < 1.0].any()
    assert any(np.any(scan.ranges < 1.0) for scan in whole.scans)


def test_the_lasers_own_limits_stay() -> None:
    whole = drive(n=2)
    assert with_ranges(whole, None, None) is whole
    wide = with_ranges(whole, 0.0, 100.0)
    assert wide.scans[0].max_range == MAX_RANGE


@pytest.mark.parametrize(
    ("low", "high", "why"),
    [(3.0, 2.0, "3 to 2 m"), (7.0, None, "7 to 6 m"), (5.9, None, "no echo is left")],
)
def test_limits_that_leave_nothing_are_refused(low, high, why) -> None:
    with pytest.raises(InputError, match=why):
        with_ranges(drive(n=2), low, high)
