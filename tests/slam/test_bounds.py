"""Numbers that no robot on earth gives are refused where they enter, before a compiled kernel."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slam
from scripts.mapping.start import parsed_pose
from slam.bounds import MAX_COORDINATE, MAX_MOUNT, MAX_RANGE, MAX_TIME, all_within, bounded
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec
from slam.io.formats import read_log
from slam.io.loaded_recording import SourceSelection
from slam.maps.static import Static
from slam.scan import Scan
from slam.sessions.session import Session
from slam.trajectory import Trajectory
from tests.slam.io.samples import samples, small_drive

FAR = (1e10, 1e12, 1e300, math.inf, math.nan)


def scan(mount: Pose2 = Pose2(), **given: Any) -> Scan:
    limits: dict[str, Any] = {"max_range": 5.0, **given}
    return Scan(np.ones(3), np.linspace(-1, 1, 3), mount=mount, **limits)


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_mount_no_robot_has(far: float, place: int) -> None:
    """1e10 m was a segmentation fault."""
    mount = [0.0, 0.0, 0.0]
    mount[place] = -far
    with pytest.raises(InputError, match="finite mount"):
        scan(Pose2(*mount))


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("name", ["max_range", "time", "beam_time"])
def test_a_scan_with_numbers_no_laser_gives(far: float, name: str) -> None:
    given: dict[str, Any] = {name: 100 * far}
    with pytest.raises(InputError, match="a scan"):
        scan(**given)


@pytest.mark.parametrize("far", FAR)
def test_a_trajectory_that_leaves_the_earth(far: float) -> None:
    with pytest.raises(InputError, match="finite times"):
        Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [0, far, 0]]))
    with pytest.raises(InputError, match="finite times"):
        Trajectory(np.array([-100 * far, 1.0]), np.zeros((2, 3)))


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph", "hmm-pf", "odometry"])
def test_a_displacement_no_robot_makes(variant: str, far: float) -> None:
    """Given by a program rather than a file."""
    robot = slam.make(variant)
    robot.update(Pose2(), scan())
    with pytest.raises(InputError, match="a displacement has finite numbers"):
        robot.update(Pose2(far, 0.0, 0.0), scan(time=1.0))


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("make", [lambda far: (far, 0.0), lambda far: (0.0, -far)])
def test_a_map_that_begins_too_far_away(
    far: float, make: Callable[[float], tuple[float, float]]
) -> None:
    with pytest.raises(InputError, match="a map reaches"):
        Static().integrate(scan(), Pose2(*make(far)))


@pytest.mark.parametrize("far", FAR)
def test_a_start_pose_and_a_saved_map_beyond_the_earth(far: float) -> None:
    with pytest.raises(InputError, match="--start is three finite numbers"):
        parsed_pose("--start", (0.0, far, 0.0))
    with pytest.raises(InputError, match="finite poses"):
        Session((scan(),), np.array([[far, 0.0, 0.0]]))


@pytest.mark.parametrize(
    ("line", "to"),
    [
        (b"# mount: 0.25", b"# mount: 1e12"),
        (b"# range_max: 8.0", b"# range_max: 1e200"),
        (b"# beam_time: 0.0", b"# beam_time: 1e200"),
        (b"\n1.0,", b"\n-1e290,"),
        (b"1.5,0.15,", b"1.5,1e300,"),
    ],
)
def test_a_table_with_such_numbers_is_refused_in_one_line(
    tmp_path: Path, line: bytes, to: bytes
) -> None:
    path = tmp_path / "some.csv"
    table = samples()["table.csv"]
    assert line in table
    path.write_bytes(table.replace(line, to))
    with pytest.raises(InputError, match=r"some\.csv: a (scan|trajectory) ") as refused:
        read_log(path)
    assert "\n" not in str(refused.value)


def test_the_mount_of_the_command_line_is_bounded_as_that_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "some.csv"
    path.write_bytes(samples()["table.csv"])
    with pytest.raises(InputError, match="finite mount"):
        read_log(path, SourceSelection(mount=Pose2(1e12, 0.0, 0.0)))


def test_what_lies_within_the_bounds_is_mapped_as_near_the_origin() -> None:
    """The farthest map that is allowed has the cells of the same map at the origin."""
    far = MAX_COORDINATE - 10.0
    maps = []
    for x in (0.0, far):
        model = Static()
        model.integrate(scan(), Pose2(x, 0.0, 0.0))
        maps.append(model.cells.grid())
    near, distant = maps
    assert near.observed.sum() == pytest.approx(distant.observed.sum(), abs=5)
    assert isinstance(distant.spec, GridSpec)
    assert distant.spec.extent[1] > far


def test_every_sample_lies_within_the_bounds() -> None:
    drive = small_drive()
    assert bounded(drive.odometry.poses, MAX_COORDINATE)
    assert bounded(drive.times, MAX_TIME)
    assert all_within(drive.scans[0].mount, MAX_MOUNT)
    assert drive.scans[0].max_range <= MAX_RANGE
    assert bounded(np.zeros((0, 3)), 1.0)
