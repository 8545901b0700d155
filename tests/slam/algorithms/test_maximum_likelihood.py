import itertools
import math

import numpy as np
import pytest

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.geometry import Pose2, between, wrap_angle
from slam.interface import MapModel
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.motion import OdometryMotion
from slam.perception.endpoint import Endpoint
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from slam.spacing import Spacing
from tests.slam.worlds import FAN, MAX_RANGE, drive, scan_at

ALWAYS, NEVER = Spacing(0.0, 0.0, 0.0), Spacing(math.inf, math.inf, math.inf)
GRIDS = [Static, Clamped, Histogram]
SEARCHES = [HillClimb, RandomRestart, Correlative]


@pytest.fixture(scope="module")
def episode():
    """A lap of the room; the odometry turns by the paper's 3 degrees per 5 cm too far."""
    return drive()


def errors(poses, episode) -> tuple[float, float]:
    """Largest errors, m and rad."""
    away = poses - episode.truth.poses
    return float(np.hypot(*away[:, :2].T).max()), float(np.abs(wrap_angle(away[:, 2])).max())


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("grid", GRIDS)
def test_every_grid_and_search_follows_where_dead_reckoning_is_lost(grid, search, episode) -> None:
    start = true_start(episode)
    done = run(MaximumLikelihood(start, grid=grid(), search=search()), episode)
    metres, radians = errors(done.poses, episode)
    assert metres < 0.06
    assert radians < math.radians(2.5)
    assert done.matched > 50
    lost = errors(run(DeadReckoning(start), episode).poses, episode)
    assert lost[0] > 1.0


def test_static_and_dynamic_are_about_equal_where_nothing_changes(episode) -> None:
    start = true_start(episode)
    static, dynamic = (
        run(MaximumLikelihood(start, grid=g), episode) for g in (Static(), Histogram())
    )
    apart = between(static.poses, dynamic.poses)
    assert np.hypot(*apart[:, :2].T).max() < 0.03
    assert np.abs(apart[:, 2]).max() < math.radians(1.0)
    assert not np.array_equal(static.poses, dynamic.poses)


@pytest.mark.parametrize("search", SEARCHES)
def test_the_same_seed_gives_the_same_bytes(search, episode) -> None:
    def result(seed: int) -> tuple[bytes, bytes]:
        rng = np.random.default_rng(seed)
        done = run(MaximumLikelihood(true_start(episode), rng, search=search()), episode)
        return done.poses.tobytes(), done.grid.occupied.tobytes()

    assert result(7) == result(7)
    if search is RandomRestart:
        assert result(7) != result(8)


def test_the_start_moves_poses_and_map_alike(episode) -> None:
    done = [run(MaximumLikelihood(start), episode) for start in (Pose2(), Pose2(6.4, -3.2))]
    np.testing.assert_allclose(done[1].poses - done[0].poses - (6.4, -3.2, 0), 0, atol=1e-6)
    moved = done[0].grid.spec._replace(
        row0=done[0].grid.spec.row0 - 64, col0=done[0].grid.spec.col0 + 128
    )
    seen = [moved.centres(np.argwhere(done[0].grid.observed)),
            done[1].grid.spec.centres(np.argwhere(done[1].grid.observed))]  # fmt: skip
    np.testing.assert_allclose(seen[0], seen[1])


def test_a_robot_at_rest_stays_where_it_is() -> None:
    slam = MaximumLikelihood(Pose2(0.3, 0.2, 0.4), keyframes=ALWAYS)
    for k in range(20):
        slam.update(Pose2(), scan_at(Pose2(0.3, 0.2, 0.4), time=0.1 * k))
    assert math.hypot(slam.pose.x - 0.3, slam.pose.y - 0.2) < 0.005
    assert abs(slam.pose.theta - 0.4) < math.radians(0.3)


def test_matches_between_keyframes_leave_no_trace() -> None:
    truth = [Pose2(0.02 * k, 0.1, 0.03 * k) for k in range(9)]
    keyframes = Spacing(0.15, 9.0, 99.0)
    motions = [Pose2(), *(a.between(b) for a, b in itertools.pairwise(truth))]
    slams = [
        MaximumLikelihood(truth[0], matches=matches, keyframes=keyframes)
        for matches in (ALWAYS, NEVER)
    ]
    matched = []
    for pose, motion in zip(truth, motions, strict=True):
        estimates = [slam.update(motion, scan_at(pose)) for slam in slams]
        matched.append([estimate.matched for estimate in estimates])
    assert [all(pair) for pair in matched] == [True] + [False] * 7 + [True]
    assert [pair[0] for pair in matched] == [True] * 9
    assert slams[0].pose == slams[1].pose
    maps = [slam.map() for slam in slams]
    np.testing.assert_array_equal(maps[0].occupied, maps[1].occupied)
    np.testing.assert_array_equal(slams[0].grid.centroids.offset, slams[1].grid.centroids.offset)


def test_between_matches_the_odometry_leads_and_doubt_grows() -> None:
    slam = MaximumLikelihood(matches=Spacing(0.5, 9.0, 99.0), keyframes=Spacing(0.5, 9.0, 99.0))
    scan, motion = scan_at(Pose2()), Pose2(0.1, 0.02, 0.1)
    at_rest = slam.update(Pose2(), scan)
    assert at_rest.matched
    pose, before = Pose2(), np.zeros(3)
    for k in range(1, 4):
        pose = pose @ motion
        estimate = slam.update(motion, scan)
        assert not estimate.matched
        assert estimate.pose == pytest.approx(pose)
        assert (np.diag(estimate.covariance) > before).all()
        before = np.diag(estimate.covariance)
        moved = Pose2.of(pose)
        deviations = OdometryMotion().deviations(moved)
        assert estimate.covariance[2, 2] == pytest.approx(deviations[2] ** 2), k
        assert before[:2].sum() == pytest.approx(2 * deviations[0] ** 2)


def test_the_score_is_the_mean_log_likelihood_of_an_echo() -> None:
    slam = MaximumLikelihood(keyframes=ALWAYS)
    for k in range(4):
        slam.update(Pose2(), scan_at(Pose2(), time=k))
    estimate = slam.update(Pose2(), scan_at(Pose2(), time=4))
    scan, reading = scan_at(Pose2()), Endpoint()
    grid = Static()
    for k in range(4):
        reading.refresh(grid, grid.integrate(scan_at(Pose2(), time=k), Pose2()))
    expected = reading.log_likelihood(scan, np.zeros((1, 3)))[0] / len(scan.points)
    assert estimate.score == pytest.approx(expected, abs=0.01)
    assert estimate.score < 0


def scans_of(kind: str) -> list[Scan]:
    """Ten scans of one odd sort."""
    full = np.radians(np.arange(-180, 180, 3.0))
    room = [scan_at(Pose2(0.05 * k, 0.0), 0.1 * k) for k in range(10)]
    if kind == "one beam":
        return [scan_at(Pose2(0.05 * k, 0.0), 0.1 * k, np.zeros(1)) for k in range(10)]
    if kind == "360 degrees":
        return [scan_at(Pose2(0.05 * k, 0.0), 0.1 * k, full) for k in range(10)]
    if kind == "no beam":
        return [Scan(np.zeros(0), np.zeros(0), MAX_RANGE, time=s.time) for s in room]
    if kind == "beams that change":
        return [Scan(s.ranges[k:], s.angles[k:], MAX_RANGE, time=s.time)
                for k, s in enumerate(room)]  # fmt: skip
    fill = {"no reading": math.nan, "no echo": math.inf, "zero": 0.0, "negative": -1.0}[kind]
    return [Scan(np.full(len(FAN), fill), FAN, MAX_RANGE, time=s.time) for s in room]


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize(
    "kind",
    ["one beam", "360 degrees", "no beam", "beams that change", "no reading", "no echo", "zero",
     "negative"],
)  # fmt: skip
def test_odd_scans_are_lived_with(kind: str, grid) -> None:
    slam = MaximumLikelihood(grid=grid(), keyframes=ALWAYS)
    for k, scan in enumerate(scans_of(kind)):
        estimate = slam.update(Pose2(0.05 if k else 0.0), scan)
        assert np.isfinite([*estimate.pose, estimate.score]).all()
        assert np.isfinite(estimate.covariance).all()
        assert (np.linalg.eigvalsh(estimate.covariance) >= -1e-12).all()
    assert slam.pose == pytest.approx((0.45, 0.0, 0.0), abs=0.05)
    blind = kind in ("no beam", "no reading", "zero", "negative")
    assert slam.map().observed.any() == (not blind)


def test_a_part_of_ones_own_takes_the_place_of_any_other(episode) -> None:
    asked = []

    class Believing:
        """A motion model that believes the odometry, a reading without opinion, a lazy search."""

        def deviations(self, motion):
            asked.append("motion")
            return np.full(3, 1e-3)

        def refresh(self, grid: MapModel, changed):
            asked.append("refresh")

        def log_likelihood(self, scan, poses):
            asked.append("likelihood")
            return np.zeros(len(poses))

        def __call__(self, objective, start, deviations, rng):
            asked.append("search")
            assert objective(np.array([start]))[0] == 0.0
            return start

    own = Believing()
    slam = MaximumLikelihood(true_start(episode), perception=own, motion=own, search=own)
    poses = run(slam, episode).poses
    lost = run(DeadReckoning(true_start(episode)), episode).poses
    np.testing.assert_allclose(poses[:, :2], lost[:, :2], atol=1e-9)
    assert set(asked) == {"motion", "refresh", "likelihood", "search"}


def test_the_map_that_is_given_out_is_a_copy() -> None:
    slam = MaximumLikelihood()
    slam.update(Pose2(), scan_at(Pose2()))
    given = slam.map()
    before = given.occupied.copy()
    slam.update(Pose2(0.2), scan_at(Pose2(0.2)))
    np.testing.assert_array_equal(given.occupied, before)
    assert not np.array_equal(slam.map().occupied, before)


def test_doubt_after_a_match_is_the_matchs_and_the_odometrys() -> None:
    slam = MaximumLikelihood(matches=Spacing(0.3, 9.0, 99.0), keyframes=Spacing(0.3, 9.0, 99.0))
    slam.update(Pose2(), scan_at(Pose2()))
    match = slam.update(Pose2(0.3), scan_at(Pose2(0.3)))
    after = slam.update(Pose2(0.2), scan_at(Pose2(0.5)))
    assert (match.matched, after.matched) == (True, False)
    assert match.covariance[0, 0] > 0
    added = OdometryMotion().deviations(Pose2(0.2)) ** 2
    np.testing.assert_allclose(np.diag(after.covariance - match.covariance), added)
    assert after.score == match.score < 0
