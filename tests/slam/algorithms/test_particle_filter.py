"""A particle filter: every particle's map is that of its own path, and who asks changes nothing."""

import math

import numpy as np
import pytest

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.particle_filter import ParticleFilter
from slam.algorithms.variants import MAPS
from slam.benchmark.run import run
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.interface import Revising
from slam.maps.histogram import Histogram
from slam.motion.threshold import KEYFRAMES, MotionThreshold
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from tests.slam.maps.test_shared_tiles import assert_in_order
from tests.slam.rings import drive, off
from tests.slam.worlds import FAN, MAX_RANGE, loop, scan_at
from tests.slam.worlds import drive as room_drive

OFTEN = MotionThreshold(0.05, math.radians(5.0), 2.0)
SPARSE = MotionThreshold(0.25, math.radians(15.0), 4.0)
CASES = {
    "often resampled": {"particles": 6, "resample": 1.0, "spread": 1.0},
    "sometimes": {"particles": 6, "spread": 0.5},
    "never": {"particles": 4, "resample": 1e-9, "spread": 1.0},
    "one": {"particles": 1},
}
cases = pytest.mark.parametrize("case", CASES)


def paired(episode: Episode):
    return zip(episode.displacements(), episode.scans, strict=True)


def truth_of(episode: Episode) -> np.ndarray:
    assert episode.truth is not None
    return episode.truth.poses


def filtered(case: str, episode=None, seed=1, **more) -> tuple[ParticleFilter, list]:
    episode = episode or room_drive(60)
    start = Pose2.of(truth_of(episode)[0])
    parts = CASES[case] | {"keyframes": OFTEN} | more
    robot = ParticleFilter(start, np.random.default_rng(seed), **parts)
    return robot, [robot.update(*given) for given in paired(episode)]


def state(robot: ParticleFilter) -> list[bytes]:
    grid = robot.map()
    return [robot.trajectory().tobytes(), np.array(robot.pose).tobytes(), robot._poses.tobytes(),
            robot._log_weights.tobytes(), grid.occupied.tobytes(),
            grid.observed.tobytes()]  # fmt: skip


def path(robot: ParticleFilter, particle: int) -> list[Pose2]:
    """Its pose at each keyframe, by way of its parents."""
    result = []
    for poses, parents in zip(robot.paths.poses[::-1], robot.paths.parents[::-1], strict=True):
        result.append(Pose2.of(poses[particle]))
        particle = int(parents[particle])
    return result[::-1]


class Noting:
    """A map that notes which scans went into it; for one particle after the other, in turn."""

    def __init__(self, grid):
        self.grid, self.scans = grid, []

    def __getattr__(self, name):
        return getattr(self.grid, name)

    def integrate(self, scan, pose):
        if not self.scans or self.scans[-1] is not scan:
            self.scans.append(scan)
        return self.grid.integrate(scan, pose)


# -- maps and paths ----------------------------------------------------------------------------


@pytest.mark.parametrize("model", [name for name in MAPS if name != "temporal"])
@pytest.mark.parametrize("case", ["often resampled", "never"])
def test_every_particles_map_is_that_of_its_path(case: str, model: str) -> None:
    grid = Noting(MAPS[model]())
    robot, _ = filtered(case, room_drive(40), map_model=grid)
    assert len(grid.scans) == len(robot.paths.poses) > 20
    for particle, branch in enumerate(robot._maps):
        own = MAPS[model]()
        for scan, pose in zip(grid.scans, path(robot, particle), strict=True):
            own.integrate(scan, pose)
        robot.map_model.cells.tiles.switch(branch)
        found, expected = robot.map_model.cells.grid(), own.cells.grid()
        assert found.spec == expected.spec
        np.testing.assert_array_equal(found.observed, expected.observed)
        np.testing.assert_array_equal(found.occupied, expected.occupied)


@cases
def test_the_books_of_the_tiles_are_right_after_every_update(case: str) -> None:
    episode = room_drive(40)
    robot = ParticleFilter(Pose2.of(truth_of(episode)[0]), **CASES[case], keyframes=OFTEN)
    for given in paired(episode):
        robot.update(*given)
        assert_in_order(robot.map_model.cells.tiles, robot._maps)
        assert len({id(branch) for branch in robot._maps}) == robot.particles


def test_coarser_fields_are_those_of_each_particles_map() -> None:
    episode = room_drive(40)
    search = Correlative(refine=GaussNewton(levels=2))
    robot = ParticleFilter(
        Pose2.of(truth_of(episode)[0]), search=search, keyframes=OFTEN, particles=5
    )
    assert isinstance(robot.sensor_model, Endpoint)
    for given in paired(episode):
        robot.update(*given)
        for one in (robot._field, robot.sensor_model):
            assert len(one.maxima.values)  # from now on they are kept
    tiles = robot.map_model.cells.tiles
    for branch in robot._maps:
        tiles.switch(branch)
        fresh = robot.sensor_model.of_layer(robot.sensor_model.field())
        for one in (robot._field, robot.sensor_model):
            used = branch.slots
            np.testing.assert_array_equal(one.maxima.values[used], fresh.maxima.values[used])
            half, same = one.field(1).values[used], fresh.field(1).values[used]
            np.testing.assert_array_equal(half, same)


# -- what is said, and what is believed later --------------------------------------------------


@cases
def test_the_trajectory_ends_where_the_robot_is_and_changes_only_when_it_says_so(case) -> None:
    episode = drive(1.0, reach=3.0)
    robot, before, revised = ParticleFilter(**CASES[case]), np.zeros((0, 3)), 0
    for k, given in enumerate(paired(episode)):
        estimate, trajectory = robot.update(*given), robot.trajectory()
        assert trajectory.shape == (k + 1, 3)
        assert trajectory[-1] == pytest.approx(np.array(robot.pose), abs=1e-9)
        assert robot.pose == estimate.pose
        same = len(before) == 0 or np.abs(trajectory[:-1] - before).max() < 1e-9
        assert estimate.revised != same
        before, revised = trajectory, revised + estimate.revised
    assert (revised > 0) == (case != "one")
    robot.finish()
    np.testing.assert_array_equal(robot.trajectory(), before)


def test_one_particle_that_is_hardly_spread_is_maximum_likelihood() -> None:
    """Its way between keyframes is matched with the same map."""
    episode = room_drive(60)
    robot, estimates = filtered("one", episode, spread=1e-9)
    start = Pose2.of(truth_of(episode)[0])
    single = MaximumLikelihood(start, keyframes=OFTEN, registration=None)
    expected = np.array([single.update(*given).pose for given in paired(episode)])
    found = np.array([estimate.pose for estimate in estimates])
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert not any(estimate.revised for estimate in estimates)
    np.testing.assert_allclose(robot.trajectory(), found, atol=1e-9)


@pytest.mark.parametrize(("reach", "keyframes"), [(3.0, SPARSE), (4.5, KEYFRAMES)])
def test_around_the_block_it_comes_back_to_where_it_began(reach: float, keyframes) -> None:
    episode = drive(2.0, reach=reach)
    done = run(ParticleFilter(particles=10, keyframes=keyframes), episode)
    assert off(done.poses, episode).max() < 0.35
    assert off(done.poses, episode)[-20:].mean() < 0.3


@cases
def test_estimates_are_sane_where_headings_wrap(case: str) -> None:
    """A robot that looks along -x, from where its heading is pi."""
    robot = ParticleFilter(Pose2(1.5, 0.0, math.pi), **CASES[case], keyframes=OFTEN)
    for k in range(40):
        pose = Pose2(1.5 - 0.03 * k, 0.0, math.pi)
        estimate = robot.update(Pose2(0.03 if k else 0.0), scan_at(pose, 0.1 * k))
        assert math.dist(estimate.pose[:2], pose[:2]) < 0.05
        assert abs(estimate.pose.theta) <= math.pi + 1e-12
        assert np.isfinite([*estimate.pose, estimate.score]).all()
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-12
        assert estimate.covariance[2, 2] < 0.1
        np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)


def test_particles_that_explain_less_die_out() -> None:
    robot, _ = filtered("often resampled")
    generations = [len(set(parents.tolist())) for parents in robot.paths.parents[1:]]
    assert 1 <= min(generations) < 6
    for poses, parents in zip(robot.paths.poses, robot.paths.parents, strict=True):
        if len(set(parents.tolist())) < 6:  # resampled: children begin where their parent is
            of_each = {parent: poses[parents == parent] for parent in parents.tolist()}
            assert all((own == own[0]).all() for own in of_each.values())
            assert len(np.unique(poses, axis=0)) == len(of_each)
    robot, _ = filtered("never")
    assert all(parents.tolist() == [0, 1, 2, 3] for parents in robot.paths.parents)
    assert robot._log_weights.max() == 0.0 > robot._log_weights.min()
    assert robot._best == robot._log_weights.argmax()


# -- the same, whatever is asked in between ----------------------------------------------------


@cases
def test_what_is_asked_on_the_way_changes_nothing(case: str) -> None:
    alone, _ = filtered(case, map_model=Histogram())
    episode = room_drive(60)
    robot = ParticleFilter(
        Pose2.of(truth_of(episode)[0]), np.random.default_rng(1), map_model=Histogram(),
        **CASES[case], keyframes=OFTEN,
    )  # fmt: skip
    for k, given in enumerate(paired(episode)):
        robot.update(*given)
        if k % 3 == 0:
            robot.map()
        if k % 4 == 0:
            robot.trajectory()
            robot.finish()
    assert state(robot) == state(alone)


def test_the_seed_decides() -> None:
    first, again = (state(filtered("sometimes")[0]) for _ in range(2))
    assert first == again != state(filtered("sometimes", seed=2)[0])


def test_a_map_is_a_copy() -> None:
    robot, _ = filtered("sometimes", room_drive(20))
    grid = robot.map()
    kept = grid.occupied.copy()
    for k in range(5):
        robot.update(Pose2(0.1), scan_at(Pose2(0.1 * k), 50.0 + k))
    np.testing.assert_array_equal(grid.occupied, kept)


# -- odd starts and scans ----------------------------------------------------------------------


def test_before_the_first_scan_there_is_nothing() -> None:
    robot = ParticleFilter(Pose2(1.0, 2.0, 3.0), particles=3)
    assert isinstance(robot, Revising)
    assert robot.trajectory().shape == (0, 3)
    assert robot.map().observed.sum() == 0
    assert robot.pose == Pose2(1.0, 2.0, 3.0)


def test_of_one_scan_it_has_the_pose_to_which_the_odometry_leads() -> None:
    robot = ParticleFilter(Pose2(1.0, 2.0, 3.0), particles=3)
    estimate = robot.update(Pose2(0.5, 0.1, 0.4), scan_at(Pose2()))
    expected = compose((1.0, 2.0, 3.0), (0.5, 0.1, 0.4))
    assert np.array(estimate.pose) == pytest.approx(expected)
    assert robot.trajectory() == pytest.approx(expected[None])


@pytest.mark.parametrize("beams", [0, 1, 2, len(FAN)])
@pytest.mark.parametrize("fill", [math.nan, math.inf, 2.0])
@cases
def test_odd_scans_are_lived_with(case: str, fill: float, beams: int) -> None:
    robot, pose = ParticleFilter(**CASES[case], keyframes=OFTEN), Pose2()
    for k in range(12):
        displacement = Pose2(0.05 if k else 0.0, 0.0, 0.1)
        pose = pose @ displacement
        scan = Scan(np.full(beams, fill), FAN[:beams], MAX_RANGE, time=0.2 * k)
        estimate = robot.update(displacement, scan)
        assert np.isfinite([*estimate.pose, estimate.score, *estimate.covariance.ravel()]).all()
    assert math.dist(robot.pose[:2], pose[:2]) < 0.5
    assert robot.trajectory().shape == (12, 3)


def test_any_reading_will_do() -> None:
    """One whose slope says nothing: the others cannot climb far."""
    _, estimates = filtered("sometimes", room_drive(30, bias=0.2), sensor_model=Beam())
    poses = np.array([estimate.pose for estimate in estimates])
    assert np.hypot(*(poses - truth_of(room_drive(30)))[:, :2].T).max() < 0.15


def test_a_leap_of_the_odometry_is_survived() -> None:
    robot = ParticleFilter(particles=4, keyframes=OFTEN)
    for k, leap in enumerate([Pose2(), Pose2(0.1), Pose2(30.0, -20.0, 3.0), Pose2(0.1), Pose2()]):
        estimate = robot.update(leap, scan_at(Pose2.of(loop(50)[k]), 0.1 * k))
        assert np.isfinite([*estimate.pose, *estimate.covariance.ravel()]).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"particles": 0},
        {"particles": -1},
        {"particles": 1.5},
        {"spread": 0.0},
        {"spread": math.nan},
    ],
)
def test_parts_are_checked(wrong) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        ParticleFilter(**wrong)
