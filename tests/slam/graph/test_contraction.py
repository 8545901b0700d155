"""Removing poses from a graph, compared with the exact marginal of the others."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.graph.covariance import MIN_INFORMATION
from slam.graph.edges import Edge
from slam.graph.pose_graph import PoseGraph
from slam.graph.system import jacobians
from tests.slam.graph import graphs

seeds = st.integers(0, 2**32 - 1)


def random_pose(rng) -> Pose2:
    return Pose2.of(rng.uniform(-3, 3, 3))


def random_edge(rng, first=0, second=1, loop=False) -> Edge:
    given = 0.01 * np.linalg.inv(graphs.random_information(rng))
    return Edge(first, second, random_pose(rng), graphs.random_information(rng), loop, given)


def close(found: Edge, expected: Edge) -> None:
    assert found[:2] == expected[:2]
    assert found.loop == expected.loop
    apart = found.displacement.between(expected.displacement)
    np.testing.assert_allclose(apart, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.given, expected.given, rtol=1e-6, atol=1e-12)
    one, other = (np.linalg.inv(edge.information) for edge in (found, expected))
    scale = np.sqrt(np.outer(np.diag(one), np.diag(one)))
    np.testing.assert_allclose(one / scale, other / scale, atol=2e-3)


# -- edges one after the other -----------------------------------------------------------------


@given(seeds)
def test_there_and_back_again_is_the_same_edge(seed: int) -> None:
    edge = random_edge(np.random.default_rng(seed), loop=bool(seed % 2))
    assert edge.reversed[:2] == (1, 0)
    close(edge.reversed.reversed, edge)


@given(seeds)
def test_the_order_in_which_edges_are_joined_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b, c = (random_edge(rng, k, k + 1) for k in range(3))
    close(a.followed_by(b).followed_by(c), a.followed_by(b.followed_by(c)))
    close(a.followed_by(b).reversed, b.reversed.followed_by(a.reversed))


def test_the_errors_of_both_edges_are_added() -> None:
    """Drawn at random: errors of a displacement are in the frame of its end."""
    rng = np.random.default_rng(0)
    a, b = random_edge(rng, 0, 1), random_edge(rng, 1, 2, loop=True)
    joined = a.followed_by(b)
    assert joined.loop
    offs = [
        np.array(
            joined.displacement.between(
                graphs.noisy(a.displacement, a.information, rng, 0.01)
                @ graphs.noisy(b.displacement, b.information, rng, 0.01)
            )
        )
        / 0.01
        for _ in range(4000)
    ]
    square = np.einsum("ni,ij,nj->n", offs, joined.information, offs)
    assert square.mean() == pytest.approx(3.0, rel=0.1)


# -- the graph without a pose ------------------------------------------------------------------


def information(graph: PoseGraph) -> np.ndarray:
    """The Hessian of all poses but the first, dense, with full weight of all edges."""
    n = 3 * len(graph.poses)
    result = np.zeros((n, n))
    for edge in graph.edges:
        first, second = graph.poses[[edge.first, edge.second]]
        before, after = jacobians(first, second, edge.displacement.theta)
        J = np.zeros((3, n))
        J[:, 3 * edge.first : 3 * edge.first + 3] = before
        J[:, 3 * edge.second : 3 * edge.second + 3] = after
        result += J.T @ (edge.information + np.diag(MIN_INFORMATION)) @ J
    return result[3:, 3:]


def marginal(hessian: np.ndarray, number: int) -> np.ndarray:
    """Of all poses but one (and the first): the Schur complement."""
    out = np.arange(3 * number - 3, 3 * number)
    rest = np.setdiff1d(np.arange(len(hessian)), out)
    inner = np.linalg.inv(hessian[np.ix_(out, out)])
    return (
        hessian[np.ix_(rest, rest)]
        - hessian[np.ix_(rest, out)] @ inner @ hessian[np.ix_(out, rest)]
    )


@given(seeds, st.integers(1, 5))
@settings(max_examples=30)
def test_of_a_chain_the_rest_is_the_exact_marginal(seed: int, number: int) -> None:
    rng = np.random.default_rng(seed)
    graph = PoseGraph(np.array([random_pose(rng)]))
    for k in range(5):
        edge = random_edge(rng, k, k + 1)
        graph.add_pose(Pose2.of(graph.poses[-1]) @ edge.displacement)
        graph.edges.append(edge)
    before = graph.poses.copy()
    expected = marginal(information(graph), number)
    graph.forget(number, number - 1)
    np.testing.assert_array_equal(graph.poses, np.delete(before, number, axis=0))
    found = information(graph)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=2e-3)


def looped(seed=0, n=24) -> PoseGraph:
    """Three laps of a ring, matched with the laps before, optimised."""
    truth, rng = graphs.ring(n, laps=3), np.random.default_rng(seed)
    graph = graphs.chain(truth, rng, share=0.3)
    lap = n // 3
    for k in range(lap, n):
        for other in (k - lap - 1, k - lap, k - lap + 1):
            if 0 <= other < k - 1:
                graph.edges.append(graphs.loop(truth, other, k, rng))
    graph.optimise()
    return graph


def links(graph: PoseGraph, loop: bool) -> list[tuple[int, ...]]:
    return [tuple(sorted(edge[:2])) for edge in graph.edges if edge.loop == loop]


@pytest.mark.parametrize("seed", range(4))
def test_forgetting_a_lap_leaves_the_others_where_they_are(seed: int) -> None:
    graph = looped(seed)
    before = graph.poses.copy()
    for number in range(15, 8, -1):  # of the second lap
        graph.forget(number, number - 8)
        kept = len(graph.poses)
        tree, loops = links(graph, False), links(graph, True)
        assert len(tree) == kept - 1
        assert len(set(loops)) == len(loops)
        assert all(a != b for a, b in tree + loops)
        assert max(map(max, tree)) == kept - 1
        assert connected(kept, tree)
    before = np.delete(before, range(9, 16), axis=0)
    np.testing.assert_array_equal(graph.poses, before)
    assert len(links(graph, True)) >= 8  # those of the third lap lead to the first
    graph.optimise()
    off = np.hypot(*(graph.poses - before)[:, :2].T)
    assert off.max() < 0.06


def connected(n: int, edges) -> bool:
    reached = {0}
    for _ in range(n):
        reached |= {b for pair in edges for b in pair if reached & set(pair)}
    return len(reached) == n


def test_a_loop_that_is_not_trusted_is_not_handed_on() -> None:
    graph = looped()
    truth = graphs.ring(24, laps=3)
    wrong = graphs.loop(truth, 3, 12, np.random.default_rng(9), off=Pose2(4.0, 0.0, 1.0))
    graph.edges.append(wrong)
    assert graph.trust()[-1] < 0.1
    graph.forget(12, 4)
    assert (graph.trust()[graph.edges.loops] > 0.3).all()


def test_of_two_loops_between_the_same_poses_the_surer_is_kept() -> None:
    here = Pose2(1.0, 0.0, 0.0)
    for sure in (0, 1):
        graph = PoseGraph(np.array([Pose2(), here, here, here]))
        graph.edges.extend(
            Edge(k, k + 1, here if k == 0 else Pose2(), np.eye(3) * 10.0) for k in range(3)
        )
        graph.edges.append(Edge(1, 3, Pose2(), np.eye(3) * (900.0 if sure == 0 else 30.0), True))
        graph.edges.append(Edge(2, 3, Pose2(), np.eye(3) * (30.0 if sure == 0 else 900.0), True))
        graph.edges.append(Edge(1, 2, Pose2(), np.eye(3) * 500.0, True))
        graph.forget(2, 1)
        loops = [edge for edge in graph.edges if edge.loop]
        assert [tuple(edge[:2]) for edge in loops] == [(1, 2)]
        expected = 1 / 900.0 if sure == 0 else 1 / 900.0 + 1 / 500.0
        assert np.linalg.inv(loops[0].information)[0, 0] == pytest.approx(expected, rel=0.01)


def test_what_no_match_has_measured_is_handed_on() -> None:
    given = np.diag([0.04, 0.01, 0.001])
    graph = PoseGraph(np.array([Pose2(), Pose2(), Pose2(0.0, 0.0, math.pi / 2)]))
    graph.edges.append(Edge(0, 1, Pose2(), np.eye(3) * 1e3, given=given))
    graph.edges.append(Edge(1, 2, Pose2(0.0, 0.0, math.pi / 2), np.eye(3) * 1e3))
    graph.forget(1, 0)
    (edge,) = graph.edges
    np.testing.assert_allclose(edge.given, np.diag([0.01, 0.04, 0.001]), atol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(edge.information), np.eye(3) * 2e-3, rtol=0.01)


def test_after_a_tenth_was_forgotten_all_poses_are_fitted_again() -> None:
    graph = looped(n=60)
    for _ in range(7):
        graph.forget(30, 10)
        pose = Pose2.of(graph.poses[-1])
        graph.add_pose(pose @ Pose2(0.5))
        last = len(graph.poses) - 1
        graph.edges.append(Edge(last - 1, last, Pose2(0.5), graphs.ODOMETRY))
    true = Pose2.of(graph.poses[2]).between(Pose2.of(graph.poses[-1]))
    graph.edges.append(Edge(2, len(graph.poses) - 1, true, graphs.LOOP, loop=True))
    assert graph.outdated
    *_, graph.poses = graph.adjusting()
    assert not graph.outdated
