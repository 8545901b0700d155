import copy
import math
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from slam.geometry import Pose2, between, wrap_angle
from slam.graph import pose_graph
from slam.graph.edges import Edge, Edges
from slam.graph.pose_graph import RECENT_POSES, PoseGraph
from slam.graph.system import System, jacobians
from tests.slam.graph import graphs

seeds = st.integers(0, 2**32 - 1)


def solved(poses, edges, scale=11.3) -> np.ndarray:
    graph = PoseGraph(np.array(poses, dtype=float), Edges(edges), scale)
    graph.optimise()
    return graph.poses


def close(found, expected, atol: float) -> None:
    off = np.asarray(found) - np.asarray(expected)
    off[:, 2] = wrap_angle(off[:, 2])
    np.testing.assert_allclose(off, 0.0, atol=atol)


# -- by hand -----------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(0.5, 2.0), st.floats(1.0, 1e4)), min_size=1, max_size=8),
    st.floats(-1.0, 1.0),
    st.floats(1.0, 1e4),
)
def test_on_a_line_each_edge_gives_way_by_its_variance(edges, off, last) -> None:
    """Springs in a row, and one that spans them all."""
    n = len(edges)
    lengths, stiff = np.array(edges).T
    measured = [Edge(k, k + 1, Pose2(lengths[k]), np.diag([stiff[k], 1.0, 1.0])) for k in range(n)]
    measured.append(Edge(0, n, Pose2(lengths.sum() + off), np.diag([last, 1.0, 1.0])))
    gives = 1 / stiff
    stretched = lengths + off * gives / (gives.sum() + 1 / last)
    expected = np.zeros((n + 1, 3))
    expected[1:, 0] = np.cumsum(stretched)
    close(solved(np.zeros((n + 1, 3)), measured), expected, 1e-6)


@pytest.mark.parametrize("off", [-0.2, 0.01, 0.3])
def test_around_a_square_the_error_is_spread_evenly(off: float) -> None:
    side, information = Pose2(1.0, 0.0, math.pi / 2 + off), np.diag([50.0, 20.0, 10.0])
    edges = [Edge(k, (k + 1) % 4, side, information) for k in range(4)]
    poses = [Pose2(3.0, -2.0, 1.0)]
    for _ in range(3):
        poses.append(poses[-1] @ side)
    expected = [poses[0]]
    for _ in range(3):
        expected.append(expected[-1] @ Pose2(1.0, 0.0, math.pi / 2))
    close(solved(poses, edges), expected, 1e-6)


def test_information_is_in_the_frame_of_the_second() -> None:
    """Its x is the world's y: one edge has information about the world's y, the other its x."""
    knows_y = Edge(0, 1, Pose2(1.0, 0.0, math.pi / 2), np.diag([300.0, 1.0, 9.0]))
    knows_x = Edge(0, 1, Pose2(1.4, 0.4, math.pi / 2), np.diag([1.0, 300.0, 9.0]))
    found = solved([(0, 0, 0), (1, 0, 1.5)], [knows_y, knows_x])
    share = 0.4 / 301
    close(found[1:], [(1.4 - share, share, math.pi / 2)], 1e-6)


def test_the_first_pose_is_given() -> None:
    rng = np.random.default_rng(0)
    graph = graphs.chain(graphs.ring(12), rng)
    graph.edges.append(graphs.loop(graphs.ring(12), 0, 6, rng))
    start, before = graph.poses[0].copy(), graph.poses.copy()
    graph.optimise()
    np.testing.assert_array_equal(graph.poses[0], start)
    assert np.abs(graph.poses - before).max() > 1e-3


# -- against scipy -----------------------------------------------------------------------------


def random_graph(seed: int, noise: float, loops: bool) -> PoseGraph:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
    truth = [Pose2.of(rng.uniform(-3, 3, 3)) for _ in range(n)]
    pairs = [(int(rng.integers(k)), k) for k in range(1, n)]
    pairs += [tuple(rng.choice(n, 2, replace=False).tolist()) for _ in range(rng.integers(1, 6))]
    edges = []
    for k, (a, b) in enumerate(pairs):
        information = graphs.random_information(rng)
        moved = graphs.noisy(truth[a].between(truth[b]), information, rng, noise)
        edges.append(Edge(a, b, moved, information, loop=loops and k >= n - 1))
    poses = np.array([truth[0], *(one @ Pose2.of(rng.normal(0, 0.03, 3)) for one in truth[1:])])
    return PoseGraph(poses, Edges(edges))


def residuals(free, first, edges, scale: float) -> np.ndarray:
    """Residuals whose squares sum to the cost."""
    poses = np.vstack([first, free.reshape(-1, 3)])
    result = []
    for edge in edges:
        root = np.linalg.cholesky(edge.information).T
        kept = math.sqrt(scale / (scale + graphs.square(edge, poses))) if edge.loop else 1.0
        result.append(kept * root @ graphs.error(edge, poses))
    return np.concatenate(result)


@settings(max_examples=25)
@given(seeds)
def test_poses_are_those_of_least_squares(seed: int) -> None:
    graph = random_graph(seed, 1.0, loops=False)
    args = graph.poses[0], graph.edges, graph.scale
    found = least_squares(residuals, graph.poses[1:].ravel(), args=args, xtol=1e-12, ftol=1e-12)
    graph.optimise()
    close(graph.poses[1:], found.x.reshape(-1, 3), 1e-5)


@settings(max_examples=25)
@given(seeds)
def test_with_a_kernel_poses_are_a_minimum(seed: int) -> None:
    graph = random_graph(seed, 0.7, loops=True)
    graph.optimise()
    args = graph.poses[0], graph.edges, graph.scale
    found = least_squares(residuals, graph.poses[1:].ravel(), args=args, xtol=1e-12, ftol=1e-12)
    cost = 0.5 * np.square(residuals(graph.poses[1:].ravel(), *args)).sum()
    assert cost < 1.001 * found.cost + 1e-9  # in a flat valley, poses may differ by millimetres
    close(graph.poses[1:], found.x.reshape(-1, 3), 2e-2)


@settings(max_examples=25)
@given(seeds, st.integers(1, 4))
def test_with_more_poses_given_the_others_are_those_of_least_squares(seed: int, given: int) -> None:
    graph = random_graph(seed, 1.0, loops=False)
    given = min(given, len(graph.poses) - 1)
    fixed = graph.poses[:given].copy()

    def residual(free) -> np.ndarray:
        poses = np.vstack([fixed, free.reshape(-1, 3)])
        return residuals(poses[1:].ravel(), poses[0], graph.edges, graph.scale)

    found = least_squares(residual, graph.poses[given:].ravel(), xtol=1e-12, ftol=1e-12)
    system, poses = System(graph.edges, len(graph.poses), given), graph.poses
    for _ in range(20):
        poses = poses + system.step(poses, np.ones(len(system.edges)))
    np.testing.assert_array_equal(poses[:given], fixed)
    close(poses[given:], found.x.reshape(-1, 3), 1e-5)


@given(seeds)
def test_errors_and_their_squares(seed: int) -> None:
    graph = random_graph(seed, 1.0, loops=True)
    expected = [graphs.error(edge, graph.poses) for edge in graph.edges]
    np.testing.assert_allclose(graph.edges.errors(graph.poses), expected, atol=1e-9)
    squares = np.array([graphs.square(edge, graph.poses) for edge in graph.edges])
    np.testing.assert_allclose(graph.edges.squares(graph.poses), squares, rtol=1e-6, atol=1e-9)
    loops = np.array([edge.loop for edge in graph.edges])
    kept = np.where(loops, 1 / (1 + squares / graph.scale) ** 2, 1.0)
    np.testing.assert_allclose(graph.trust(), kept, rtol=1e-6)


@settings(max_examples=30)
@given(seeds)
def test_jacobians_are_the_slopes_of_the_errors(seed: int) -> None:
    graph = random_graph(seed, 1.0, loops=False)
    for edge in graph.edges:
        first, second = graph.poses[[edge.first, edge.second]]
        before, after = jacobians(first, second, edge.displacement.theta)
        for number, jacobian in ((edge.first, before), (edge.second, after)):
            for axis in range(3):
                up, down = graph.poses.copy(), graph.poses.copy()
                up[number, axis] += 1e-6
                down[number, axis] -= 1e-6
                off = graphs.error(edge, up) - graphs.error(edge, down)
                off[2] = wrap_angle(off[2])
                np.testing.assert_allclose(jacobian[:, axis], off / 2e-6, atol=1e-6)


def test_a_long_chain_with_a_very_weak_edge_is_solved() -> None:
    """Round-off leaves no positive matrix; a little on the diagonal helps."""
    rng = np.random.default_rng(33)
    truth = np.cumsum(rng.normal(size=(400, 3)) * (3.0, 0.3, 0.1), axis=0)
    ends = np.column_stack([np.arange(399), np.arange(1, 400)])
    information = np.tile(1e8 * np.eye(3), (399, 1, 1))
    information[rng.integers(399)] = 1e-4 * np.eye(3)
    measured = between(truth[:-1], truth[1:]) + rng.normal(size=(399, 3)) * 1e-3
    system = System(Edges.of(ends, measured, information), 400)
    poses = truth
    for _ in range(8):
        poses = poses + system.step(poses, np.ones(399))
    assert np.abs(system.edges.errors(poses)).max() < 1e-3


def test_edges_that_are_not_finite_are_refused() -> None:
    edges = Edges.of(np.array([[0, 1]]), np.zeros((1, 3)), np.full((1, 3, 3), np.nan))
    with pytest.raises(np.linalg.LinAlgError):
        System(edges, 2).step(np.zeros((2, 3)), np.ones(1))


def test_where_a_heading_wraps_nothing_happens() -> None:
    truth = [Pose2(0.5 * k, 0.0, math.pi - 0.02 + 0.01 * k) @ Pose2() for k in range(5)]
    graph = graphs.chain(truth, np.random.default_rng(1))
    graph.edges.append(graphs.loop(truth, 0, 4, np.random.default_rng(2)))
    graph.optimise()
    close(graph.poses, truth, 0.2)
    assert (np.abs(graph.poses[:, 2]) <= math.pi).all()


# -- loops that are wrong, and loops that are right --------------------------------------------

TRUTH = graphs.ring(40)


def looped(seed: int, wrong=()) -> PoseGraph:
    """Twice around, with a loop at every fifth pose of the second lap, and wrong ones."""
    rng = np.random.default_rng(seed)
    graph = graphs.chain(TRUTH, rng)
    graph.edges.extend(graphs.loop(TRUTH, k - 20, k, rng) for k in range(20, 40, 5))
    graph.edges.extend(graphs.loop(TRUTH, a, b, rng, off) for a, b, off in wrong)
    return graph


GROSS = [
    [(3, 32, Pose2(3.0, 0.0, 0.0))],
    [(3, 32, Pose2(0.0, -1.0, 0.0))],
    [(12, 31, Pose2(0.0, 0.0, 0.5))],
    [(0, 39, Pose2(-4.0, 4.0, 3.0))],
    [(3, 32, Pose2(3.0, 0.0, 0.0)), (8, 22, Pose2(-2.0, 1.0, 0.4))],
    [(3, 32, Pose2(0.0, 2.0, 0.0)), (4, 33, Pose2(0.0, 2.0, 0.0))],  # which agree
]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("wrong", GROSS)
def test_a_false_loop_is_switched_off(seed: int, wrong) -> None:
    graph, without = looped(seed, wrong), looped(seed)
    without.optimise()
    graph.optimise()
    trust = graph.trust()
    assert (trust[-len(wrong) :] < 0.1).all()
    assert (trust[: -len(wrong)] > 0.3).all()
    close(graph.poses, without.poses, 0.02)
    close(graph.poses, TRUTH, 0.35)


@pytest.mark.parametrize("wrong", GROSS)
def test_an_edge_that_is_no_loop_is_never_switched_off(wrong) -> None:
    graph = looped(0, wrong)
    *others, last = graph.edges
    graph.edges = Edges([*others, last._replace(loop=False)])
    graph.optimise()
    assert graph.trust()[-1] == 1.0


@pytest.mark.parametrize("bias", [-1.0, 0.5, 1.0])
def test_a_true_loop_over_a_chain_that_drifted_is_believed(bias: float) -> None:
    """A heading error at every pose, as large as the chain's standard deviation."""
    truth, rng = graphs.ring(100, laps=1, length=60.0), np.random.default_rng(3)
    graph = graphs.chain(truth, rng)
    turned = Pose2(0.0, 0.0, bias * math.radians(0.5))
    graph.edges = Edges(
        edge._replace(displacement=edge.displacement @ turned) for edge in graph.edges
    )
    for k, edge in enumerate(graph.edges):
        graph.poses[k + 1] = Pose2.of(graph.poses[k]) @ edge.displacement
    graph.edges.append(graphs.loop(truth, 0, 99, rng))
    off = graphs.error(graph.edges[-1], graph.poses)
    assert np.hypot(*off[:2]) > 2.0
    assert graph.trust()[-1] < 1e-3
    graph.optimise()
    assert graph.trust()[-1] > 0.5
    np.testing.assert_allclose(graphs.error(graph.edges[-1], graph.poses), 0.0, atol=0.05)
    close(graph.poses[-1:], truth[-1:], 0.1)


# -- step by step ------------------------------------------------------------------------------


def test_what_is_added_between_the_steps_is_left_out_of_them() -> None:
    graph, alone = looped(1, GROSS[0]), looped(1, GROSS[0])
    before, last = graph.poses.copy(), graph.poses
    for k, poses in enumerate(graph.steps()):
        last = poses
        assert poses.shape == (40, 3)
        if k < 3:
            number = graph.add_pose(Pose2.of(graph.poses[-1]) @ Pose2(1.0))
            graph.edges.append(Edge(number - 1, number, Pose2(1.0), graphs.ODOMETRY))
            graph.edges.append(Edge(0, number, Pose2(9.0), graphs.LOOP, loop=True))
    np.testing.assert_array_equal(graph.poses[:40], before)
    alone.optimise()
    np.testing.assert_array_equal(last, alone.poses)
    assert len(graph.poses) == 43


def test_steps_do_not_change_those_before() -> None:
    steps = list(islice(looped(2).steps(), 3))
    kept = copy.deepcopy(steps)
    assert len(steps) == 3
    assert len({poses.tobytes() for poses in kept}) == 3
    for poses, was in zip(steps, kept, strict=True):
        np.testing.assert_array_equal(poses, was)


def test_at_the_minimum_one_step_is_enough() -> None:
    graph = looped(4)
    graph.optimise()
    graph.optimise()
    found = graph.poses.copy()
    graph.optimise()
    close(graph.poses, found, 1e-4)


@pytest.mark.parametrize("start", [Pose2(), Pose2(1.0, 2.0, 3.0)])
def test_one_pose_stays_where_it_is(start: Pose2) -> None:
    graph = PoseGraph(np.array([start]))
    graph.optimise()
    assert graph.poses.tolist() == [list(start)]
    assert graph.trust().tolist() == []


def test_numbers_are_given_in_order() -> None:
    graph = PoseGraph()
    assert [graph.add_pose(Pose2(float(k))) for k in range(3)] == [0, 1, 2]
    assert graph.poses.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]


# -- as few poses as will do -------------------------------------------------------------------


def grown(n=60, off=Pose2()) -> PoseGraph:
    """Fitted poses, one more, and a loop at it with error `off`."""
    truth, rng = graphs.ring(n, length=40.0), np.random.default_rng(5)
    graph = graphs.chain(truth, rng, share=0.1)
    graph.edges.extend(graphs.loop(truth, k - n // 2, k, rng) for k in range(n // 2, n, 3))
    graph.optimise()
    graph.add_pose(Pose2.of(graph.poses[-1]) @ Pose2(0.5))
    graph.edges.append(Edge(n - 1, n, Pose2(0.5), graphs.ODOMETRY))
    true = Pose2.of(graph.poses[2]).between(Pose2.of(graph.poses[n]))
    graph.edges.append(Edge(2, n, true @ off, graphs.LOOP, loop=True))
    return graph


def adjusted(graph: PoseGraph) -> PoseGraph:
    *_, graph.poses = graph.adjusting()
    return graph


def test_a_loop_that_fits_moves_the_last_poses_alone() -> None:
    graph = grown(off=Pose2(0.02, -0.03, 0.005))
    before = graph.poses.copy()
    whole = grown(off=Pose2(0.02, -0.03, 0.005))
    adjusted(graph)
    whole.optimise()
    np.testing.assert_array_equal(graph.poses[:-RECENT_POSES], before[:-RECENT_POSES])
    assert np.abs(graph.poses[-1] - before[-1]).max() > 3e-3
    close(graph.poses, whole.poses, 0.02)
    assert graph.outdated
    graph.optimise()
    assert not graph.outdated
    close(graph.poses, whole.poses, 1e-4)


@pytest.mark.parametrize("off", [Pose2(0.5), Pose2(0.0, 0.0, 0.2), Pose2(-3.0, 2.0, 1.0)])
def test_a_loop_that_does_not_asks_for_all(off: Pose2) -> None:
    graph, whole = adjusted(grown(off=off)), grown(off=off)
    whole.optimise()
    np.testing.assert_array_equal(graph.poses, whole.poses)
    assert not graph.outdated


def test_poses_that_became_many_more_are_all_fitted(monkeypatch) -> None:
    monkeypatch.setattr(pose_graph, "MAX_GROWTH", 61 / 60)
    graph, whole = adjusted(grown()), grown()
    whole.optimise()
    np.testing.assert_array_equal(graph.poses, whole.poses)
    assert not graph.outdated


def test_without_loops_nothing_is_out_of_date() -> None:
    graph = graphs.chain(graphs.ring(30), np.random.default_rng(0))
    assert not graph.outdated
    graph.edges.append(graphs.loop(graphs.ring(30), 0, 15, np.random.default_rng(1)))
    assert graph.outdated
