"""A saved forecast is the same forecast, and goes on learning; other files are refused."""

from pathlib import Path

import numpy as np
import pytest

from slam import DoorForecast, InputError, load_forecast, save_forecast
from tests.slam.forecast.habits import MINUTE, MONDAY, WEEK, office, runs_of


@pytest.fixture
def door() -> DoorForecast:
    return DoorForecast.fit(*runs_of(office(3)[:25_000]), timezone="Europe/London")


@pytest.mark.parametrize("known", [True, False])
def test_a_forecast_comes_back_and_goes_on(tmp_path: Path, door: DoorForecast, known: bool) -> None:
    door = door if known else DoorForecast(half_life_days=9.0)
    save_forecast(door, tmp_path / "door.npz")
    back = load_forecast(tmp_path / "door.npz")
    times = MONDAY + MINUTE * np.arange(25_000, 40_000, 17)
    for begin in (MONDAY + 3 * WEEK, MONDAY + 4 * WEEK):
        assert (back.ahead(times) == door.ahead(times)).all()
        assert back.to_dict() == door.to_dict()
        for one in (door, back):
            one.update(begin, begin + 5000.0, 1)
    assert (back.half_life_days, back.clock.name) == (door.half_life_days, door.clock.name)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("format", "dynslam-session-1"),
        ("week_open", np.zeros((7, 24))),
        ("week_open", np.full((7, 144), np.nan)),
        ("window_state", np.full(2160, 7)),
        ("look", np.array([1.0, 2.0, 3.0])),
        ("look", np.array([1.0])),
        ("timezone", "Nowhere/Here"),
        ("days", np.array(["a", "b"])),
    ],
)
def test_a_damaged_file_is_told(tmp_path: Path, door: DoorForecast, name: str, value) -> None:
    path = tmp_path / "door.npz"
    save_forecast(door, path)
    with np.load(path) as stored:
        np.savez(path, **(dict(stored) | {name: value}))
    with pytest.raises(InputError, match="not a forecast saved by dynslam"):
        load_forecast(path)


def test_a_torn_file_is_told(tmp_path: Path, door: DoorForecast) -> None:
    path = tmp_path / "door.npz"
    save_forecast(door, path)
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(InputError, match="not a forecast saved by dynslam"):
        load_forecast(path)
