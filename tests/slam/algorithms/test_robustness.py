"""No input that a robot may meet breaks a variant, and the score tells when it is lost."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.geometry import Pose2, wrap_angle
from slam.interface import Slam
from slam.motion.threshold import MotionThreshold
from slam.scan import Scan
from tests.slam.algorithms.parts import GRIDS, JUMPING, MOTIONS, READINGS, SEARCHES
from tests.slam.worlds import FAN, MAX_RANGE, drive, first_scans, loop, scan_at

VARIANTS = [  # with the other readings of two maps: `test_..._by_any_parts` takes the rest
    name
    for name in slam.variants()
    if name.count("/") == 0 or name.startswith(("static", "dynamic"))
]
ALWAYS = MotionThreshold(0.0, 0.0, 0.0)
ROOT = Path(__file__).parents[3]


def checked(robot: Slam, displacement: Pose2, scan: Scan):
    """An update whose estimate is sane."""
    estimate = robot.update(displacement, scan)
    assert robot.pose == estimate.pose
    assert np.isfinite([*estimate.pose, estimate.score]).all()
    assert abs(estimate.pose.theta) <= math.pi + 1e-9
    assert np.isfinite(estimate.covariance).all()
    np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-12
    grid = robot.map()
    assert np.isfinite(grid.occupied).all()
    assert ((grid.occupied >= 0) & (grid.occupied <= 1)).all()
    return estimate


# -- odd scans ---------------------------------------------------------------------------------

FULL = np.radians(np.arange(-180, 180, 3.0))
FINE = np.radians(np.linspace(-120, 120, 2000))
ONWARDS = [Pose2(0.05 * k, 0.0) for k in range(10)]


def scans_of(kind: str) -> list[Scan]:
    """Ten scans of one odd sort, of a robot that drives half a metre."""
    seen = [scan_at(pose, 0.1 * k) for k, pose in enumerate(ONWARDS)]
    match kind:
        case "one beam":
            return [scan_at(p, 0.1 * k, np.zeros(1)) for k, p in enumerate(ONWARDS)]
        case "2000 beams":
            return [scan_at(p, 0.1 * k, FINE) for k, p in enumerate(ONWARDS)]
        case "360 degrees":
            return [scan_at(p, 0.1 * k, FULL) for k, p in enumerate(ONWARDS)]
        case "no beam":
            return [Scan(np.zeros(0), np.zeros(0), MAX_RANGE, time=s.time) for s in seen]
        case "beams that change":
            return [Scan(s.ranges[9 * k:], s.angles[9 * k:], MAX_RANGE, time=s.time)
                    for k, s in enumerate(seen)]  # fmt: skip
        case "every other beam without reading":
            odd = np.arange(len(FAN)) % 2 == 1
            return [Scan(np.where(odd, math.nan, s.ranges), FAN, MAX_RANGE, time=s.time)
                    for s in seen]  # fmt: skip
        case "a laser that looks back":
            mount = Pose2(-0.2, 0.05, 2.5)
            return [scan_at(p, 0.1 * k, mount=mount) for k, p in enumerate(ONWARDS)]
        case "a laser on a long pole":
            mount = Pose2(0.0, -0.9, 0.3)
            return [scan_at(p, 0.1 * k, mount=mount) for k, p in enumerate(ONWARDS)]
        case "one scan in two is blind":
            return [Scan(np.full(len(FAN), math.inf), FAN, MAX_RANGE, time=s.time) if k % 2 else s
                    for k, s in enumerate(seen)]  # fmt: skip
    return [Scan(np.full(len(FAN), FILLS[kind]), FAN, MAX_RANGE, time=s.time) for s in seen]


FILLS = {
    "no reading": math.nan,
    "no echo": math.inf,
    "zero": 0.0,
    "negative": -1.0,
    "maximum": MAX_RANGE,
    "less than nothing": -math.inf,
    "a hair": 1e-12,
}
BLIND = ["no beam", "no reading", "zero", "negative", "less than nothing"]
EMPTY = ["no echo", "maximum"]
SEEING = ["one beam", "2000 beams", "360 degrees", "beams that change", "a laser that looks back",
          "every other beam without reading", "a laser on a long pole",
          "one scan in two is blind"]  # fmt: skip


@pytest.mark.parametrize("grid", ["static", "dynamic"])
@pytest.mark.parametrize("reading", READINGS)
@pytest.mark.parametrize("kind", [*BLIND, *EMPTY, *SEEING, "a hair"])
def test_odd_scans_are_lived_with(kind: str, grid, reading) -> None:
    robot = MaximumLikelihood(
        map_model=GRIDS[grid](), sensor_model=READINGS[reading](), keyframes=ALWAYS
    )
    for k, scan in enumerate(scans_of(kind)):
        checked(robot, Pose2(0.05 if k else 0.0), scan)
    if kind != "a hair":  # a cloud around the sensor that drives along holds the robot back
        close = {"endpoint": 0.05, "beam": 0.07, "literal": 0.15}[reading]
        assert robot.pose == pytest.approx((0.45, 0.0, 0.0), abs=close)
    assert robot.map().observed.any() == (kind not in BLIND)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("kind", ["no reading", "maximum", "one beam", "beams that change"])
def test_every_variant_lives_with_odd_scans(variant: str, kind: str) -> None:
    robot = slam.make(variant)
    for k, scan in enumerate(scans_of(kind)):
        checked(robot, Pose2(0.05 if k else 0.0), scan)
    # to the letter, a scan without echoes is likeliest where all is known to be free
    close = 0.1 if kind == "maximum" and "literal" in variant else 0.05
    assert robot.pose == pytest.approx((0.45, 0.0, 0.0), abs=close)


@pytest.mark.parametrize("motion_model", MOTIONS)
@pytest.mark.parametrize("search", SEARCHES)
def test_where_nothing_is_seen_the_odometry_leads(search, motion_model) -> None:
    robot = MaximumLikelihood(search=SEARCHES[search](), motion_model=MOTIONS[motion_model]())
    pose = Pose2()
    for scan in scans_of("no echo") + scans_of("no reading"):
        moved = Pose2(0.07, 0.01, 0.1)
        pose = pose @ moved
        checked(robot, moved, scan)
    assert robot.pose == pytest.approx(pose, abs=1e-6)


# -- odd times and motions ---------------------------------------------------------------------


def driven(robot: Slam, times, poses) -> tuple[float, float]:
    """Largest error, m, and the last heading's, rad, of a drive with true odometry at odd times."""
    before, worst = poses[0], 0.0
    for time, pose in zip(times, poses, strict=True):
        estimate = checked(robot, before.between(pose), scan_at(pose, float(time)))
        worst = max(worst, math.dist(estimate.pose[:2], pose[:2]))
        before = pose
    return worst, float(np.abs(wrap_angle(robot.pose.theta - poses[-1].theta)))


LAP = [Pose2.of(p) for p in loop(60)[:30]]
TIMES = {
    "standing still": np.zeros(30),
    "backwards": -0.1 * np.arange(30),
    "to and fro": 0.1 * np.arange(30) * (-1) ** np.arange(30),
    "long ago": 0.1 * np.arange(30) - 3e9,
    "far ahead": 0.1 * np.arange(30) + 4e9,
    "a minute is missing": 0.1 * np.arange(30) + 60.0 * (np.arange(30) > 15),
}


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("when", ["backwards", "a minute is missing"])
def test_odd_times_do_no_harm(variant: str, when: str) -> None:
    metres, radians = driven(slam.make(variant, LAP[0]), TIMES[when], LAP)
    assert metres < 0.05
    assert radians < math.radians(2.0)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("when", TIMES)
def test_odd_times_do_no_map_harm(grid, when: str) -> None:
    robot = MaximumLikelihood(LAP[0], map_model=GRIDS[grid]())
    assert driven(robot, TIMES[when], LAP)[0] < 0.05


@pytest.mark.parametrize("motion_model", MOTIONS)
def test_a_minute_of_data_is_missed_and_the_robot_drove_on(motion_model) -> None:
    poses = LAP[:12] + LAP[22:]
    times = [*(0.1 * np.arange(12)), *(61.0 + 0.1 * np.arange(8))]
    robot = MaximumLikelihood(poses[0], motion_model=MOTIONS[motion_model]())
    metres, radians = driven(robot, times, poses)
    assert metres < 0.05
    assert radians < math.radians(2.0)


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("motion_model", MOTIONS)
def test_a_leap_of_the_odometry_is_survived(motion_model, search) -> None:
    robot = MaximumLikelihood(motion_model=MOTIONS[motion_model](), search=SEARCHES[search]())
    for k, leap in enumerate([Pose2(), Pose2(0.1), Pose2(30.0, -20.0, 3.0), Pose2(0.1), Pose2()]):
        checked(robot, leap, scan_at(Pose2(), 0.1 * k))


ROUND = loop(50)
AGAIN = ROUND[:25]


def lap_scores(variant: str) -> tuple[Slam, list[float]]:
    """A robot that knows the room, and its scores in half a lap once it did."""
    before = Pose2.of(ROUND[0])
    robot = slam.make(variant, before)
    scores = []
    for k, pose in enumerate(np.concatenate([ROUND, AGAIN])):
        pose = Pose2.of(pose)
        estimate = robot.update(before.between(pose), scan_at(pose, 0.1 * k))
        before = pose
        if k >= len(ROUND) and estimate.matched:
            scores.append(estimate.score)
    return robot, scores


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name != "odometry"])
def test_the_score_tells_that_a_robot_was_kidnapped(variant: str) -> None:
    robot, scores = lap_scores(variant)
    elsewhere = Pose2(-1.0, -1.0, 2.0)  # carried off; the odometry knows nothing of it
    lost = [
        checked(robot, Pose2(0.012), scan_at(elsewhere @ Pose2(0.012 * k), 20.0 + 0.1 * k))
        for k in range(3)
    ]
    assert all(estimate.matched for estimate in lost)
    assert lost[0].score < min(scores) - 0.5 * np.ptp(scores)  # then a map may forget the room
    assert math.dist(lost[0].pose[:2], AGAIN[-1][:2]) < 0.6  # it looks no farther


# -- the same input, the same bytes ------------------------------------------------------------

FINGERPRINT = """
import sys
from tests.slam.algorithms.test_robustness import fingerprint
print(*(fingerprint(name) for name in sys.argv[1:]))
"""


def fingerprint(variant: str) -> str:
    """Of all poses and of the map, after a quarter of a lap."""
    episode = first_scans(drive(60), 15)
    done = run(slam.make(variant, true_start(episode), 3), episode)
    known = done.poses.tobytes(), done.grid.occupied.tobytes(), done.grid.observed.tobytes()
    return hashlib.sha256(b"".join(known)).hexdigest()


def test_same_input_same_bytes_in_every_process_whatever_its_threads() -> None:
    expected = [fingerprint(name) for name in VARIANTS]
    assert len(set(expected)) > len(VARIANTS) // 2
    environment = os.environ | {"NUMBA_NUM_THREADS": "1", "PYTHONHASHSEED": "77"}
    command = [sys.executable, "-c", FINGERPRINT, *VARIANTS]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == expected


# -- any drive at all --------------------------------------------------------------------------


def thousandths(most: int) -> st.SearchStrategy[float]:
    """Numbers that pure Python casts rays with, without an overflow."""
    return st.integers(-most, most).map(lambda n: n / 1000)


displacements = st.builds(Pose2, thousandths(150), thousandths(50), thousandths(400))
onwards = st.builds(Pose2, thousandths(150).map(abs), thousandths(50), thousandths(400))
drives = st.lists(onwards, min_size=1, max_size=8)
ranges = st.one_of(st.floats(0, 8), st.sampled_from([math.nan, math.inf, -1.0, 0.0, MAX_RANGE]))


@pytest.mark.parametrize("variant", VARIANTS)
@settings(max_examples=6)
@given(
    readings=st.lists(st.lists(ranges, min_size=1, max_size=20), min_size=1, max_size=6),
    told=displacements,
    times=st.lists(st.floats(-10, 10), min_size=6, max_size=6),
    mount=displacements,
)
def test_no_scan_breaks_a_variant(variant, readings, told, times, mount) -> None:
    robot = slam.make(variant)
    for beams, time in zip(readings, times, strict=False):
        angles = np.linspace(-2.0, 2.0, len(beams))
        checked(robot, told, Scan(np.array(beams), angles, MAX_RANGE, time=time, mount=mount))


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name != "odometry"])
@settings(max_examples=3)
@given(moved=drives, error=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_short_drive_is_followed(variant, moved, error) -> None:
    followed(slam.make(variant), moved, error)


@pytest.mark.parametrize(
    ("reading", "search"),
    [
        *(("endpoint", search) for search in SEARCHES),
        *((reading, search) for reading in READINGS if reading != "endpoint" for search in JUMPING),
    ],
)
@pytest.mark.parametrize("grid", GRIDS)
@settings(max_examples=2)
@given(moved=drives, error=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_short_drive_is_followed_by_any_parts(grid, reading, search, moved, error) -> None:
    parts = {
        "map_model": GRIDS[grid](),
        "sensor_model": READINGS[reading](),
        "search": SEARCHES[search](),
    }
    followed(MaximumLikelihood(**parts), moved, error)


@pytest.mark.xfail(reason="deviations are of the net displacement since the keyframe", strict=True)
def test_a_drive_to_and_fro_within_a_keyframe_is_followed() -> None:
    """15 cm of way, whose odometry turns 9 degrees too far, lead back to where it began."""
    to_and_fro = [Pose2(0.021, 0.0, 0.0), Pose2(-0.075, 0.0, 0.0), Pose2(0.05, 0.0, 0.007)]
    followed(MaximumLikelihood(), to_and_fro, (0.0, 1.0))


def followed(robot: Slam, moved, error) -> None:
    """The odometry is off by a tenth of the way and by up to 60 degrees a metre."""
    pose = Pose2()
    checked(robot, Pose2(), scan_at(pose))
    for k, displacement in enumerate(moved):
        pose = pose @ displacement
        way = math.hypot(displacement.x, displacement.y)
        off = Pose2(0.1 * error[0] * way, 0.0, error[1] * math.radians(60.0) * way)
        estimate = checked(robot, displacement @ off, scan_at(pose, 0.3 * (k + 1)))
        assert math.dist(estimate.pose[:2], pose[:2]) < 0.08
        assert abs(wrap_angle(estimate.pose.theta - pose.theta)) < math.radians(5.0)
