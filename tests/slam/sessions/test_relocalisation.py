"""Where a recording begins in a saved map: found, refused, or compared with a given start."""

import math

import numpy as np
import pytest

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2, between, compose
from slam.recovery.agreement import Agreement
from slam.recovery.places import Place
from slam.sessions import beginning
from slam.sessions.relocalisation import Comparison, certain, compared
from slam.sessions.session import Session, session_of
from slam.trajectory import Trajectory
from tests.slam.worlds import FAN, ROOM, drive, loop, scan_at

BEGIN = 60  # scan of the other drive at which the second recording begins
BOX = np.array([[-3, -2, 3, -2], [3, -2, 3, 2], [3, 2, -3, 2], [-3, 2, -3, -2.0]])
CUPBOARD = np.array([[1.9, 1.1, 2.4, 1.1], [1.9, 1.1, 1.9, 1.7], [2.4, 1.1, 2.4, 1.7]])
COARSE = np.radians(np.arange(-90, 91, 3.0))
MOUNT = Pose2(0.2, -0.05, math.radians(15.0))


def seen(walls=ROOM, first=0, angles=FAN, mount=Pose2(), seed=1) -> Episode:
    """A drive around a room of these walls, from scan `first` on, with odometry without error."""
    rng, poses = np.random.default_rng(seed), loop(150)[first:]
    times = np.arange(len(poses)) / 10
    scans = [
        scan_at(Pose2.of(pose), time, angles, walls, mount, rng)
        for pose, time in zip(poses, times, strict=True)
    ]
    truth = Truth(poses, walls, np.zeros((len(poses), 0, 4)))
    return Episode(tuple(scans), Trajectory(times, poses), truth)


@pytest.fixture(scope="module")
def before() -> Session:
    """The room at its true poses."""
    episode = drive()
    assert episode.truth is not None
    return session_of(episode, episode.truth.poses)


def error(found: Pose2, episode: Episode) -> tuple[float, float]:
    """Of the start pose, m and rad."""
    assert episode.truth is not None
    x, y, theta = between(episode.truth.poses[0], np.array(found))
    return math.hypot(x, y), abs(theta)


@pytest.mark.parametrize(
    "after",
    [
        pytest.param(seen(first=BEGIN), id="as it was"),
        pytest.param(seen(np.vstack([ROOM, CUPBOARD]), BEGIN), id="a cupboard since"),
        pytest.param(seen(first=BEGIN, angles=COARSE, mount=MOUNT), id="another laser"),
    ],
)
def test_where_a_recording_begins_is_found_without_a_guess(before: Session, after: Episode):
    distance, turn = error(certain(compared(before, after)).pose, after)
    assert distance < 0.05
    assert turn < math.radians(1.0)


def test_a_recording_of_another_place_is_refused(before: Session):
    poses = [Pose2(0.1 * k, 0.0, 0.0) for k in range(30)]
    scans = tuple(scan_at(pose, k / 10, walls=1.5 * BOX) for k, pose in enumerate(poses))
    elsewhere = Episode(scans, drive(n=30).odometry)
    with pytest.raises(
        InputError, match=r"does not seem to begin within the map|may begin at several places"
    ):
        certain(compared(before, elsewhere))


def test_a_place_that_looks_alike_from_both_ends_is_refused_with_both():
    session = session_of(seen(BOX), loop(150))
    after = seen(BOX, BEGIN, seed=2)
    with pytest.raises(InputError, match=r"several places .*--start .* or --start ") as told:
        certain(compared(session, after))
    numbers = str(told.value).replace(" or", "").split("--start ")[1:]
    found = [Pose2.of([float(x) for x in text.split()]) for text in numbers]
    turned = [Pose2(-pose.x, -pose.y, pose.theta + math.pi) for pose in found]
    assert min(error(pose, after)[0] for pose in found) < 0.05
    assert min(error(pose, after)[0] for pose in turned) < 0.05


def test_a_start_of_two_alike_is_believed():
    session = session_of(seen(BOX), loop(150))
    after = seen(BOX, BEGIN, seed=2)
    for given in (Pose2.of(loop(150)[BEGIN]), _turned(loop(150)[BEGIN])):
        found = compared(session, after, given)
        assert not found.unique
        assert found.given_is_possible
        assert found.given is not None
        assert math.dist(found.given.pose[:2], given[:2]) < 0.05


def test_a_wrong_start_is_told_from_the_right_one(before: Session):
    after = seen(first=BEGIN)
    right = Pose2.of(loop(150)[BEGIN])
    near = compared(before, after, right @ Pose2(0.1, -0.1, 0.05))
    assert near.given_is_best
    far = compared(before, after, right @ Pose2(0.8, 0.3, 2.0))
    assert far.unique
    assert not far.given_is_best
    assert not far.given_is_possible
    assert error(far.best.pose, after)[0] < 0.05


def test_no_more_of_the_path_is_compared_than_is_needed(before: Session, monkeypatch):
    monkeypatch.setattr(beginning, "PATH_LENGTHS", (0.5, 1.0, 2.0))
    whole = session_of(seen(BOX), loop(150))
    assert compared(before, seen(first=BEGIN)).path < 0.7
    assert compared(whole, seen(BOX, BEGIN, seed=2)).path > 2.0


def test_a_beginning_is_seen_from_the_middle_of_its_path():
    episode = seen(first=BEGIN)
    for part in beginning.beginnings(episode):
        origin = compose(loop(150)[BEGIN], np.array(part.middle))
        points = Pose2.of(origin)
        distance = [_to_walls(points, x, y) for x, y in part.scan.points]
        assert max(distance) < 0.1


def _turned(pose: np.ndarray) -> Pose2:
    """The pose that looks the same in the box, half a turn around its middle."""
    x, y, theta = pose
    return Pose2(-x, -y, math.remainder(theta + math.pi, math.tau))


def _to_walls(pose: Pose2, x: float, y: float) -> float:
    """Distance of a point in the frame of the pose to the walls of the room, m."""
    point = np.array((pose @ Pose2(x, y))[:2])
    begin, end = ROOM[:, :2], ROOM[:, 2:]
    along = end - begin
    share = np.clip(((point - begin) * along).sum(1) / (along**2).sum(1), 0.0, 1.0)
    return float(np.hypot(*(begin + share[:, None] * along - point).T).min())


GOOD, CHANGED, FOREIGN = Agreement(0.9, 0.0), Agreement(0.5, 0.3), Agreement(0.2, 0.1)


@pytest.mark.parametrize(
    ("agreement", "gain", "again", "unique"),
    [
        (GOOD, 25.0, False, True),
        (CHANGED, 25.0, False, True),
        (FOREIGN, 25.0, True, False),
        (GOOD, 15.0, False, False),
        (GOOD, 15.0, True, True),
        (GOOD, 5.0, True, False),
    ],
)
def test_a_place_is_unique_by_its_gain_and_a_small_gain_twice(agreement, gain, again, unique):
    best, other = Place(Pose2(), -30.0, agreement), Place(Pose2(5.0, 0.0), -30.0 - gain, GOOD)
    assert Comparison(best, other, None, 8.0, again).unique == unique
