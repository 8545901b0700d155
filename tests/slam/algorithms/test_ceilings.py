"""Two ceilings: perfect poses, and a perfect map."""

import itertools
import json
import math

import numpy as np
import pytest

import slam
from slam.algorithms.ceilings import CEILINGS, LocalizationOnly, MappingOnly
from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.configuration import configuration
from slam.benchmark.run import build, run, true_start, warm_up
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2, between, wrap_angle
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.maps.true_map import TrueMap
from slam.metrics.cramer_rao import bound, information, ray_gradient
from slam.metrics.episode_scorer import EpisodeScorer
from slam.motion.threshold import MotionThreshold
from slam.trajectory import Trajectory
from tests.slam.worlds import FAN, ROOM, drive, loop, scan_at

ALWAYS = MotionThreshold(0.0, 0.0, 0.0)
SIGMA = 0.005  # m, of the ranges of `drive`


@pytest.fixture(scope="module")
def episode() -> Episode:
    return drive()


def truth_of(episode: Episode) -> Truth:
    assert episode.truth is not None
    return episode.truth


def doors_episode(n=60) -> Episode:
    """Half a lap of the room, in which two doors, each a wall of its own, come and go."""
    poses, times = loop(2 * n)[:n], np.arange(n) / 10
    away, there = (9.0, 9.0, 9.5, 9.0), (-1.3, -0.6, -1.3, 0.4)
    doors = np.array([[there if k // 10 % 2 else away, (1.0, 1.2, 1.6 + k / 100, 1.2)]
                      for k in range(n)])  # fmt: skip
    rng = np.random.default_rng(0)
    scans = [scan_at(Pose2.of(p), t, walls=np.concatenate([ROOM, d]), rng=rng)
             for p, t, d in zip(poses, times, doors, strict=True)]  # fmt: skip
    odometry = between(poses[:1], poses) + np.cumsum(rng.normal(0, 1e-3, (n, 3)), axis=0)
    return Episode(tuple(scans), Trajectory(times, odometry), Truth(poses, ROOM, doors))


# -- mapping only ------------------------------------------------------------------------------


@pytest.mark.parametrize("grid", [Static, Histogram])
def test_poses_are_true_whatever_the_odometry_says(grid, episode) -> None:
    done = run(MappingOnly(truth_of(episode), grid()), episode)
    np.testing.assert_array_equal(done.poses, truth_of(episode).poses)
    assert done.matched == 0


def test_the_map_holds_the_scans_where_they_were_taken(episode) -> None:
    truth, grid = truth_of(episode), Static()
    slam_ = MappingOnly(truth, Static(), keyframes=ALWAYS)
    for scan, pose in zip(episode.scans[:5], truth.poses, strict=False):
        slam_.update(Pose2(9.0), scan)
        grid.integrate(scan, Pose2.of(pose))
    np.testing.assert_array_equal(slam_.map().occupied, grid.cells.grid().occupied)


def test_scans_are_mapped_at_keyframes_of_the_true_way() -> None:
    poses = np.array([[0.04 * k, 0.0, 0.0] for k in range(9)])
    mapped = []

    class Noting(Static):
        def integrate(self, scan, pose):
            mapped.append(pose.x)
            return super().integrate(scan, pose)

    truth = Truth(poses, ROOM, np.zeros((9, 0, 4)))
    slam_ = MappingOnly(truth, Noting(), MotionThreshold(0.1, 9.0, 99.0))
    for pose in poses:
        slam_.update(Pose2(), scan_at(Pose2.of(pose)))
    np.testing.assert_allclose(mapped, [0.0, 0.12, 0.24])


def test_no_variant_maps_better_than_with_true_poses() -> None:
    episode = drive(100)
    judge = EpisodeScorer(episode)
    ceiling = run(build("mapping-only", episode), episode)
    known = run(build("localization-only", episode), episode)
    assert judge.scores(known.poses, known.grid)["f1_5cm"] > 0.99  # pyright: ignore
    found = run(build("dynamic-ml", episode), episode)
    lost = run(build("odometry", episode), episode)
    scores = [judge.scores(done.poses, done.grid) for done in (ceiling, found, lost)]
    assert scores[0]["ate"] == 0.0
    f1 = [score["f1_5cm"] for score in scores]
    assert f1[0] > 0.95  # pyright: ignore
    assert f1[0] >= f1[1] - 0.02  # pyright: ignore
    assert f1[0] > f1[2] + 0.3  # pyright: ignore


# -- localization only -------------------------------------------------------------------------


def limit_of(episode: Episode) -> np.ndarray:
    """(3,) RMS of the Cramer-Rao bounds of each scan by itself, in m, m, rad."""
    truth, squares = truth_of(episode), []
    for pose, scan in zip(truth.poses[::10], episode.scans[::10], strict=True):
        ranges, normals = exact(Pose2.of(pose), scan.angles)
        found = bound(
            information(ray_gradient(Pose2.of(pose), scan.angles, ranges, normals), SIGMA)
        )
        squares.append([found.std_x**2, found.std_y**2, found.std_theta**2])
    return np.sqrt(np.mean(squares, axis=0))


def exact(pose: Pose2, angles) -> tuple[np.ndarray, np.ndarray]:
    """Ranges and normals: the wall whose removal changes a beam's range is the one that is hit."""
    ranges = scan_at(pose, angles=angles).ranges
    normals = np.zeros((len(angles), 2))
    for k, (x1, y1, x2, y2) in enumerate(ROOM):
        without = scan_at(pose, angles=angles, walls=np.delete(ROOM, k, axis=0)).ranges
        normals[without > ranges] = np.array([y1 - y2, x2 - x1]) / math.hypot(x2 - x1, y2 - y1)
    return ranges, normals


def test_in_the_true_map_errors_come_near_the_bound(episode) -> None:
    done = run(build("localization-only", episode), episode)
    errors = done.poses - truth_of(episode).poses
    errors[:, 2] = wrap_angle(errors[:, 2])
    rms = np.sqrt((errors**2).mean(axis=0))
    limit = limit_of(episode)
    assert (limit < (0.0015, 0.0015, math.radians(0.06))).all()
    assert (rms < (0.01, 0.01, math.radians(0.25))).all()
    assert (rms > 0.7 * limit).all()
    assert done.matched > 50


def test_localization_alone_is_better_than_both_together(episode) -> None:
    truth = truth_of(episode).poses

    def error(variant: str) -> float:
        poses = run(build(variant, episode), episode).poses
        return float(np.sqrt(((poses - truth)[:, :2] ** 2).sum(axis=1).mean()))

    assert error("localization-only") < error("static-ml") < error("odometry")


def test_a_robot_among_moving_doors_knows_where_they_are() -> None:
    episode = doors_episode()
    done = run(build("localization-only", episode), episode)
    apart = done.poses - truth_of(episode).poses
    assert np.hypot(*apart[:, :2].T).max() < 0.03


def test_the_map_is_the_truth_at_every_scan() -> None:
    episode = doors_episode()
    robot = build("localization-only", episode)
    there = []
    for displacement, scan in zip(episode.displacements(), episode.scans, strict=True):
        robot.update(displacement, scan)
        grid = robot.map()
        row, col = grid.spec.cells(np.array([[-1.3, -0.1]]))[0]
        there.append(float(grid.occupied[row, col]))
    expected = [k // 10 % 2 for k in range(len(there))]
    np.testing.assert_allclose(there, expected, atol=0.02)


def test_nothing_is_learned_from_a_scan() -> None:
    truth = Truth(np.zeros((3, 3)), ROOM, np.zeros((3, 0, 4)))
    robot = CEILINGS["localization-only"](truth, np.random.default_rng(0))
    robot.update(Pose2(), scan_at(Pose2(), 0.0))
    before = robot.map()
    robot.update(Pose2(0.5), scan_at(Pose2(-0.5, 0.3, 1.0), 5.0))
    np.testing.assert_array_equal(robot.map().occupied, before.occupied)
    assert robot.pose.x != 0.0


def test_a_matcher_on_any_other_map_is_refused() -> None:
    with pytest.raises(InputError, match="TrueMap"):
        LocalizationOnly(MaximumLikelihood())


# -- the true map ------------------------------------------------------------------------------


def standing(truth: Truth, resolution=0.05) -> TrueMap:
    grid = TrueMap(truth, resolution)
    grid.advance()
    return grid


def points_of(grid: TrueMap) -> np.ndarray:
    """(n, 2) where the map says that walls are, m."""
    layer = grid.cells.grid()
    offsets, counts = grid.cells.centroids.dense()
    cells = np.argwhere(counts > 0)
    assert (layer.occupied[counts > 0] == 1.0).all()
    assert (layer.occupied[counts == 0] < 0.02).all()
    return layer.spec.centres(cells) + offsets[counts > 0]


def off_walls(points, walls) -> np.ndarray:
    """(n,) m, from each point to the nearest wall, by many samples of it."""
    samples = np.concatenate([np.linspace(w[:2], w[2:], 2000) for w in np.asarray(walls)])
    return np.array([np.hypot(*(samples - point).T).min() for point in points])


def scene(walls, doors=None, n=1) -> Truth:
    doors = np.zeros((n, 0, 4)) if doors is None else np.asarray(doors, dtype=float)
    return Truth(np.zeros((len(doors), 3)), np.asarray(walls, dtype=float).reshape(-1, 4), doors)


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
def test_centroids_lie_on_the_walls(turn: float) -> None:
    c, s = math.cos(turn), math.sin(turn)
    walls = [(0.013, 0.021, 2.0 * c, 2.0 * s)]
    points = points_of(standing(scene(walls)))
    assert off_walls(points, walls).max() < 0.001
    reached = np.linalg.norm(points, axis=1)
    assert reached.min() < 0.05
    assert reached.max() > 1.95
    gaps = np.diff(np.sort(reached))
    assert gaps.max() < 0.08


def test_the_room_is_closed() -> None:
    points = points_of(standing(scene(ROOM)))
    corners = ROOM[:, :2]
    for corner in corners:
        assert np.hypot(*(points - corner).T).min() < 0.04
    length = np.hypot(ROOM[:, 2] - ROOM[:, 0], ROOM[:, 3] - ROOM[:, 1]).sum()
    assert len(points) == pytest.approx(length / 0.05, rel=0.03)


def test_only_what_changed_is_told_and_doors_leave_no_trace() -> None:
    wall, door = (0.0, 0.0, 2.0, 0.0), (1.0, -0.5, 1.0, 0.5)
    turned, gone = (1.5, -0.5, 1.5, 0.5), (1.0, 9.0, 1.5, 9.0)
    truth = scene([wall], [[door], [door], [turned], [gone], [door]])
    grid = TrueMap(truth)
    told = [grid.advance() for _ in range(2)]
    assert len(told[0]) > 50
    assert len(told[1]) == 0
    first = grid.cells.grid().occupied
    told.append(grid.advance())
    off = np.sort(off_walls(points_of(grid), [wall, turned]))
    assert off[-2] < 0.001
    assert off[-1] < 0.02  # where they cross
    told.append(grid.advance())
    np.testing.assert_allclose(off_walls(points_of(grid), [wall, gone]), 0, atol=0.001)
    told.append(grid.advance())
    np.testing.assert_array_equal(grid.cells.grid().occupied, first)
    changed = grid.cells.occupied.flat
    for ids in told:
        assert len(ids) == len(np.unique(ids))
        assert (ids >= 0).all()
        assert (ids < len(changed)).all()


def test_a_change_that_is_told_is_all_that_changed() -> None:
    episode = doors_episode(30)
    grid = TrueMap(truth_of(episode))
    cells = grid.cells
    grid.advance()
    for _ in range(29):
        before = [layer.copy() for layer in (cells.occupied.flat, cells.centroids.offset.flat,
                                             cells.centroids.count.flat)]  # fmt: skip
        told = np.zeros(len(before[0]), bool)
        told[grid.advance()] = True
        after = cells.occupied.flat, cells.centroids.offset.flat, cells.centroids.count.flat
        for old, new in zip(before, after, strict=True):
            np.testing.assert_array_equal(old[~told], new[~told])


def test_where_a_door_passes_a_wall_both_count() -> None:
    wall, door = (0.0, 0.01, 0.04, 0.01), (0.0, 0.03, 0.04, 0.03)  # in one cell
    points = points_of(standing(scene([wall], [[door]])))
    np.testing.assert_allclose(points, [[0.02, 0.02]], atol=0.001)


@pytest.mark.parametrize("walls", [[], [(0.0, 0.0, 0.0, 0.0)]])
def test_a_world_without_walls_is_free(walls) -> None:
    grid = standing(scene(walls))
    assert (grid.cells.grid().occupied < 0.02).all()


def test_after_the_last_scan_nothing_is_known() -> None:
    truth = scene(ROOM, n=2)
    for robot in (build_on(truth, "mapping-only"), build_on(truth, "localization-only")):
        for k in range(2):
            robot.update(Pose2(), scan_at(Pose2(), k))
        with pytest.raises(InputError, match="known of 2 scans"):
            robot.update(Pose2(), scan_at(Pose2(), 2))


def build_on(truth: Truth, name: str):
    return CEILINGS[name](truth, np.random.default_rng(0))


# -- by name -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CEILINGS)
def test_a_ceiling_is_built_by_name_for_an_episode(name: str, episode) -> None:
    short = Episode(episode.scans[:9], episode.odometry,
                    Truth(truth_of(episode).poses[:9], ROOM, np.zeros((9, 0, 4))))  # fmt: skip
    one, same = (run(build(name, short, 4), short) for _ in range(2))
    assert one.poses.tobytes() == same.poses.tobytes()
    assert one.poses.shape == (9, 3)
    assert build(name, short).pose == true_start(short)
    warm_up(name, short)
    json.dumps(configuration(build(name, short)), allow_nan=False)


@pytest.mark.parametrize("name", CEILINGS)
def test_without_the_truth_there_is_no_ceiling(name: str, episode) -> None:
    blind = Episode(episode.scans, episode.odometry)
    with pytest.raises(InputError, match=f"'{name}' needs an episode that holds the truth"):
        build(name, blind)
    with pytest.raises(InputError, match=f"'{name}' is shown the truth.*build"):
        slam.make(name)


def test_any_other_name_is_a_variant(episode) -> None:
    blind = Episode(episode.scans, episode.odometry)
    assert isinstance(build("odometry", blind), DeadReckoning)
    assert build("static-ml", blind).pose == Pose2()
    assert build("static-ml", episode).pose == true_start(episode) != Pose2()
    with pytest.raises(InputError, match="known: "):
        build("nonesuch", episode)


def test_the_seed_is_handed_down(episode) -> None:
    for robot in (lambda s: build("static-ml", episode, s),
                  lambda s: build("localization-only", episode, s).matcher):  # fmt: skip # pyright: ignore
        drawn = [robot(seed).rng.random() for seed in (3, 3, 4)]  # pyright: ignore
        assert drawn[0] == drawn[1] != drawn[2]


def test_the_names_are_taken_and_no_variants() -> None:
    for name in CEILINGS:
        assert name not in slam.variants()
        with pytest.raises(InputError, match="dynslam's own"):
            slam.register(name, lambda start, rng: DeadReckoning(start))


def test_every_beam_of_the_bound_hits_one_wall() -> None:
    for pose in itertools.islice(loop(20), 0, None, 5):
        ranges, normals = exact(Pose2.of(pose), FAN)
        hit = np.isfinite(ranges)
        np.testing.assert_allclose(np.hypot(*normals[hit].T), 1.0)
