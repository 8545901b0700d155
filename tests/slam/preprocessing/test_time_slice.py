import numpy as np
import pytest

from slam.errors import InputError
from slam.preprocessing.time_slice import SPARE, between_times, moment
from tests.slam.worlds import drive

STAMP = 1.7e9  # s, unix time


def test_a_small_number_counts_from_the_start_and_a_large_one_is_a_stamp() -> None:
    assert moment(3.5, STAMP) == STAMP + 3.5
    assert moment(STAMP + 2, STAMP) == STAMP + 2


def test_scans_truth_and_odometry_of_the_part_are_kept() -> None:
    whole = drive(n=100)
    part = between_times(whole, 4.0, 6.0)
    assert part.times.tolist() == [k / 10 for k in range(40, 61)]
    assert whole.truth is not None
    assert part.truth is not None
    assert (part.truth.poses == whole.truth.poses[40:61]).all()
    assert part.truth.doors.shape[0] == 21
    assert part.odometry.times[0] <= 4.0 - SPARE
    assert part.odometry.times[-1] >= 6.0 + SPARE
    assert len(part.odometry) < len(whole.odometry)
    assert np.allclose(part.displacements()[1:], whole.displacements()[41:61])


def test_no_limits_change_nothing() -> None:
    whole = drive(n=20)
    assert between_times(whole, None, None) is whole
    assert between_times(whole, -5.0, 99.0) is whole


def test_a_part_without_scans_is_refused_with_the_times_there_are() -> None:
    with pytest.raises(InputError, match=r"no scan lies between 5.00 and 6.00 s: .* to 1.90 s"):
        between_times(drive(n=20), 5.0, 6.0)
    with pytest.raises(InputError, match="no scan lies"):
        between_times(drive(n=20), 1.0, 0.5)


def test_one_scan_is_enough() -> None:
    part = between_times(drive(n=20), 1.0, 1.0)
    assert np.allclose(part.times, [1.0])
