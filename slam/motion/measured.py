"""What a scan tells of an error of the odometry, without the prediction that it was matched by."""

from __future__ import annotations

MIN_INFORMATION_SHARE = 0.1  # of the prediction's, that a scan must add to be learned from


def measured(error: float, found: float, before: float) -> tuple[float, float] | None:
    """The error by the scan alone, and its variance; None where the scan tells too little.

    error   of the odometry's prediction, as matching found it
    found   its variance, which combines scan and prediction
    before  that of the prediction
    """
    information = 1.0 / found - 1.0 / before
    if information * before < MIN_INFORMATION_SHARE:
        return None
    return error / (found * information), 1.0 / information
