# pyright: reportMissingImports=false
import numpy as np
import pytest
from dynslam_cli.speed import slam_update as speed_slam
from dynslam_cli.speed.memory import MapMemory, map_memory, map_of, memory_rows, to_and_fro
from dynslam_cli.speed.slam_update import Cost, Stopwatch, cost, second_half, slam_rows

import slam
from agents import record_corridor
from slam import registry
from slam.algorithms.variants import maximum_likelihood
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.geometry import Pose2
from slam.maps.static import Static
from slam.maps.tiles import AREA
from slam.search.registration import Registration
from tests.scripts.figures.test_figures import first_scans


@pytest.fixture(scope="module")
def episode():
    return first_scans(record_corridor(1, "moving"), 40)


@pytest.fixture
def known(monkeypatch):
    """Variants that are registered here are forgotten again."""
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))


class Clock:
    """The processor's time: a millisecond goes by whenever it is read, and what a test spends."""

    def __init__(self):
        self.now = 0.0

    def spend(self, seconds):
        self.now += seconds

    def process_time(self):
        self.spend(0.001)
        return self.now


CLOCK = Clock()


@pytest.fixture
def ticking(monkeypatch):
    monkeypatch.setattr(speed_slam, "time", CLOCK)


def untracked(items, description):
    return items


def test_a_cost_by_hand():
    one = Cost(np.array([0.001, 0.002, 0.003, 0.006]), np.array([1, 0, 1, 1], dtype=bool), 0.003)
    assert one.ms == pytest.approx(4.0)
    assert one.halves == pytest.approx((3.0, 4.5))
    unmatched = one._replace(matched=np.zeros(4, dtype=bool))
    assert unmatched.ms == pytest.approx(3.0)


def test_a_stopwatch_adds_up_what_calls_take_and_nothing_between(ticking):
    stopwatch = Stopwatch()
    stopwatch.around(CLOCK.spend)(0.25)
    CLOCK.spend(8.0)
    assert stopwatch.around(sum)([1, 2]) == 3
    stopwatch.around(CLOCK.spend)(0.5)
    assert stopwatch.seconds == pytest.approx(0.75 + 3 * 0.001)


def test_a_stopwatch_changes_nothing_of_the_run(episode):
    plain = run(slam.make("dynamic-ml", true_start(episode)), episode)
    robot = slam.make("dynamic-ml", true_start(episode))
    found = cost(robot, episode)
    assert robot.pose == Pose2.of(plain.poses[-1])
    np.testing.assert_array_equal(robot.map().occupied, plain.grid.occupied)
    assert found.matched.sum() == plain.matched
    assert 0 < found.mapping < found.seconds.sum()
    assert 0 < found.registering < found.seconds.sum() - found.mapping


@pytest.mark.parametrize("variant", ["static-graph", "static-ml/no-registration"])
def test_the_registration_is_a_part_of_the_cost_where_there_is_one(episode, variant):
    untimed = Registration.__call__
    found = cost(slam.make(variant, true_start(episode)), episode)
    assert (found.registering > 0) == (variant == "static-graph")
    assert Registration.__call__ is untimed


class Slow(Static):
    """Takes its time in the map, and holds more than its tiles."""

    def integrate(self, scan, pose):
        CLOCK.spend(0.003)
        return super().integrate(scan, pose)

    @property
    def nbytes(self):
        return self.cells.tiles.nbytes + 1_000_000


def test_what_costs_more_is_told_as_such(episode, known, ticking):
    slam.register("slow-ml", maximum_likelihood(Slow))
    rows = slam_rows(["odometry", "slow-ml", "static-ml"], episode, "here", 2, untracked)
    odometry, slow, static = rows
    assert [row["what"] for row in rows] == ["odometry", "slow-ml", "static-ml"]
    assert static["ratio"] == 1.0
    assert slow["ratio"] > 1.2
    assert slow["cpu_ms"] > static["cpu_ms"] > odometry["cpu_ms"] > 0
    assert 1 > slow["map_share"] > static["map_share"] > 0
    assert slow["matched"] == static["matched"] > 20 > odometry["matched"] == 0
    assert slow["bytes"] == static["bytes"] + 1_000_000
    assert odometry["bytes"] is odometry["map_share"] is odometry["registration_share"] is None
    assert 1 > static["registration_share"] > slow["registration_share"] > 0


def test_variants_take_turns(episode, monkeypatch):
    made = []
    monkeypatch.setattr(
        speed_slam, "cost", lambda robot, e: Cost(np.ones(2), np.ones(2, dtype=bool), 0.5)
    )
    monkeypatch.setattr(slam, "make", lambda name, *_: made.append(name) or Static())
    monkeypatch.setattr(speed_slam, "warm_up", lambda *_: None)
    slam_rows(["dynamic-ml"], episode, "here", 2, untracked)
    assert made == ["static-ml", "static-ml", "dynamic-ml", "dynamic-ml"] * 2


def test_the_fastest_round_and_the_median_ratio_count(episode, monkeypatch):
    rounds = [(2, 2), (1, 1), (4, 8), (6, 6),  # static-ml and dynamic-ml, by turns, each whole
              (3, 3), (1, 1), (3, 3), (6, 6),  # and its second half alone
              (1, 1), (1, 1), (6, 6), (2, 2)]  # fmt: skip
    seconds = iter(rounds)
    monkeypatch.setattr(
        speed_slam,
        "cost",
        lambda robot, e: Cost(np.array(next(seconds), float), np.ones(2, dtype=bool), 0.0),
    )
    (row,) = slam_rows(["dynamic-ml"], episode, "here", 3, untracked)
    assert row["cpu_ms"] == 3000.0
    assert row["ratio"] == 3.0  # of 3, 1 and 6
    assert row["second_half"] == 1.0  # of 2, 1 and 1
    assert row["second_half_grown"] == pytest.approx(8 / 6)  # of 8/6, 3/6 and 6/2


def test_the_second_half_is_an_episode_of_its_own(episode):
    latter = second_half(episode)
    assert latter.scans == episode.scans[20:]
    assert true_start(latter) == Pose2.of(episode.truth.poses[20])
    np.testing.assert_allclose(latter.displacements()[1:], episode.displacements()[21:], atol=1e-12)
    bare = second_half(Episode(episode.scans, episode.odometry))
    assert bare.truth is None
    assert len(bare.scans) == 20


class Growing(Static):
    """The more scans it holds, the longer it takes."""

    scans = 0

    def integrate(self, scan, pose):
        self.scans += 1
        CLOCK.spend(0.002 * self.scans)
        return super().integrate(scan, pose)


def test_a_cost_that_grows_with_the_map_is_told_from_one_that_does_not(episode, known, ticking):
    slam.register("growing-ml", maximum_likelihood(Growing))
    constant, growing = slam_rows(["static-ml", "growing-ml"], episode, "here", 2, untracked)
    assert growing["second_half_grown"] > 1.3 > constant["second_half_grown"]


def test_what_a_map_holds_is_that_of_its_tiles(episode):
    robot = slam.make("static-ml", true_start(episode))
    result = run(robot, episode)
    grid = map_of(robot)
    assert grid is not None
    tiles = grid.cells.tiles
    expected = MapMemory(tiles.nbytes, int(result.grid.observed.sum()), AREA * (tiles.used - 1))
    assert map_memory(grid) == expected
    assert map_of(slam.make("odometry")) is None


class TestToAndFro:
    def test_is_one_drive_without_a_leap(self, episode):
        long, truth = to_and_fro(episode, 3), episode.truth
        assert long.truth is not None
        n = len(episode.scans)
        assert len(long.scans) == 3 * n - 2
        assert np.diff(long.times) == pytest.approx(np.full(3 * n - 3, 0.1))
        there = long.odometry.at(long.times)
        assert there[n - 1] == pytest.approx(episode.odometry.at(episode.times)[-1])
        assert there[2 * n - 2] == pytest.approx(there[0])
        for k in (0, 5, n - 1):
            for at in (k, 2 * n - 2 - k, 2 * n - 2 + k):
                assert long.scans[at].ranges is episode.scans[k].ranges
                np.testing.assert_array_equal(long.truth.poses[at], truth.poses[k])
                np.testing.assert_array_equal(long.truth.doors[at], truth.doors[k])

    def test_is_driven_as_well_as_the_drive_itself(self, episode):
        long = to_and_fro(episode, 4)
        assert long.truth is not None
        poses = run(slam.make("dynamic-ml", true_start(long)), long).poses
        off = np.hypot(*(poses - long.truth.poses)[:, :2].T)
        assert off.max() < 0.1


class Hoarder(Static):
    """Remembers every scan."""

    scans = 0

    def integrate(self, scan, pose):
        self.scans += 1
        return super().integrate(scan, pose)

    @property
    def nbytes(self):
        return self.cells.tiles.nbytes + 10_000 * self.scans


def test_memory_that_grows_with_time_is_seen_beside_memory_that_does_not(episode, known):
    slam.register("hoarder-ml", maximum_likelihood(Hoarder))
    rows = memory_rows(["odometry", "dynamic-ml", "hoarder-ml"], episode, untracked)
    constant, growing = rows
    assert (constant["what"], growing["what"]) == ("dynamic-ml", "hoarder-ml")
    assert constant["bytes"][0] == constant["bytes"][-1]
    added = np.diff(growing["bytes"])
    assert len(added) == 3
    assert (added >= 10 * 10_000).all()
    assert constant["seconds"] == pytest.approx(4 * 39 * 0.1)
