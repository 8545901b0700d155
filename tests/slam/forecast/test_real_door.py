"""A real office door: 70 days are learned, three later weeks are forecast."""

from pathlib import Path

import numpy as np
import pytest

from slam import DoorForecast
from slam.io.door_runs import read_door_runs
from slam.metrics.lost import calibration_error, pooled, reliability

BARS = {0: 0.064, 1: 0.036, 15: 0.070, 60: 0.072, 1440: 0.064}
"""Mean Brier scores, by min since the look: the best plain baselines on nine later weeks."""
MAX_CALIBRATION_ERROR = 0.03


@pytest.fixture(scope="module")
def folder(shared_data: Path) -> Path:
    found = shared_data / "doors"
    if not found.is_dir():
        pytest.skip("the real door (../shared/data/doors) is not here")
    return found


@pytest.fixture(scope="module")
def door(folder: Path) -> DoorForecast:
    return DoorForecast.fit(*read_door_runs(folder / "office_2016_70_days.csv"))


def minutes(path: Path) -> tuple[np.ndarray, np.ndarray]:
    runs = read_door_runs(path)
    counts = np.rint((runs.end - runs.begin) / 60.0).astype(int)
    assert (runs.begin[1:] == runs.end[:-1]).all()  # no gap: the times below are right
    return runs.begin[0] + 60.0 * np.arange(counts.sum()), np.repeat(runs.state, counts)


@pytest.mark.parametrize("lag", BARS)
def test_no_plain_baseline_is_better_at_any_horizon(
    folder: Path, door: DoorForecast, lag: int
) -> None:
    briers, diagrams = [], []
    for week in range(1, 4):
        times, state = minutes(folder / f"office_2016_week_{week}.csv")
        look = (times[: len(times) - lag], state[: len(state) - lag]) if lag else ()
        told = door.probability(times[lag:], *look)
        briers.append(np.mean((told - state[lag:]) ** 2))
        diagrams.append(reliability(told, state[lag:] > 0))
    assert np.mean(briers) <= BARS[lag]
    assert calibration_error(pooled(diagrams)) < MAX_CALIBRATION_ERROR
