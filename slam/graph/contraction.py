"""Removing a pose from a graph: its edges lead to a pose nearby from then on.

The marginal of the other poses has an edge between every two neighbours of the removed one. Here,
as in Kretzschmar and Stachniss (2012), a tree stands for it, with fewer edges than before.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slam.geometry import Array, Pose2
from slam.graph.chain import MIN_WEIGHT, chained
from slam.graph.covariance import covariance_of, size
from slam.graph.edges import Edge, Edges


def contract(edges: Edges, poses: Array, trust: Array, number: int, into: int) -> list[int]:
    """Make the edges at pose `number` lead elsewhere; returns the numbers of those to be removed.

    Edges that close no loop form a tree, and still do: they lead to the neighbour by the most
    certain of them. Loops begin at pose `into` instead, which lies at the same place: over the
    displacement between the two by the `poses` (n, 3), with the error of the chain of edges between
    them. Of two edges between the same poses the more certain one is kept, not their sum: both are
    of the same walls.

    trust  (edges,) weights of the edges, from 0 to 1; loops that are not trusted are removed
    """
    at = _at(edges, number)
    loops = [k for k in at if edges.loops[k]]
    bridge = _bridge(edges, poses, trust, number, into)
    removed = _contract_tree(edges, [k for k in at if not edges.loops[k]], number)
    doubted = [k for k in loops if trust[k] < MIN_WEIGHT]
    believed = [k for k in loops if trust[k] >= MIN_WEIGHT]
    return removed + doubted + list(_contract_loops(edges, believed, bridge))


def _bridge(edges: Edges, poses: Array, trust: Array, number: int, into: int) -> Edge:
    """The edge from pose `into` to pose `number` along the most certain chain."""
    covariance = chained(len(poses), edges, trust, into)[number]
    displacement = Pose2.of(poses[into]).between(Pose2.of(poses[number]))
    return Edge(into, number, displacement, np.linalg.inv(covariance), loop=True)


def _contract_tree(edges: Edges, at: list[int], number: int) -> list[int]:
    """Let the edges with numbers `at` begin at the neighbour that the surest of them leads to."""
    surest = min(at, key=lambda k: uncertainty(edges[k]))
    bridge = outward(edges[surest], number).reversed
    for k in at:
        if k != surest:
            edges[k] = bridge.followed_by(outward(edges[k], number))
    return [surest]


def _contract_loops(edges: Edges, at: list[int], bridge: Edge) -> Iterator[int]:
    """Let the loops with numbers `at` begin where the bridge does; yields those not needed."""
    into, number = bridge.first, bridge.second
    beside = {int(edges.ends[k].sum()) - into: k for k in _at(edges, into) if k not in at}
    for k in at:
        edge = outward(edges[k], number)
        if edge.second == into:
            yield k
            continue
        edges[k] = bridge.followed_by(edge)
        other = beside.setdefault(edge.second, k)
        if other != k:
            better = edges.loops[other] and uncertainty(edges[k]) < uncertainty(edges[other])
            yield other if better else k
            beside[edge.second] = k if better else other


def _at(edges: Edges, number: int) -> list[int]:
    return np.flatnonzero((edges.ends == number).any(axis=1)).tolist()


def outward(edge: Edge, number: int) -> Edge:
    """The edge, or its reverse, such that it begins at pose `number`."""
    return edge if edge.first == number else edge.reversed


def uncertainty(edge: Edge) -> float:
    """The size of an edge's covariance, m^2."""
    return float(size(covariance_of(edge.information)))
