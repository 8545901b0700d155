"""Scores of what other systems made, against evo and against our own EpisodeScorer."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from evo.core import metrics as evo
from evo.core import sync
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from agents import record_corridor
from slam.benchmark.run import build, run
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.grid import GridSpec, OccupancyGrid, moved
from slam.io.ros_map import read_placed_map, write_ros_map
from slam.io.tum import write_tum
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.external import score_external
from slam.metrics.reference import associated, score_reference
from slam.trajectory import Trajectory


@pytest.fixture(scope="module")
def episode() -> Episode:
    return record_corridor(11)


@pytest.fixture(scope="module")
def done(episode):
    return run(build("static-ml", episode), episode)


def as_evo(trajectory: Trajectory) -> PoseTrajectory3D:
    half = trajectory.poses[:, 2] / 2
    xyz = np.column_stack([trajectory.poses[:, :2], np.zeros(len(half))])
    quaternions = np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])
    return PoseTrajectory3D(xyz, quaternions, trajectory.times)


@pytest.mark.parametrize("frame", ["anchored", "world", "aligned"])
def test_the_ate_is_evos(episode, done, frame):
    """evo reads the very files that a user would give to both."""
    shifted = compose(np.array(Pose2(0.3, -0.2, 0.1)), done.poses)
    found = score_external(episode, Trajectory(episode.times, shifted), frame=frame)
    truth = as_evo(Trajectory(episode.times, episode.truth.poses))
    estimate = as_evo(Trajectory(episode.times, shifted))
    truth, estimate = sync.associate_trajectories(truth, estimate)
    if frame == "aligned":
        estimate.align(truth)
    if frame == "anchored":
        estimate.align_origin(truth)
    ape = evo.APE(evo.PoseRelation.translation_part)
    ape.process_data((truth, estimate))
    expected = ape.get_statistic(evo.StatisticsType.rmse)
    assert found["ate"] == pytest.approx(expected, rel=1e-6)
    assert found["scans"] == len(episode.scans)


def test_evos_own_command_finds_the_same_in_our_files(episode, done, tmp_path):
    write_tum(Trajectory(episode.times, episode.truth.poses), tmp_path / "truth.tum")
    write_tum(Trajectory(episode.times, done.poses), tmp_path / "found.tum")
    command = Path(sys.executable).with_name("evo_ape")
    files = [str(tmp_path / name) for name in ("truth.tum", "found.tum", "result.zip")]
    arguments = ["tum", files[0], files[1], "--align", "--save_results", files[2]]
    subprocess.run([str(command), *arguments], check=True, capture_output=True, cwd=tmp_path)
    evos = file_interface.load_res_file(files[2]).stats["rmse"]
    ours = score_external(episode, Trajectory(episode.times, done.poses), frame="aligned")["ate"]
    assert ours == pytest.approx(evos, rel=1e-6)


def test_the_map_is_scored_as_our_own_are(episode, done, tmp_path):
    expected = EpisodeScorer(episode).scores(done.poses, done.grid)
    trajectory = Trajectory(episode.times, done.poses)
    found = score_external(episode, trajectory, done.grid, frame="world")
    for name, value in expected.items():  # stamps are looked up: the last bit may differ
        assert found[name] == pytest.approx(value, rel=1e-9), name
    write_ros_map(done.grid, tmp_path / "map.yaml")
    grid, frame = read_placed_map(tmp_path / "map.yaml")
    again = score_external(episode, trajectory, grid, frame, "world")
    for name in ("f1_5cm", "recall_10cm_aligned", "adnn_truth_to_map"):
        assert again[name] == pytest.approx(expected[name], abs=1e-9)


def test_a_map_in_a_frame_of_its_own_is_scored_where_it_lies(episode, done):
    """The same cells, seen from another origin: an exact half turn, and cells of the lattice."""
    world = Pose2.of(episode.truth.poses[0])
    own = Pose2(-2.0, 1.0, np.pi)  # where the world lies in the frame of the other system
    poses = compose(np.array(own), done.poses)
    rows = done.grid.spec
    _, x1, _, y1 = rows.extent
    corner = own @ Pose2(x1, y1, 0.0)
    spec = GridSpec(0.05, round(corner.y / 0.05), round(corner.x / 0.05), *rows.shape)
    turned = OccupancyGrid(spec, done.grid.occupied[::-1, ::-1], done.grid.observed[::-1, ::-1])
    found = score_external(episode, Trajectory(episode.times, poses), turned)
    expected = EpisodeScorer(episode).scores(
        compose(np.array(world @ Pose2.of(done.poses[0]).inverse()), done.poses), done.grid
    )
    assert found["ate"] == pytest.approx(expected["ate_anchored"], abs=1e-9)
    for name in ("f1_5cm_aligned", "adnn_map_to_truth_aligned"):
        assert found[name] == pytest.approx(expected[name], rel=1e-6)
    assert found["brier_share_all"] == pytest.approx(expected["brier_share_all"], rel=0.05)


def test_of_keyframes_no_scan_between_them_is_scored(episode):
    """Else a perfect trajectory has an error, and its first pose lies on that of another scan."""
    sparse = slice(6, None, 7)
    truth = Trajectory(episode.times[sparse], episode.truth.poses[sparse])
    found = score_external(episode, truth)
    assert found["scans"] == len(truth)
    assert found["ate"] == pytest.approx(0.0, abs=1e-9)
    assert found["heading_max"] == pytest.approx(0.0, abs=1e-9)


def test_poses_between_the_scans_are_interpolated(episode):
    """At 10 Hz, as the scans are, but not at the same moments."""
    whole = Trajectory(episode.times, episode.truth.poses)
    times = episode.times[:-1] + 0.05
    found = score_external(episode, Trajectory(times, whole.at(times)))
    assert found["scans"] == len(times) - 1
    assert found["ate_aligned"] == pytest.approx(0.0, abs=0.005)


def test_where_the_maps_frame_lies_in_the_trajectorys_is_undone(episode, done):
    """The same trajectory and map, both seen from elsewhere; aligned, no frame is the world's."""
    elsewhere, here = Pose2(1.0, 2.0, 0.7), Trajectory(episode.times, done.poses)
    there = Trajectory(episode.times, compose(np.array(elsewhere), done.poses))
    plain = score_external(episode, here, done.grid, frame="aligned")
    found = score_external(episode, there, done.grid, elsewhere, frame="aligned")
    assert found["ate"] == pytest.approx(plain["ate"], abs=1e-9)
    for name in ("f1_5cm", "adnn_map_to_truth", "adnn_truth_to_map"):
        assert found[name] == pytest.approx(plain[name], rel=1e-6)


def test_a_trajectory_that_begins_late_is_scored_where_it_is(episode, done):
    late = Trajectory(episode.times[100:], done.poses[100:])
    found = score_external(episode, late)
    assert found["scans"] == pytest.approx(len(episode.scans) - 100, abs=1)


def test_stamps_that_never_meet_are_refused(episode, done):
    other = Trajectory(episode.times + 1000, done.poses)
    with pytest.raises(InputError, match="no stamp of the reference"):
        score_external(episode, other)
    with pytest.raises(InputError, match="frame must be one of 'anchored', 'world', 'aligned'"):
        score_external(episode, Trajectory(episode.times, done.poses), frame="map")
    with pytest.raises(InputError, match="a score needs an episode that holds the truth"):
        score_external(Episode(episode.scans, episode.odometry), other)


# -- a reference with stamps of its own ------------------------------------------------------------


def circle(times: np.ndarray) -> Trajectory:
    theta = 0.2 * times
    return Trajectory(times, np.column_stack([np.cos(theta), np.sin(theta), theta + np.pi / 2]))


def test_stamps_between_are_interpolated():
    reference, estimate = circle(np.arange(0.05, 10.0, 0.1)), circle(np.arange(0.0, 10.1, 0.1))
    truth, found = associated(reference, estimate)
    assert len(truth) == 100
    assert found[:, :2] == pytest.approx(truth[:, :2], abs=1e-3)
    assert np.cos(found[:, 2] - truth[:, 2]) == pytest.approx(np.ones(100))
    scores = score_reference(reference, estimate)
    assert scores.ate_aligned < 1e-3
    assert scores.stamps == 100


def test_gaps_are_left_out():
    times = np.concatenate([np.arange(0.0, 3.0, 0.1), np.arange(6.0, 10.0, 0.1)])
    truth, _ = associated(circle(np.arange(0.0, 10.0, 0.1)), circle(times))
    assert len(truth) == 30 + 40 + 2  # and one stamp beside each end of the gap


def test_the_aligned_ate_of_a_reference_is_evos():
    rng = np.random.default_rng(0)
    reference, estimate = circle(np.arange(0.0, 10.0, 0.1)), circle(np.arange(0.0, 10.0, 0.1))
    poses = compose(np.array(Pose2(3.0, 1.0, 2.0)), estimate.poses)
    poses[:, :2] += 0.05 * rng.standard_normal((100, 2))
    estimate = Trajectory(estimate.times, poses)
    truth, found = as_evo(reference), as_evo(estimate)
    found.align(truth)
    ape = evo.APE(evo.PoseRelation.translation_part)
    ape.process_data((truth, found))
    expected = ape.get_statistic(evo.StatisticsType.rmse)
    assert score_reference(reference, estimate).ate_aligned == pytest.approx(expected, rel=1e-6)


# -- a map moved -----------------------------------------------------------------------------------


def test_a_map_that_is_not_moved_is_the_same(done):
    assert moved(done.grid, Pose2()) is done.grid


def test_a_moved_map_holds_each_cell_where_it_went(done):
    frame = Pose2(1.0, -0.5, 0.3)
    there = moved(done.grid, frame)
    rng = np.random.default_rng(0)
    cells = np.argwhere(done.grid.observed)
    for row, col in rng.choice(cells, 200):
        centre = done.grid.spec.centres(np.array([[row, col]]))[0]
        place = frame @ Pose2(centre[0], centre[1], 0.0)
        (r, c), *_ = there.spec.cells(np.array([[place.x, place.y]]))
        centre = there.spec.centres(np.array([[r, c]]))[0]
        back = frame.inverse() @ Pose2(centre[0], centre[1], 0.0)
        (r0, c0), *_ = done.grid.spec.cells(np.array([[back.x, back.y]]))
        assert there.occupied[r, c] == done.grid.occupied[r0, c0]
        assert there.observed[r, c] == done.grid.observed[r0, c0]
    assert there.observed.sum() == pytest.approx(done.grid.observed.sum(), rel=0.01)
