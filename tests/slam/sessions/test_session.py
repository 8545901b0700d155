"""A map is saved, loaded, continued another day, and localised in."""

from pathlib import Path

import numpy as np
import pytest

import slam
from slam.benchmark.run import run
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2, between
from slam.io.episode_file import save_episode
from slam.sessions.continuation import continued, localiser
from slam.sessions.session import Session, session_of
from tests.slam.worlds import drive

BEGIN = 60  # scan of the other drive at which the second recording begins


@pytest.fixture(scope="module")
def before() -> Session:
    """The room, mapped in the frame of the first drive's first pose."""
    episode = drive(bias=0.1)
    return session_of(episode, run(slam.make("static-ml"), episode).poses)


@pytest.fixture(scope="module")
def after() -> Episode:
    """Another drive, of which only the later part was recorded."""
    whole = drive(bias=-0.1, seed=7)
    assert whole.truth is not None
    truth = Truth(whole.truth.poses[BEGIN:], whole.truth.walls, whole.truth.doors[BEGIN:])
    return Episode(whole.scans[BEGIN:], whole.odometry, truth)


def true_poses(episode: Episode) -> np.ndarray:
    """In the first session's frame."""
    assert episode.truth is not None
    return between(drive().truth.poses[0], episode.truth.poses)  # pyright: ignore


def test_what_is_saved_comes_back(before: Session, tmp_path: Path):
    before.save(tmp_path / "a.npz")
    again = Session.load(tmp_path / "a.npz")
    assert np.array_equal(again.poses, before.poses)
    for old, new in zip(before.scans, again.scans, strict=True):
        assert np.array_equal(old.ranges, new.ranges, equal_nan=True)
        assert np.array_equal(old.angles, new.angles)
        assert (old.time, old.mount, old.max_range) == (new.time, new.mount, new.max_range)


@pytest.mark.parametrize("make", [continued, localiser])
@pytest.mark.parametrize("variant", ["hmm-ml", "dynamic-graph"])
def test_goes_on_in_the_old_frame(before: Session, after: Episode, make, variant: str):
    truth = true_poses(after)
    robot = make(before, variant, Pose2.of(truth[0]))
    done = run(robot, after)
    error = between(truth, done.poses)
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.05
    assert done.matched > 20


def test_a_localiser_leaves_the_map_alone(before: Session, after: Episode):
    robot = localiser(before, "static-ml", Pose2.of(true_poses(after)[0]))
    old = robot.map()
    run(robot, after)
    new = robot.map()
    assert np.array_equal(old.occupied, new.occupied)
    robot = continued(before, "static-ml", Pose2.of(true_poses(after)[0]))
    run(robot, after)
    assert not np.array_equal(old.occupied, robot.map().occupied)


def test_sessions_are_put_one_after_the_other(before: Session, after: Episode):
    both = before.followed_by(after.scans, true_poses(after))
    assert len(both.scans) == len(before.scans) + len(after.scans)
    frames = list(both.keyframes())
    alone = list(before.keyframes())
    assert len(alone) < len(frames) < len(both.scans)
    assert frames[len(alone)][1] == Pose2.of(true_poses(after)[0])  # its clock begins anew


@pytest.mark.parametrize("variant", ["dynamic-pf", "odometry"])
def test_what_cannot_go_on_is_told(before: Session, variant: str):
    with pytest.raises(InputError, match="continued by a variant MAP-ml"):
        continued(before, variant, Pose2())


def test_a_foreign_file_is_told(after: Episode, tmp_path: Path):
    save_episode(after, tmp_path / "episode.npz")
    with pytest.raises(InputError, match="format dynslam-episode-1, expected dyn") as told:
        Session.load(tmp_path / "episode.npz")
    assert str(told.value).count("episode.npz") == 1
    (tmp_path / "text.npz").write_text("no")
    with pytest.raises(InputError, match=r"text\.npz: not a map saved by dynslam"):
        Session.load(tmp_path / "text.npz")


def test_a_pose_for_each_scan(before: Session):
    with pytest.raises(InputError, match=r"a pose .* for each"):
        Session(before.scans, before.poses[:-1])
    with pytest.raises(InputError, match="finite"):
        Session(before.scans, np.full((len(before.scans), 3), np.nan))
