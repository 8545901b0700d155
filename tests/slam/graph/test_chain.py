import math
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2, between, compose
from slam.graph import chain
from slam.graph.covariance import LEVER
from slam.graph.covariance import MIN_INFORMATION as LEAST
from slam.graph.edges import Edge, Edges
from tests.slam.graph import graphs

seeds = st.integers(0, 2**32 - 1)
MIN_INFORMATION = np.diag(LEAST)


def chained(n: int, edges: Iterable[Edge], trust, origin: int):
    return chain.chained(n, Edges(edges), trust, origin)


def led(edges, erring) -> Pose2:
    """The pose at the end of edges (edge, forth), some with errors (3,) in the second's frame."""
    pose = Pose2()
    for (edge, forth), e in zip(edges, erring, strict=True):
        moved = edge.displacement @ Pose2.of(e)
        pose = pose @ (moved if forth else moved.inverse())
    return pose


def along(edges) -> np.ndarray:
    """Covariance of the end, in its frame, by numerical derivatives by the edges' errors."""
    exact = np.zeros((len(edges), 3))
    end, result = led(edges, exact), np.zeros((3, 3))
    for k, (edge, _) in enumerate(edges):
        jacobian = np.empty((3, 3))
        for axis in range(3):
            up, down = exact.copy(), exact.copy()
            up[k, axis], down[k, axis] = 1e-6, -1e-6
            off = np.array(end.between(led(edges, up))) - end.between(led(edges, down))
            jacobian[:, axis] = off / 2e-6
        covariance = np.linalg.inv(edge.information + MIN_INFORMATION)
        result += jacobian @ covariance @ jacobian.T
    return result


def far(P) -> float:
    return P[0, 0] + P[1, 1] + LEVER**2 * P[2, 2]


def edge_of(rng, a: int, b: int, loop=False) -> Edge:
    return Edge(a, b, Pose2.of(rng.uniform(-3, 3, 3)), graphs.random_information(rng), loop)


@settings(max_examples=30)
@given(seeds)
def test_errors_add_up_along_the_only_way(seed: int) -> None:
    """A tree with edges of both directions, from any of its poses."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    edges, neighbours = [], {k: {} for k in range(n)}
    for k in range(1, n):
        a, b = rng.permutation([int(rng.integers(k)), k]).tolist()
        edges.append(edge_of(rng, a, b))
        neighbours[a][b], neighbours[b][a] = (edges[-1], True), (edges[-1], False)
    origin = int(rng.integers(n))
    found = chained(n, edges, np.ones(n - 1), origin)
    ways: dict = {origin: []}
    todo = [origin]
    while todo:
        here = todo.pop()
        for there, step in neighbours[here].items():
            if there not in ways:
                ways[there] = [*ways[here], step]
                todo.append(there)
    for k in range(n):
        np.testing.assert_allclose(found[k], along(ways[k]), rtol=1e-4, atol=1e-9)


def test_that_is_what_noise_does() -> None:
    rng, many = np.random.default_rng(0), 20_000
    edges = [Edge(k, k + 1, Pose2(1.0, 0.3, 0.5), 9 * graphs.ODOMETRY) for k in range(5)]
    edges[2] = Edge(3, 2, Pose2(1.0, 0.3, 0.5).inverse(), 9 * graphs.ODOMETRY)
    poses, exact = np.zeros((many, 3)), np.zeros(3)
    for k, edge in enumerate(edges):
        covariance = np.linalg.inv(edge.information)
        moved = compose(edge.displacement, rng.multivariate_normal(np.zeros(3), covariance, many))
        step = between(moved, np.zeros(3)) if k == 2 else moved
        exact = compose(exact, Pose2(1.0, 0.3, 0.5))
        poses = compose(poses, step)
    off = between(exact, poses)
    found = chained(6, edges, np.ones(5), 0)[5]
    deviations = np.sqrt(np.diag(found))
    scaled = np.cov(off.T) / np.outer(deviations, deviations)
    np.testing.assert_allclose(scaled, found / np.outer(deviations, deviations), atol=0.05)


@settings(max_examples=30)
@given(seeds)
def test_of_two_ways_the_surest_is_taken(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one = [edge_of(rng, 0, 1), edge_of(rng, 1, 3)]
    other = [edge_of(rng, 0, 2), edge_of(rng, 2, 3)]
    ways = [along([(edge, True) for edge in way]) for way in (one, other)]
    found = chained(4, one + other, np.ones(4), 0)[3]
    np.testing.assert_allclose(found, min(ways, key=far), rtol=1e-4, atol=1e-9)


def test_of_two_edges_side_by_side_the_surest_is_taken() -> None:
    sure, unsure = Edge(0, 1, Pose2(1.0), np.eye(3) * 400), Edge(0, 1, Pose2(1.0), np.eye(3) * 4)
    expected = np.linalg.inv(np.eye(3) * 400 + MIN_INFORMATION)
    for edges in ([sure, unsure], [unsure, sure]):
        np.testing.assert_allclose(chained(2, edges, np.ones(2), 0)[1], expected)


def test_a_loop_makes_surer_and_one_that_is_distrusted_does_not() -> None:
    truth, rng = graphs.ring(20), np.random.default_rng(0)
    graph = graphs.chain(truth, rng)
    alone = chained(20, graph.edges, np.ones(19), 0)
    graph.edges.append(graphs.loop(truth, 0, 15, rng))
    trusted = chained(20, graph.edges, np.ones(20), 0)
    np.testing.assert_array_equal(trusted[:7], alone[:7])
    assert all(far(trusted[k]) < 0.5 * far(alone[k]) for k in range(14, 20))
    distrusted = chained(20, graph.edges, np.array([1.0] * 19 + [0.49]), 0)
    np.testing.assert_array_equal(distrusted, alone)


def test_what_cannot_be_reached_is_infinitely_unsure() -> None:
    edges = [Edge(0, 1, Pose2(1.0), np.eye(3)), Edge(2, 3, Pose2(1.0), np.eye(3))]
    found = chained(5, edges, np.ones(2), 1)
    assert (found[1] == 0).all()
    assert np.isfinite(found[0]).all()
    assert np.isinf(found[2:]).all()
    for few in ([], [Edge(0, 1, Pose2(), np.eye(3), loop=True)]):
        found = chained(3, few, np.zeros(len(few)), 1)
        assert (found[1] == 0).all()
        assert np.isinf(found[[0, 2]]).all()


@pytest.mark.parametrize("axis", range(3))
def test_an_edge_that_knows_nothing_of_an_axis_is_not_off_without_end(axis: int) -> None:
    information = np.diag(np.where(np.arange(3) == axis, 0.0, 100.0))
    found = chained(2, [Edge(0, 1, Pose2(1.0, 0.0, math.pi / 2), information)], np.ones(1), 0)[1]
    assert found[axis, axis] == pytest.approx(1 / MIN_INFORMATION[axis, axis])
    assert np.isfinite(found).all()
