# pyright: reportMissingImports=false
import numpy as np

from slam.geometry import Pose2
from slam.layers.door_sights import MAX_GAP, Echoes, Sight, echoes, history
from slam.layers.doors import MappedDoor
from slam.scan import Scan

ANGLES = np.radians(np.arange(-90.0, 91.0))
DOOR = MappedDoor(np.array([[4.0, 0.5], [4.0, -0.5]]), 0.5, 2, 9.0, 0.0, 9.0, 9, 9, 0.95)


def scan(time: float, opened: bool) -> Scan:
    """From (0, 0) towards a wall at x = 4 with a gap of 1 m, and another wall at x = 7."""
    y = 4.0 * np.tan(ANGLES)
    x = np.where(opened & (np.abs(y) < 0.5), 7.0, 4.0)
    ranges = np.minimum(x / np.maximum(np.cos(ANGLES), 1e-3), 29.0)
    return Scan(ranges, ANGLES, 30.0, time=time)


def drive(states: list[bool], step: float = 0.5) -> Echoes:
    scans = [scan(10.0 + step * k, opened) for k, opened in enumerate(states)]
    return echoes(scans, np.zeros((len(scans), 3)))


def test_a_door_that_opens_and_closes() -> None:
    seen = drive([False] * 4 + [True] * 6 + [False] * 2)
    assert history(DOOR, seen) == [
        Sight(0.0, 1.5, False), Sight(2.0, 4.5, True), Sight(5.0, 5.5, False)
    ]  # fmt: skip


def test_a_time_without_a_sight_ends_it() -> None:
    scans = [scan(time, True) for time in (0.0, 1.0, 1.0 + MAX_GAP + 0.5, 6.0)]
    found = history(DOOR, echoes(scans, np.zeros((4, 3))))
    assert [(one.begin, one.end) for one in found] == [(0.0, 1.0), (1.5 + MAX_GAP, 6.0)]


def test_what_does_not_see_the_door_tells_nothing() -> None:
    away = np.tile([0.0, 0.0, np.pi], (3, 1))  # looks the other way
    scans = [scan(float(k), True) for k in range(3)]
    assert history(DOOR, echoes(scans, away)) == []
    beside = MappedDoor(np.array([[4.0, 9.0], [4.0, 8.0]]), *DOOR[1:])
    assert [one.open for one in history(beside, drive([True, False]))] == [False]


def test_the_laser_may_be_mounted_ahead_and_turned() -> None:
    mount = Pose2(0.5, 0.2, np.pi)
    mounted = [
        Scan(one.ranges, one.angles, one.max_range, time=one.time, mount=mount)
        for one in (scan(0.0, True), scan(1.0, True))
    ]
    poses = np.tile(Pose2(0.0, 0.0) @ mount.inverse(), (2, 1))
    assert history(DOOR, echoes(mounted, poses)) == [Sight(0.0, 1.0, True)]
