"""How far two poses of a graph may be off each other, along the surest chain of edges."""

from __future__ import annotations

import heapq

import numpy as np

from slam.geometry import Array
from slam.graph.edges import Edges
from slam.kernel import kernel

LEVER = 5.0  # m: what an error of the heading is worth beside one of the place
LEAST = np.array([1e-4, 1e-4, 1e-2])  # 1/m^2, 1/rad^2: what is not known is not off without end
TRUSTED = 0.5  # of a loop's weight, from where on it is a link


def chained(n: int, edges: Edges, trust: Array, origin: int) -> Array:
    """(n, 3, 3) the covariance of each of n poses as seen from pose `origin`, in the pose's frame.

    Errors add up along the chain that leaves the least of them: an upper bound, since other chains
    only add to what is known (Bosse et al. 2004). Infinite where no chain leads.
    """
    links = np.flatnonzero(trust >= TRUSTED)
    begins, ways = _star(n, edges.ends, links)
    return _spread(begins, ways, edges.ends, edges.measured, edges.information, origin)


@kernel
def _star(n, ends, links):
    """The edges at each pose: `ways[begins[k] : begins[k + 1]]`, those numbered in `links`."""
    begins = np.zeros(n + 2, np.int64)
    for e in links:
        begins[ends[e, 0] + 2] += 1
        begins[ends[e, 1] + 2] += 1
    begins = np.cumsum(begins)
    ways = np.empty(2 * len(links), np.int64)
    for e in links:
        for k in range(2):
            here = ends[e, k] + 1
            ways[begins[here]] = e
            begins[here] += 1
    return begins[:-1], ways


@kernel
def _spread(begins, ways, ends, measured, information, origin):
    """Dijkstra's algorithm, the length of a way being the error at its end."""
    n = len(begins) - 1
    result, length = np.full((n, 3, 3), np.inf), np.full(n, np.inf)
    done = np.zeros(n, np.bool_)
    result[origin], length[origin] = 0.0, 0.0
    heap = [(0.0, origin)]
    while heap:
        _, here = heapq.heappop(heap)
        if done[here]:
            continue
        done[here] = True
        for e in ways[begins[here] : begins[here + 1]]:
            forth = ends[e, 0] == here
            there = ends[e, 1] if forth else ends[e, 0]
            if done[there]:
                continue
            P = _carried(result[here], measured[e], _inverse(information[e]), forth)
            far = P[0, 0] + P[1, 1] + LEVER * LEVER * P[2, 2]
            if far < length[there]:
                length[there], result[there] = far, P
                heapq.heappush(heap, (far, there))
    return result


@kernel
def _carried(P, move, C, forth):
    """The covariance at the other end of an edge, whose own is C in its second's frame."""
    c, s = np.cos(move[2]), np.sin(move[2])
    x, y = move[0], move[1]
    if forth:
        return _congruent(c, s, s * x - c * y, c * x + s * y, P) + C
    return _congruent(c, -s, y, -x, P + C)


@kernel
def _congruent(c, s, u, v, P):
    """J P J' with J = [[c, s, u], [-s, c, v], [0, 0, 1]]."""
    half, result = np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        half[0, k] = c * P[0, k] + s * P[1, k] + u * P[2, k]
        half[1, k] = -s * P[0, k] + c * P[1, k] + v * P[2, k]
        half[2, k] = P[2, k]
    for k in range(3):
        result[k, 0] = c * half[k, 0] + s * half[k, 1] + u * half[k, 2]
        result[k, 1] = -s * half[k, 0] + c * half[k, 1] + v * half[k, 2]
        result[k, 2] = half[k, 2]
    return result


@kernel
def _inverse(information):
    """Of a symmetric (3, 3) matrix that LEAST is added to, by Cramer's rule."""
    a, b, c = (
        information[0, 0] + LEAST[0],
        information[1, 1] + LEAST[1],
        information[2, 2] + LEAST[2],
    )
    f, h, k = information[0, 1], information[0, 2], information[1, 2]
    result = np.empty((3, 3))
    result[0, 0], result[1, 1], result[2, 2] = b * c - k * k, a * c - h * h, a * b - f * f
    result[0, 1] = result[1, 0] = k * h - f * c
    result[0, 2] = result[2, 0] = f * k - b * h
    result[1, 2] = result[2, 1] = f * h - a * k
    return result / (a * result[0, 0] + f * result[0, 1] + h * result[0, 2])
