"""The offset between laser and odometry, estimated and corrected."""

import dataclasses
import math

import numpy as np
import pytest

from agents import record_path
from slam.episode import Episode
from slam.io.formats import read_log
from slam.preprocessing.clock import (
    MIN_OFFSET,
    Clock,
    ClockEstimate,
    estimated_clock,
    synchronised,
    with_clock,
)
from slam.preprocessing.deskewing import deskewed
from slam.scan import Scan
from slam.trajectory import Trajectory
from tests.slam.worlds import ROOM, drive

LAGS = [-0.2, 0.0, 0.1, 0.2, 0.4]  # s


def lagged(episode: Episode, seconds: float) -> Episode:
    """Its odometry tells at each stamp where the robot was `seconds` before."""
    odometry = episode.odometry
    late = Trajectory(odometry.times, odometry.at(odometry.times - seconds))
    return dataclasses.replace(episode, odometry=late)


@pytest.fixture(scope="module", params=["DoorCorridor-v0", "DoorLoop-v0"])
def recorded(request: pytest.FixtureRequest) -> list[Episode]:
    """Drives of seeds that nothing was chosen on."""
    return [record_path(request.param, seed) for seed in (6101, 6102)]


@pytest.mark.parametrize("lag", LAGS)
def test_a_lag_of_simulated_odometry_is_found(recorded: list[Episode], lag: float):
    for episode in recorded:
        found = estimated_clock(lagged(episode, lag))
        assert found.reason == ""
        assert found.offset == pytest.approx(lag, abs=0.03)
        assert abs(found.offset - lag) < 4 * found.deviation
        assert found.significant == (lag != 0)


def test_what_is_not_significant_is_not_corrected(recorded: list[Episode]):
    assert synchronised(recorded[0]) is recorded[0]


def test_a_correction_undoes_a_lag(recorded: list[Episode]):
    episode = recorded[0]
    late = dataclasses.replace(
        episode, odometry=Trajectory(episode.times + 0.25, episode.odometry.poses)
    )
    again = with_clock(late, Clock(0.25))
    assert np.allclose(again.odometry.at(episode.times), episode.odometry.poses, atol=1e-9)
    assert again.meta["clock"] == {"offset_s": 0.25, "stamp": "begin"}
    assert again.times.tolist() == episode.times.tolist()


@pytest.mark.parametrize("seconds", [-0.3, 0.3])
def test_the_robot_goes_on_where_the_moved_odometry_ends(seconds: float):
    """Straight ahead with 1 m/s: the corrected odometry does so at all stamps."""
    times = np.linspace(0, 5, 51)
    poses = np.column_stack([times, np.zeros(51), np.zeros(51)])
    scans = tuple(Scan(np.ones(3), np.zeros(3), 2.0, time=t) for t in times.tolist())
    moved = with_clock(Episode(scans, Trajectory(times, poses)), Clock(seconds))
    steps = np.array(moved.displacements())[1:]
    assert np.allclose(steps, (0.1, 0, 0), atol=1e-9)


def turning(rate_of, seconds=12.0, step=0.1, sweep=0.0, stamp_at_end=False) -> Episode:
    """A laser of 360 beams that turns on the spot, at `rate_of(t)` rad/s; odometry of 50 Hz."""
    fine = np.arange(-1, seconds + 1, 0.02)
    heading = np.cumsum(rate_of(fine)) * 0.02
    angles = np.radians(np.arange(360.0))
    begun = np.arange(0, seconds, step)
    scans = []
    for begin in begun.tolist():
        stamps = begin + sweep * np.arange(360) / 360
        ranges = cast(0.4 + 0j, np.interp(stamps, fine, heading) + angles)
        time = begin + stamp_at_end * sweep
        scans.append(Scan(ranges, angles, 8.0, time=time, beam_time=sweep / 360))
    still = np.zeros_like(heading)
    return Episode(tuple(scans), Trajectory(fine, np.column_stack([still, still, heading])))


def cast(origin: complex, headings: np.ndarray) -> np.ndarray:
    """(beams,) m to the walls of the room."""
    nearest = np.full(len(headings), np.inf)
    way = np.exp(1j * headings)
    for x1, y1, x2, y2 in ROOM:
        wall, to = complex(x2 - x1, y2 - y1), complex(x1, y1) - origin
        across = (way.conjugate() * wall).imag
        with np.errstate(divide="ignore", invalid="ignore"):
            r = (to.conjugate() * wall).imag / across
            t = -(way.conjugate() * to).imag / across
            nearest = np.where((r > 0) & (t >= 0) & (t <= 1) & (r < nearest), r, nearest)
    return nearest


def swinging(t: np.ndarray) -> np.ndarray:
    return 0.8 * np.sin(1.3 * t) + 0.3 * np.sin(3.1 * t)


@pytest.mark.parametrize("end", [False, True])
def test_a_stamp_of_the_end_of_a_sweep_is_told(end: bool):
    episode = turning(swinging, sweep=0.1, stamp_at_end=end)
    found = estimated_clock(episode)
    assert found.end == end
    assert found.offset == pytest.approx(0, abs=0.015)
    corrected = synchronised(episode)
    assert corrected.times == pytest.approx(np.arange(0, 12, 0.1), abs=1e-9)
    scan = deskewed(corrected).scans[40]
    heading = corrected.odometry.at(np.array([4.0]))[0, 2]
    assert np.abs(scan.ranges - cast(0.4 + 0j, heading + scan.angles)).max() < 0.01


def test_even_turning_does_not_tell():
    found = estimated_clock(turning(lambda t: np.full_like(t, 0.5)))
    assert math.isnan(found.middle)
    assert "turn" in found.reason
    assert found.clock == Clock()


def test_odometry_of_another_drive_does_not_tell():
    episode, other = drive(n=150), turning(swinging, seconds=20.0)
    found = estimated_clock(dataclasses.replace(episode, odometry=other.odometry))
    assert found.reason
    assert found.clock == Clock()


@pytest.mark.parametrize("name", ["aces", "edmonton"])
def test_scans_that_are_far_apart_do_not_tell(shared_data, name: str):
    episode = read_log(shared_data / f"{name}.log.gz").episode
    assert "follow each other" in estimated_clock(episode).reason
    assert synchronised(episode) is episode


def test_without_odometry_there_is_no_offset():
    episode = dataclasses.replace(drive(n=100), meta={"odometry": ""})
    assert estimated_clock(episode).reason == "there is no odometry"


def test_csail_has_early_odometry(shared_data):
    """So have the steps of static-ml, which use it only as a start: rotation and translation
    differ least from it by 0.14 to 0.18 s."""
    found = estimated_clock(read_log(shared_data / "csail.log.gz").episode)
    assert found.offset == pytest.approx(-0.15, abs=0.03)


def test_intel_has_one_clock(shared_data):
    episode = read_log(shared_data / "intel.log.gz").episode
    assert abs(estimated_clock(episode).offset) < MIN_OFFSET
    assert synchronised(episode) is episode


@pytest.mark.parametrize(
    ("middle", "deviation", "sweep", "expected"),
    [
        (0.2, 0.005, 0.0, Clock(0.2, False)),
        (0.2, 0.005, 0.1, Clock(0.15, False)),
        (-0.11, 0.005, 0.1, Clock(-0.06, True)),
        (-0.05, 0.005, 0.1, Clock(0.0, True)),
        (-0.01, 0.005, 0.01, Clock(0.0, False)),
        (0.05, 0.02, 0.0, Clock(0.0, False)),
        (math.nan, math.nan, 0.1, Clock(0.0, False)),
    ],
)
def test_what_is_corrected(middle: float, deviation: float, sweep: float, expected: Clock):
    clock = ClockEstimate(middle, deviation, sweep).clock
    assert clock.offset == pytest.approx(expected.offset, abs=1e-9)
    assert clock.end == expected.end
