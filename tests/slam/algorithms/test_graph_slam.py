"""Graph SLAM around a block: it closes the loop, and whatever else is asked changes nothing."""

import math
import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slam.algorithms import graph_slam
from slam.algorithms.graph_slam import MIN_KEYFRAMES, GraphSlam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.graph import pose_graph
from slam.graph.alignment import ALIGNED
from slam.graph.chain import MIN_WEIGHT
from slam.graph.edges import Edge
from slam.graph.local_map import LocalMap
from slam.graph.loops import Loops
from slam.interface import Revising
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.beam import Beam
from slam.sessions.session import session_of
from tests.slam import naive
from tests.slam.graph.graphs import error
from tests.slam.graph.test_chain import along
from tests.slam.rings import ANGLES, WALLS, drive, off
from tests.slam.worlds import FAN, scan_at

NONE = Loops(explained=2.0)  # more than all: no loop is believed


def driven() -> Episode:
    return drive(2.0, reach=3.0)


def paired(episode: Episode):
    return zip(episode.displacements(), episode.scans, strict=True)


@cache
def finished():
    """A SLAM at the end of the drive, its estimates, and the trajectory after each of them."""
    robot, estimates, trajectories = GraphSlam(), [], []
    for displacement, scan in paired(driven()):
        estimates.append(robot.update(displacement, scan))
        trajectories.append(robot.trajectory())
    robot.finish()
    return robot, estimates, trajectories


def state(robot: GraphSlam) -> list[bytes]:
    grid = robot.map()
    return [
        robot.trajectory().tobytes(), robot.graph.poses.tobytes(), np.array(robot.pose).tobytes(),
        robot.graph.trust().tobytes(), grid.occupied.tobytes(), grid.observed.tobytes(),
    ]  # fmt: skip


# -- loops -------------------------------------------------------------------------------------


def test_loops_are_closed() -> None:
    robot, estimates, _ = finished()
    online = [estimate.pose for estimate in estimates]
    believed = [edge for edge, trust in zip(robot.graph.edges, robot.graph.trust(), strict=True)
                if edge.loop and trust > 0.5]  # fmt: skip
    assert len(believed) >= 3
    assert sum(estimate.revised for estimate in estimates) >= 2
    without = run(MaximumLikelihood(), driven())
    found = off(robot.trajectory(), driven())
    assert found.max() < 0.6
    assert found.max() < 0.5 * off(without.poses, driven()).max()
    assert found.max() < 0.5 * off(online, driven()).max()
    assert found.max() < 0.1 * off(driven().odometry.poses, driven()).max()


def test_the_keyframes_are_aligned_at_the_end() -> None:
    episode = drive(2.0, reach=6.0, seed=3)
    before, after = (run(GraphSlam(alignment=given), episode) for given in (None, ALIGNED))
    np.testing.assert_array_equal(before.online, after.online)
    off_before, off_after = off(before.poses, episode), off(after.poses, episode)
    assert np.sqrt((off_after**2).mean()) < 0.6 * np.sqrt((off_before**2).mean())


def test_a_second_call_of_finish_changes_nothing_and_the_graph_agrees_with_it() -> None:
    robot, *_ = finished()
    before = state(robot)
    robot.finish()
    assert state(robot) == before
    trusted = robot.graph.trust() > MIN_WEIGHT
    assert trusted.any()
    np.testing.assert_allclose(robot.graph.edges.errors(robot.graph.poses)[trusted], 0, atol=1e-9)
    for place in robot.places:
        assert tuple(place.keyframes[0].pose) == pytest.approx((0, 0, 0), abs=1e-12)
    last = robot.places[-1].keyframes[-1].pose
    np.testing.assert_allclose(Pose2.of(robot.graph.poses[-1]) @ last, robot.pose, atol=1e-6)


def test_a_lost_robot_is_searched_for_in_the_whole_map() -> None:
    robot, *_ = finished()
    assert robot._front is not None
    endpoint, frame = robot._front._surroundings()
    assert tuple(frame) == tuple(robot.graph.poses[-1])
    own = robot._front.map_model.cells.tiles
    assert endpoint.tiles is not own
    assert endpoint.tiles.used > own.used


def test_where_none_is_believed_there_are_none() -> None:
    done = run(robot := GraphSlam(loops=NONE, alignment=None), driven())
    assert not any(edge.loop for edge in robot.graph.edges)
    np.testing.assert_allclose(done.poses, done.online, atol=1e-9)
    assert len(robot.places) == len(robot.graph.poses) == len(robot.graph.edges) + 1 > 5
    assert len(run(robot := GraphSlam(candidates=0), driven()).poses)
    assert not any(edge.loop for edge in robot.graph.edges)


def test_a_loop_joins_stretches_that_are_not_neighbours() -> None:
    for edge in finished()[0].graph.edges:
        assert edge.second > edge.first + 1 if edge.loop else edge.second == edge.first + 1


def test_what_was_added_while_poses_were_looked_for_moves_with_the_last_of_them(
    monkeypatch,
) -> None:
    monkeypatch.setattr(pose_graph, "MAX_GROWTH", 0.0)  # all poses are looked for, which takes long
    robot, began, later = GraphSlam(stretch=1.0), 0, 0
    adjusting = robot.graph.adjusting

    def noting():
        nonlocal began
        began = len(robot.graph.poses)
        yield from adjusting()

    robot.graph.adjusting = noting
    for given in paired(driven()):
        revised = robot.update(*given).revised
        if revised and len(robot.graph.poses) > began:
            last = [edge for edge in robot.graph.edges if not edge.loop][-1]
            assert last.second == len(robot.graph.poses) - 1
            np.testing.assert_allclose(error(last, robot.graph.poses), 0.0, atol=1e-9)
            later += 1
    assert later >= 1


def test_a_match_is_looked_for_as_far_as_the_chain_leaves_in_doubt() -> None:
    """The covariance of where the panorama is predicted, along the axes of the other stretch."""
    robot, asked = GraphSlam(loops=NONE, alignment=None), []
    match = robot._matcher.match

    def noting(place, scan, predicted, covariance):
        asked.append((robot.places.index(place), predicted, covariance))
        return match(place, scan, predicted, covariance)

    robot._matcher.match = noting  # pyright: ignore
    for given in paired(driven()):
        robot.update(*given)
    robot.finish()
    assert len(asked) > 5
    for other, predicted, covariance in asked:
        frame = Pose2.of(robot.graph.poses[other])
        off = [
            tuple(frame.between(Pose2.of(pose)).between(predicted)) for pose in robot.graph.poses
        ]
        here = int(np.abs(off).sum(axis=1).argmin())
        assert here > other + 1
        assert tuple(off[here]) == pytest.approx((0, 0, 0), abs=1e-9)
        own = along([(edge, True) for edge in list(robot.graph.edges)[other:here]])
        c, s = math.cos(predicted.theta), math.sin(predicted.theta)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(covariance, turn @ own @ turn.T, rtol=1e-3, atol=1e-7)


def test_stretches_are_as_long_as_asked_and_begin_with_seeds() -> None:
    robot = GraphSlam(stretch=2.0, seeds=4, loops=NONE)
    run(robot, drive(1.0, reach=3.0))
    *all_but_last, last = robot.places
    assert len(all_but_last) >= 8
    assert all(2.0 <= place.length < 2.3 for place in all_but_last)
    assert last.length < 2.3


def test_a_stretch_begins_with_the_last_keyframes_before_it() -> None:
    robot, begun = GraphSlam(stretch=2.0, seeds=4, loops=NONE), []
    for given in paired(drive(1.0, reach=3.0)):
        robot.update(*given)
        if len(robot.places) > len(begun):
            begun.append([one.scan.time for one in robot.places[-1].seeds])
    own = [[one.scan.time for one in place.keyframes] for place in robot.places]
    assert begun == [[], *(times[-4:] for times in own[:-1])]


def test_what_a_finished_stretch_no_longer_needs_is_dropped() -> None:
    robot, _, _ = finished()
    *closed, last = robot.places
    assert len(closed) > 5
    assert last.seeds
    assert not any(place.seeds for place in closed)
    for place in closed:
        assert all("points" not in vars(one.scan) for one in place.keyframes)


def test_any_reading_closes_loops() -> None:
    """The one of the front has no field to be searched in."""
    robot = GraphSlam(sensor_model=Beam)
    done = run(robot, drive(1.3, reach=6.0))
    assert any(edge.loop for edge in robot.graph.edges)
    assert off(done.poses, drive(1.3, reach=6.0)).max() < 0.3


# -- what is said, and what is believed later --------------------------------------------------


def test_the_trajectory_ends_where_the_robot_is() -> None:
    robot, estimates, trajectories = finished()
    for k, (estimate, trajectory) in enumerate(zip(estimates, trajectories, strict=True)):
        assert trajectory.shape == (k + 1, 3)
        assert trajectory[-1] == pytest.approx(np.array(estimate.pose), abs=1e-9)
    assert robot.trajectory()[-1] == pytest.approx(np.array(robot.pose), abs=1e-9)


def test_what_was_put_off_till_the_end_moves_the_robot_too() -> None:
    robot, episode = GraphSlam(), drive(2.0, reach=2.4)
    last = [robot.update(*given).pose for given in paired(episode)][-1]
    robot.finish()
    assert tuple(robot.pose) == pytest.approx(robot.trajectory()[-1], abs=1e-9)
    assert math.dist(robot.pose[:2], last[:2]) > 0.1


def test_it_says_so_when_it_revises() -> None:
    _, estimates, trajectories = finished()
    for k in range(1, len(estimates)):
        same = np.abs(trajectories[k][:-1] - trajectories[k - 1]).max() < 1e-12
        assert estimates[k].revised != same
    assert not estimates[0].revised


def test_estimates_are_sane() -> None:
    _, estimates, _ = finished()
    for estimate in estimates:
        assert np.isfinite([*estimate.pose, estimate.score]).all()
        assert abs(estimate.pose.theta) <= math.pi
        np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-12


def test_a_stretch_begins_with_the_score_of_its_match() -> None:
    robot, matched = GraphSlam(loops=NONE), []
    for displacement, scan in paired(driven()):
        stretches = len(robot.places)
        estimate = robot.update(displacement, scan)
        if 0 < stretches < len(robot.places):
            matched.append(estimate.score)
            assert robot.update(Pose2(), scan).score == estimate.score  # which stood still
    assert len(matched) > 5
    assert all(score < 0.0 for score in matched)


def test_it_becomes_less_sure_along_the_way_and_surer_with_a_loop() -> None:
    _, estimates, _ = finished()
    spread = [math.sqrt(np.trace(estimate.covariance[:2, :2])) for estimate in estimates]
    assert spread[200] > 1.5 * spread[60] > 0
    revised = [k for k, estimate in enumerate(estimates) if estimate.revised]
    assert any(spread[k] < 0.8 * spread[k - 1] for k in revised)


def test_the_errors_are_as_large_as_it_says() -> None:
    """Within a few standard deviations, most of the time."""
    _, estimates, _ = finished()
    truth = driven().truth
    assert truth is not None
    within = []
    for estimate, pose in zip(estimates[20:], truth.poses[20:], strict=True):
        error = np.array(estimate.pose)[:2] - pose[:2]
        scaled = error @ np.linalg.solve(estimate.covariance[:2, :2], error)
        within.append(scaled < 4.0**2)
    assert np.mean(within) > 0.55


# -- the same, whatever is asked in between ----------------------------------------------------


def asked(program, **parts) -> GraphSlam:
    robot = GraphSlam(**parts)
    for k, (displacement, scan) in enumerate(paired(driven())):
        robot.update(displacement, scan)
        if k % program[0] == program[0] - 1:
            robot.map()
        if k % program[1] == 0:
            robot.trajectory()
    robot.finish()
    return robot


@pytest.mark.parametrize("program", [(1000, 1000), (97, 3), (41, 1)])
@pytest.mark.parametrize("grid", [Static, Histogram])
def test_what_is_asked_on_the_way_changes_nothing(program, grid) -> None:
    assert state(asked(program, map_model=grid)) == state(asked((999, 999), map_model=grid))


def test_the_map_of_stretches_that_hardly_moved_is_drawn_anew_at_the_end() -> None:
    episode, found = drive(2.0, reach=6.0, bias=0.02, seed=2), []
    for every in (1000, 7):
        robot = GraphSlam()
        for k, given in enumerate(paired(episode)):
            robot.update(*given)
            if k % every == every - 1:
                robot.map()
        robot.finish()
        found.append(state(robot))
    assert found[0] == found[1]


def test_finishing_twice_is_finishing_once() -> None:
    robot = asked((1000, 1000))
    before = state(robot)
    robot.finish()
    assert state(robot) == before


def test_the_map_is_that_of_all_stretches_where_they_lie_now() -> None:
    robot = asked((50, 1000), map_model=Histogram)
    grid = Histogram()
    for place, frame in zip(robot.places, robot.graph.poses, strict=True):
        for scan, pose in place.keyframes:
            grid.integrate(scan, Pose2.of(frame) @ pose)
    expected, found = grid.cells.grid(), robot.map()
    assert found.spec == expected.spec
    np.testing.assert_array_equal(found.occupied, expected.occupied)
    np.testing.assert_array_equal(found.observed, expected.observed)


def test_it_goes_on_after_it_was_finished() -> None:
    robot, scans = asked((1000, 1000)), driven().scans
    before = robot.trajectory()
    estimate = robot.update(Pose2(0.1), scans[-1])
    assert len(robot.trajectory()) == len(before) + 1
    np.testing.assert_array_equal(robot.trajectory()[:-1], before)
    assert math.dist(estimate.pose[:2], before[-1, :2]) < 0.3


# -- many laps of one place --------------------------------------------------------------------

DOOR = np.array([[3.0, -1.0, 3.8, -1.0]])  # closes a niche of the block's outer wall


@cache
def laps(count: int, closed_from: float = math.inf) -> Episode:
    """So many laps, of which the door is closed from lap `closed_from` on."""
    episode = drive(float(count), reach=4.0, bias=0.02)
    assert episode.truth is not None
    rng, scans = np.random.default_rng(1), list(episode.scans)
    for k in range(round(len(scans) * min(closed_from / count, 1.0)), len(scans)):
        pose, walls = Pose2.of(episode.truth.poses[k]), np.vstack([WALLS, DOOR])
        ranges = naive.cast(pose, ANGLES, walls, 4.0) + rng.normal(0, 0.01, len(ANGLES))
        scans[k] = replace(scans[k], ranges=ranges)
    return replace(episode, scans=tuple(scans))


@cache
def kept(visits: int) -> tuple[GraphSlam, list[int], list[int]]:
    """A SLAM after ten laps; the numbers of its local maps and of its edges on the way."""
    robot, places, edges = GraphSlam(visits=visits), [], []
    for given in paired(laps(10)):
        robot.update(*given)
        places.append(len(robot.places))
        edges.append(len(robot.graph.edges))
    robot.finish()
    return robot, places, edges


def test_in_a_small_place_few_stretches_are_kept() -> None:
    robot, places, edges = kept(1)
    third = len(places) // 3
    assert robot.places[-1].ordinal >= 45
    assert max(places[2 * third :]) <= max(places[:third]) + 2 <= 20
    assert max(edges[2 * third :]) <= 1.3 * max(edges[:third])
    assert len(robot.places) == len(robot.graph.poses)
    assert len(robot._matcher._frozen) <= len(robot.places)
    assert [place.ordinal for place in robot.places] == sorted(
        {place.ordinal for place in robot.places}
    )
    _, many, _ = kept(100)
    assert many[-1] == robot.places[-1].ordinal + 1


@pytest.mark.parametrize("visits", [1, 2])
def test_who_forgets_is_as_accurate(visits: int) -> None:
    episode = laps(10)
    found, known = (off(kept(n)[0].trajectory(), episode) for n in (visits, 100))
    assert len(found) == len(episode.scans)
    assert math.sqrt(np.square(found).mean()) < 1.3 * math.sqrt(np.square(known).mean()) + 0.01
    assert found.max() < known.max() + 0.05


def test_forgetting_moves_nothing() -> None:
    robot, moved = GraphSlam(visits=1), []
    forget = robot._forget

    def noting(here: int) -> bool:
        before, poses = robot.trajectory(), robot.graph.poses
        forgotten = forget(here)
        if forgotten:
            moved.append(np.abs(robot.trajectory() - before)[:, :2].max())
            assert len(robot.graph.poses) == len(poses) - 1
        return forgotten

    robot._forget = noting
    for given in paired(laps(10)):
        robot.update(*given)
    assert len(moved) > 20
    assert max(moved) < 1e-9


@pytest.mark.parametrize("grid", [Static, Histogram])
def test_who_forgets_does_the_same_again_whatever_is_asked(grid) -> None:
    found = []
    for every in (10_000, 97):
        robot = GraphSlam(visits=1, map_model=grid)
        for k, given in enumerate(paired(laps(10))):
            robot.update(*given)
            if k % every == every - 1:
                robot.map()
        robot.finish()
        found.append(state(robot))
    assert found[0] == found[1]


@pytest.mark.parametrize("asked", [False, True])
def test_a_door_that_was_closed_after_many_laps_is_learned(asked: bool) -> None:
    """Also in the map that was drawn on the way, and in the local maps that are kept."""
    robot = GraphSlam(visits=2, map_model=Clamped)
    for k, given in enumerate(paired(laps(10, closed_from=8.0))):
        robot.update(*given)
        if asked and k % 50 == 0:
            robot.map()
    drawn = seen_closed(robot)
    robot.finish()
    assert drawn > 0.6
    assert seen_closed(robot) > 0.6
    assert seen_closed(kept(2)[0]) < 0.4
    newest = [place for place in robot.places if place.keyframes[0].scan.time > 0.85 * last(robot)]
    assert len(newest) >= 4


def seen_closed(robot: GraphSlam) -> float:
    """How sure the map is that the door is closed: of the cells on both sides of its line."""
    return float(robot.sample(np.array([[3.4, -1.02], [3.4, -0.98]]))[0].max())


def last(robot: GraphSlam) -> float:
    return robot.places[-1].keyframes[-1].scan.time


def test_a_robot_that_stands_still_fills_no_memory(monkeypatch) -> None:
    monkeypatch.setattr(graph_slam, "MAX_KEYFRAMES", 20)
    robot, rng = GraphSlam(visits=2), np.random.default_rng(0)
    exact = scan_at(Pose2())
    for k in range(800):  # a keyframe each 2 s
        ranges = exact.ranges + rng.normal(0, 0.01, len(exact.ranges))
        robot.update(Pose2(), replace(exact, ranges=ranges, time=2.0 * k))
    assert robot.places[-1].ordinal >= 38
    assert len(robot.places) <= 6
    assert max(len(place.keyframes) for place in robot.places) <= 20
    assert np.abs(robot.trajectory()).max() < 0.05


def test_a_copy_goes_on_as_the_original() -> None:
    episode = laps(10)
    robot, found, given = GraphSlam(visits=1), [], iter(list(paired(episode)))
    while len(robot.trajectory()) < len(episode.scans) // 2 or robot._work:
        robot.update(*next(given))
    rest = list(given)
    for mine in (robot, pickle.loads(pickle.dumps(robot))):
        for one in rest:
            mine.update(*one)
        mine.finish()
        found.append(state(mine))
    assert found[0] == found[1]


def test_a_saved_map_that_is_continued_is_forgotten_in_part() -> None:
    episode = laps(10)
    session = session_of(episode, kept(1)[0].trajectory())
    robot = GraphSlam(visits=1)
    robot.remember(session.keyframes())
    remembered = len(robot.places)
    robot.place(Pose2.of(session.poses[-1]))
    for given in paired(laps(3)):
        robot.update(*given)
    robot.finish()
    assert remembered >= 45
    ordinals = [place.ordinal for place in robot.places]
    assert len(ordinals) <= 20
    assert ordinals[0] == 0
    assert ordinals[-1] > remembered + 10
    assert (np.diff(ordinals) > 0).all()
    assert off(robot.trajectory(), laps(3)).max() < 0.15


def test_where_a_map_is_continued_its_last_local_maps_are_not_those_of_the_robot() -> None:
    robot = GraphSlam()
    robot.remember(session_of(laps(10), kept(1)[0].trajectory()).keyframes())
    assert robot._old_ground._begin == len(robot.places) > 1


# -- odd starts --------------------------------------------------------------------------------


def test_before_the_first_scan_there_is_nothing() -> None:
    robot = GraphSlam(Pose2(1.0, 2.0, 3.0))
    assert isinstance(robot, Revising)
    robot.finish()
    assert robot.trajectory().shape == (0, 3)
    assert robot.map().observed.sum() == 0
    assert robot.pose == Pose2(1.0, 2.0, 3.0)


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (-2.0, 1.0, 3.0)])
@pytest.mark.parametrize("displacement", [(0.0, 0.0, 0.0), (0.7, -0.3, 1.0)])
def test_of_one_scan_it_has_the_pose_to_which_the_odometry_leads(start, displacement) -> None:
    robot = GraphSlam(Pose2(*start))
    estimate = robot.update(Pose2(*displacement), scan_at(Pose2()))
    robot.finish()
    expected = compose(start, displacement)
    assert np.array(estimate.pose) == pytest.approx(expected, abs=1e-9)
    assert robot.trajectory() == pytest.approx(expected[None], abs=1e-9)
    single = MaximumLikelihood(Pose2(*start))
    single.update(Pose2(*displacement), scan_at(Pose2()))
    assert (robot.map().observed == single.map().observed).mean() > 0.999


@pytest.mark.parametrize("fill", [math.nan, math.inf])
def test_without_any_echo_the_odometry_leads(fill: float) -> None:
    robot, pose = GraphSlam(stretch=0.5, seeds=2), Pose2()
    for k in range(120):
        displacement = Pose2(0.1, 0.0, 0.15)  # in circles
        pose = pose @ displacement
        estimate = robot.update(displacement, Scan(np.full(len(FAN), fill), FAN, 6.0, time=0.2 * k))
        assert np.isfinite(estimate.covariance).all()
    robot.finish()
    assert len(robot.places) > 8
    assert {len(place.keyframes) for place in robot.places[:-1]} == {MIN_KEYFRAMES}
    assert not any(edge.loop for edge in robot.graph.edges)
    assert tuple(robot.pose) == pytest.approx(tuple(pose), abs=1e-6)


@pytest.mark.parametrize(("alignment", "atol"), [(None, 1e-6), (ALIGNED, 1e-5)])
def test_an_elsewhere_begun_drive_is_the_same_elsewhere(alignment, atol: float) -> None:
    episode, start = driven(), Pose2(30.0, -20.0, 0.0)  # by whole tiles: nothing is rounded anew
    here = run(GraphSlam(true_start(episode), alignment=alignment), episode).poses
    there = run(GraphSlam(start @ true_start(episode), alignment=alignment), episode).poses
    np.testing.assert_allclose(there, compose(start, here), atol=atol)


@pytest.mark.parametrize(
    "wrong",
    [{"stretch": 0.0}, {"stretch": math.nan}, {"seeds": -1}, {"seeds": 1.5}, {"candidates": -1}],
)
def test_parts_are_checked(wrong) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        GraphSlam(**wrong)


def long_way(edges: int) -> GraphSlam:
    """A robot that drove a square of so many edges, and believes to be at its start again."""
    robot, corner = GraphSlam(), Pose2(4.0, 0.0, 0.0)
    turns = {edges // 4, edges // 2, 3 * edges // 4}
    information = np.diag(np.array([0.05, 0.03, math.radians(0.6)]) ** -2.0)
    for number in range(edges):
        step = corner @ Pose2(0.0, 0.0, math.pi / 2 * (number + 1 in turns))
        last = len(robot.graph.poses) - 1
        robot.graph.add_pose(Pose2.of(robot.graph.poses[-1]) @ step)
        robot.graph.edges.append(Edge(last, last + 1, step, information))
    return robot


@pytest.mark.parametrize(("edges", "drifted"), [(200, True), (12, False)])
def test_a_robot_found_after_a_long_way_had_drifted(edges: int, drifted: bool) -> None:
    robot = long_way(edges)
    last, found = Pose2.of(robot.graph.poses[-1]), Pose2(6.0, 1.0, -math.pi / 2 + 0.05)
    assert math.dist(last[:2], (0.0, 0.0)) < 1e-6
    number = robot._drifted_from(Pose2(), found)
    assert (number is not None) == drifted
    if number is not None:
        assert math.dist(robot.graph.poses[number, :2], found[:2]) < 8.0
        assert number < 10


def test_the_loop_that_a_drift_opened_is_closed() -> None:
    robot, found = long_way(200), Pose2(6.0, 1.0, -math.pi / 2 + 0.05)
    robot.places = [LocalMap((), scan_at(Pose2()), k) for k in range(len(robot.graph.poses))]
    before = robot.graph.poses.copy()
    robot._join(found, tied=robot._drifted_from(Pose2(), found))
    robot._close_way(Pose2())
    while robot._work:
        robot._do(robot._work[0])
    last, end = robot.graph.poses[-2:]
    assert math.dist(end[:2], found[:2]) < 0.2
    assert math.dist(last[:2], end[:2]) < 0.2
    assert robot.graph.trust().min() > 0.9
    steps = np.hypot(*np.diff(robot.graph.poses[:-1, :2], axis=0).T)
    np.testing.assert_allclose(steps, 4.0, atol=0.1)  # the drift is shared by all
    assert np.hypot(*(robot.graph.poses[:-1] - before)[:5, :2].T).max() < 0.2
