import copy
import gc
import itertools
import math
import weakref

import numpy as np
import pytest

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.geometry import Pose2, between, wrap_angle
from slam.graph.bulk import AT_ONCE
from slam.interface import MapModel, Slope
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.motion.gaussian import GaussianMotion, Prediction, odometry_covariance
from slam.motion.threshold import MotionThreshold
from slam.recovery.watch import Watch
from slam.sensor_models.endpoint import Endpoint
from tests.slam.algorithms.parts import GRIDS, JUMPING, MOTIONS, READINGS, SEARCHES
from tests.slam.worlds import drive, first_scans, scan_at

ALWAYS, NEVER = MotionThreshold(0.0, 0.0, 0.0), MotionThreshold(math.inf, math.inf, math.inf)


@pytest.fixture(scope="module")
def episode():
    """A lap of the room; the odometry turns by the paper's 3 degrees per 5 cm too far."""
    return drive(LAP)


def errors(poses, episode) -> tuple[float, float]:
    """Largest errors, m and rad."""
    away = poses - episode.truth.poses
    return float(np.hypot(*away[:, :2].T).max()), float(np.abs(wrap_angle(away[:, 2])).max())


LAP = 150  # scans


def scans_for(reading: str, search: str) -> int:
    """A lap; less of it where a scan takes tens of milliseconds."""
    if reading == "endpoint":
        return LAP
    return LAP // 3 if search == "random restart" else LAP // 2


COMBINATIONS = sorted(
    {(grid, "endpoint", "adaptive", search) for grid in GRIDS for search in SEARCHES}
    | {
        ("static", "endpoint", motion_model, search)
        for motion_model in MOTIONS
        for search in SEARCHES
    }
    | {
        ("dynamic", reading, motion_model, "correlative")
        for reading in READINGS
        for motion_model in MOTIONS
    }
    | {("dynamic", reading, "adaptive", search) for reading in READINGS for search in JUMPING}
)


@pytest.mark.parametrize(("grid", "reading", "motion_model", "search"), COMBINATIONS)
def test_all_parts_together_follow_where_dead_reckoning_is_lost(
    grid, reading, motion_model, search, episode
) -> None:
    episode = first_scans(episode, scans_for(reading, search))
    slam = MaximumLikelihood(
        true_start(episode), map_model=GRIDS[grid](), sensor_model=READINGS[reading](),
        motion_model=MOTIONS[motion_model](), search=SEARCHES[search](),
    )  # fmt: skip
    done = run(slam, episode)
    metres, radians = errors(done.poses, episode)
    assert metres < 0.06
    assert radians < math.radians(2.5)
    assert done.matched > len(episode.scans) / 3


@pytest.mark.parametrize("scans", [LAP // 3, LAP // 2, LAP])
def test_dead_reckoning_is_lost(scans, episode) -> None:
    episode = first_scans(episode, scans)
    lost = errors(run(DeadReckoning(true_start(episode)), episode).poses, episode)
    assert lost[0] > 1.0


def test_static_and_dynamic_are_about_equal_where_nothing_changes(episode) -> None:
    start = true_start(episode)
    static, dynamic = (
        run(MaximumLikelihood(start, map_model=g), episode) for g in (Static(), Histogram())
    )
    apart = between(static.poses, dynamic.poses)
    assert np.hypot(*apart[:, :2].T).max() < 0.03
    assert np.abs(apart[:, 2]).max() < math.radians(1.0)
    assert not np.array_equal(static.poses, dynamic.poses)


@pytest.mark.parametrize("search", SEARCHES)
def test_the_same_seed_gives_the_same_bytes(search, episode) -> None:
    def result(seed: int) -> tuple[bytes, bytes]:
        rng = np.random.default_rng(seed)
        slam = MaximumLikelihood(true_start(episode), rng, search=SEARCHES[search]())
        done = run(slam, episode)
        return done.poses.tobytes(), done.grid.occupied.tobytes()

    assert result(7) == result(7)
    if search == "random restart":
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
    keyframes = MotionThreshold(0.15, 9.0, 99.0)
    displacements = [Pose2(), *(a.between(b) for a, b in itertools.pairwise(truth))]
    slams = [
        MaximumLikelihood(truth[0], matches=matches, keyframes=keyframes)
        for matches in (ALWAYS, NEVER)
    ]
    matched = []
    for pose, displacement in zip(truth, displacements, strict=True):
        estimates = [slam.update(displacement, scan_at(pose)) for slam in slams]
        matched.append([estimate.matched for estimate in estimates])
    assert [all(pair) for pair in matched] == [True] + [False] * 7 + [True]
    assert [pair[0] for pair in matched] == [True] * 9
    assert slams[0].pose == slams[1].pose
    maps = [slam.map() for slam in slams]
    np.testing.assert_array_equal(maps[0].occupied, maps[1].occupied)
    offsets = [slam.map_model.cells.centroids.dense()[0] for slam in slams]
    np.testing.assert_array_equal(offsets[0], offsets[1])


def carried(covariance, x: float, y: float) -> np.ndarray:
    """What becomes of a pose's covariance on a way that is known exactly."""
    F = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    return F @ covariance @ F.T


def test_between_matches_the_odometry_leads_and_doubt_grows() -> None:
    far, model = MotionThreshold(0.5, 9.0, 99.0), GaussianMotion()
    slam = MaximumLikelihood(motion_model=model, matches=far, keyframes=far)
    scan, displacement = scan_at(Pose2()), Pose2(0.1, 0.02, 0.1)
    at_rest = slam.update(Pose2(), scan)
    assert at_rest.matched
    pose, before = Pose2(), np.zeros(3)
    for _ in range(3):
        pose = pose @ displacement
        estimate = slam.update(displacement, scan)
        assert not estimate.matched
        assert estimate.pose == pytest.approx(pose)
        assert (np.diag(estimate.covariance) > before).all()
        before = np.diag(estimate.covariance)
        predicted = Prediction(Pose2(), pose, model.deviations(pose))
        expected = odometry_covariance(*predicted.gaussian)
        np.testing.assert_allclose(estimate.covariance, expected)


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


def test_a_part_of_ones_own_takes_the_place_of_any_other(episode) -> None:
    asked = []

    class Believing:
        """A motion model that believes the odometry, a reading without opinion, a lazy search."""

        levels, sharpness = 1, 1.0

        def corrected(self, displacement):
            asked.append("corrected")
            return displacement

        def deviations(self, displacement):
            asked.append("deviations")
            return np.full(3, 1e-3)

        def learn(self, displacement, found, covariance):
            asked.append("learn")

        def refresh(self, map_model: MapModel, changed):
            asked.append("refresh")

        def log_likelihood(self, scan, poses, floor=-math.inf):
            asked.append("likelihood")
            return np.zeros(len(poses))

        def slope(self, scan, pose, level=0):
            return Slope(0.0, np.zeros(3), np.zeros((3, 3)))

        def __call__(self, posterior, rng):
            asked.append("search")
            start = posterior.prediction.pose
            assert posterior(np.array([start]))[0] == 0.0
            return start

    own = Believing()
    slam = MaximumLikelihood(true_start(episode), sensor_model=own, motion_model=own, search=own)
    poses = run(slam, episode).poses
    lost = run(DeadReckoning(true_start(episode)), episode).poses
    np.testing.assert_allclose(poses[:, :2], lost[:, :2], atol=1e-9)
    assert set(asked) == {"corrected", "deviations", "learn", "refresh", "likelihood", "search"}


class Noted(GaussianMotion):
    """Keeps what it is taught, and halves what the odometry says."""

    def __init__(self):
        super().__init__()
        object.__setattr__(self, "taught", [])

    def corrected(self, displacement):
        return Pose2(displacement.x / 2, displacement.y / 2, displacement.theta / 2)

    def learn(self, displacement, found, covariance):
        self.taught.append((displacement, found, covariance))  # pyright: ignore


def test_a_motion_model_is_taught_at_each_keyframe_but_the_first() -> None:
    poses = [Pose2(0.06 * k, 0.1, 0.02 * k) for k in range(9)]
    motion_model = Noted()
    slam = MaximumLikelihood(
        poses[0], motion_model=motion_model, keyframes=MotionThreshold(0.17, 9.0, 99.0)
    )
    keyframes = [slam.pose]
    for k, pose in enumerate(poses):
        told = poses[k - 1].between(pose) if k else Pose2()
        told = Pose2(2 * told.x, 2 * told.y, 2 * told.theta)
        estimate = slam.update(told, scan_at(pose))
        if k and k % 2 == 0:  # 24 cm are told at every second scan
            keyframes.append(estimate.pose)
    taught = motion_model.taught  # pyright: ignore
    assert len(taught) == 4
    for n, (told, found, covariance) in enumerate(taught):
        assert told.x == pytest.approx(0.24, abs=0.002)
        assert keyframes[n] @ found == pytest.approx(keyframes[n + 1])
        assert (np.sqrt(np.diag(covariance)) < (0.02, 0.02, 0.02)).all()
        assert np.linalg.eigvalsh(covariance).min() > 0
    assert slam.pose == pytest.approx(poses[-1], abs=0.01)


def test_between_matches_the_corrected_odometry_leads() -> None:
    never = MotionThreshold(math.inf, math.inf, math.inf)
    slam = MaximumLikelihood(motion_model=Noted(), matches=never, keyframes=never)
    slam.update(Pose2(), scan_at(Pose2()))
    assert slam.update(Pose2(0.2), scan_at(Pose2(0.1))).pose == pytest.approx((0.1, 0.0, 0.0))


def test_the_map_that_is_given_out_is_a_copy() -> None:
    slam = MaximumLikelihood()
    slam.update(Pose2(), scan_at(Pose2()))
    given = slam.map()
    before = given.occupied.copy()
    slam.update(Pose2(0.2), scan_at(Pose2(0.2)))
    np.testing.assert_array_equal(given.occupied, before)
    assert not np.array_equal(slam.map().occupied, before)


def test_doubt_after_a_match_is_the_matchs_and_the_odometrys() -> None:
    far, model = MotionThreshold(0.3, 9.0, 99.0), GaussianMotion()
    slam = MaximumLikelihood(motion_model=model, matches=far, keyframes=far)
    slam.update(Pose2(), scan_at(Pose2()))
    match = slam.update(Pose2(0.3), scan_at(Pose2(0.3)))
    after = slam.update(Pose2(0.2), scan_at(Pose2(0.5)))
    assert (match.matched, after.matched) == (True, False)
    assert match.covariance[0, 0] > 0
    way = after.pose.x - match.pose.x, after.pose.y - match.pose.y
    predicted = Prediction(match.pose, Pose2(0.2), model.deviations(Pose2(0.2)))
    added = odometry_covariance(*predicted.gaussian)
    np.testing.assert_allclose(after.covariance, carried(match.covariance, *way) + added)
    assert after.score == match.score < 0


def test_a_match_leaves_less_doubt_than_the_odometry_and_more_than_none() -> None:
    slam = MaximumLikelihood(motion_model=GaussianMotion())
    slam.update(Pose2(), scan_at(Pose2()))
    match = slam.update(Pose2(0.3), scan_at(Pose2(0.3)))
    assert match.matched
    doubt = np.sqrt(np.diag(match.covariance))
    assert (doubt < GaussianMotion().deviations(Pose2(0.3))).all()
    assert (doubt > 1e-4).all()
    blind = slam.update(Pose2(0.3), scan_at(Pose2(50.0)))
    assert (np.sqrt(np.diag(blind.covariance)) > doubt).all()


def test_what_is_remembered_is_what_later_scans_are_matched_with(episode) -> None:
    """As if it had been matched there; and the robot goes on from the last of it."""
    poses = [Pose2.of(pose) for pose in episode.truth.poses[:40:4]]
    robot, grid = MaximumLikelihood(), Static()
    scans = list(zip(episode.scans[:40:4], poses, strict=True))
    for known in (scans[:1], scans[1:4], [], scans[4:]):
        robot.remember(known, score=-0.9)
        for scan, pose in known:
            grid.integrate(scan, pose)
        assert robot.pose == robot.keyframe.pose
        assert (robot.keyframe.score, robot.keyframe.matched) == (-0.9, True)
    assert robot.pose == poses[-1]
    np.testing.assert_array_equal(robot.map().occupied, grid.cells.grid().occupied)
    standing = robot.update(Pose2(), episode.scans[36])
    assert (standing.pose, standing.score, standing.matched) == (poses[-1], -0.9, False)
    truth = Pose2.of(episode.truth.poses[40])
    off = poses[-1].between(truth) @ Pose2(0.03, -0.02, 0.05)
    estimate = robot.update(off, episode.scans[40])
    assert estimate.matched
    assert estimate.pose[:2] == pytest.approx(truth[:2], abs=0.01)
    assert estimate.pose.theta == pytest.approx(truth.theta, abs=0.01)
    assert np.linalg.eigvalsh(estimate.covariance).min() > 0


def whole_field(robot: MaximumLikelihood) -> np.ndarray:
    """The field of all cells of a robot's map, by a reading that is new to it."""
    reading = Endpoint()
    reading.refresh(robot.map_model, np.empty(0, np.int64))
    return reading.field().flat


def field_of(robot: MaximumLikelihood) -> np.ndarray:
    """The field that a robot matches in."""
    assert isinstance(robot.sensor_model, Endpoint)
    return robot.sensor_model.field().flat


def test_many_keyframes_are_remembered_in_the_field_too(episode) -> None:
    """More than fit in one list of changed cells: the field is that of the whole map."""
    poses = [Pose2(8.0 * k) for k in range(len(episode.scans))]  # each where no other one looks
    robot = MaximumLikelihood()
    assert len(poses) > 2 * AT_ONCE
    known = list(zip(episode.scans, poses, strict=True))
    robot.remember(known[:1])
    robot.remember(known[1:])
    np.testing.assert_array_equal(field_of(robot), whole_field(robot))


def test_the_sensor_model_is_that_of_the_last_keyframe() -> None:
    robot = MaximumLikelihood()
    for step in range(4):
        robot.update(Pose2(0.2 if step else 0.0), scan_at(Pose2(0.2 * step)))
        assert robot.keyframe.pose.x == pytest.approx(0.2 * step, abs=0.02)
        if step == 0:  # later ones leave small changes of cells out
            np.testing.assert_array_equal(field_of(robot), whole_field(robot))
    apart = np.abs(field_of(robot) - whole_field(robot))
    assert apart.max() < 0.1 < np.ptp(field_of(robot))


class Doubtful(Watch):
    """Withholds keyframes for a while."""

    doubts = True

    @property
    def withheld(self) -> bool:
        return self.doubts


def test_keyframes_that_were_withheld_are_all_read() -> None:
    watch = Doubtful()
    robot = MaximumLikelihood(watch=watch)
    robot.remember([(scan_at(Pose2()), Pose2())])
    for step in range(1, 5):
        watch.doubts = step < 4
        robot.update(Pose2(0.2), scan_at(Pose2(0.2 * step)))
    apart = np.abs(field_of(robot) - whole_field(robot))
    assert apart.max() < 0.1 < np.ptp(field_of(robot))


@pytest.mark.parametrize("copied", [False, True])
@pytest.mark.parametrize("last", ["freeze", "remember"])
def test_what_follows_a_keyframe_finds_its_surfaces(last: str, copied: bool) -> None:
    """As if a match had read the map between them."""

    def driven(read: bool) -> tuple[Pose2, bytes]:
        robot = MaximumLikelihood()
        robot.update(Pose2(), scan_at(Pose2()))
        if read:
            assert isinstance(robot.sensor_model, Endpoint)
        robot = copy.deepcopy(robot) if copied else robot
        if last == "freeze":
            robot.freeze()
        else:
            turned = (Pose2(0.1 * k, 0.013 * k, 0.007 * k) for k in range(1, 4))
            robot.remember([(scan_at(pose), pose @ Pose2(0.003, 0.002, 0.001)) for pose in turned])
        pose = robot.update(Pose2(0.23, 0.02, 0.01), scan_at(Pose2(0.2))).pose
        assert robot._surfaces is not None
        return pose, robot._surfaces.table.tobytes()

    assert driven(read=True) == driven(read=False)


def test_one_that_is_dropped_frees_its_map_at_once(episode):
    """Without a wait for the search for cycles of objects."""
    slam = MaximumLikelihood(true_start(episode))
    run(slam, episode)
    freed = weakref.ref(slam.map_model)
    gc.disable()
    try:
        del slam
        assert freed() is None
    finally:
        gc.enable()
