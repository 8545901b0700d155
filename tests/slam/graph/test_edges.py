import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.graph.edges import INITIAL_EDGES, Edge, Edges
from tests.slam.graph import graphs


def some(n: int, seed=0) -> list[Edge]:
    rng = np.random.default_rng(seed)
    edges = []
    for k in range(n):
        moved, information = Pose2.of(rng.normal(size=3)), graphs.random_information(rng)
        edges.append(Edge(k, k + 1 + k % 3, moved, information, loop=k % 2 > 0))
    return edges


def same(found: Edge, expected: Edge) -> bool:
    return (*found[:3], found.loop) == (*expected[:3], expected.loop) and np.array_equal(
        found.information, expected.information
    )


@given(st.integers(0, 3 * INITIAL_EDGES), st.integers(0, 3 * INITIAL_EDGES))
def test_what_was_added_is_what_there_is(n: int, more: int) -> None:
    expected = some(n + more)
    edges = Edges(expected[:n])
    edges.extend(expected[n:])
    assert len(edges) == n + more
    assert all(map(same, edges, expected))
    assert all(same(edges[k], expected[k]) for k in range(-n, n))
    assert edges.ends.tolist() == [list(edge[:2]) for edge in expected]
    assert edges.measured.tolist() == [list(edge.displacement) for edge in expected]
    assert edges.loops.tolist() == [edge.loop for edge in expected]


def test_arrays_are_of_what_there_was() -> None:
    edges = Edges(some(INITIAL_EDGES - 1))
    before, copies = edges.measured, edges.measured.copy()
    edges.extend(some(3 * INITIAL_EDGES, seed=1))
    np.testing.assert_array_equal(before, copies)


def test_those_chosen_are_a_copy() -> None:
    expected = some(9)
    edges = Edges(expected)
    numbers = np.array([1, 4, 8])
    chosen = edges.chosen(numbers)
    chosen.append(expected[0])
    assert all(map(same, chosen, [expected[k] for k in (1, 4, 8, 0)]))
    assert all(map(same, edges, expected))
    assert len(edges.chosen(numbers[:0])) == 0


def test_what_was_removed_is_gone_and_more_can_be_added() -> None:
    every = some(20)
    for left in ([], [0, 3, 19], list(range(20))):
        edges = Edges(every)
        edges.remove(set(range(20)) - set(left))
        assert len(edges) == len(left)
        edges.extend(every[:3])
        expected = [every[k] for k in left] + every[:3]
        assert all(same(one, other) for one, other in zip(edges, expected, strict=True))


def test_an_edge_is_replaced_and_poses_are_renumbered() -> None:
    edges, other = Edges(some(4)), some(9, seed=1)[-1]
    edges[2] = other
    assert same(edges[2], other)
    edges = Edges([other._replace(first=3, second=5), other._replace(first=0, second=1)])
    edges.remove_pose(2)
    assert edges.ends.tolist() == [[2, 4], [0, 1]]
