"""Relative covariances of the poses of a graph, along the chain of least uncertainty."""

from __future__ import annotations

import heapq

import numpy as np

from slam.geometry import Array
from slam.graph.edges import Edges
from slam.kernel import kernel

LEVER = 5.0  # m by which an error of the heading, rad, is compared with one of the position
MIN_INFORMATION = np.array([1e-4, 1e-4, 1e-2])  # 1/m^2, 1/m^2, 1/rad^2: bounds the covariance
MIN_WEIGHT = 0.5  # of an edge to be used in a chain


def chained(
    n: int, edges: Edges, trust: Array, origin: int, information: Array | None = None
) -> Array:
    """(n, 3, 3) the covariance of each of n poses relative to pose `origin`, in the pose's frame.

    Errors are summed along the chain with the smallest sum: an upper bound, since other chains only
    add information (Bosse et al. 2004). Infinite for poses that no chain reaches.

    trust        (edges,) weights of the edges, from 0 to 1
    information  (edges, 3, 3) of the errors that are summed; None: that of the edges
    """
    links = np.flatnonzero(trust >= MIN_WEIGHT)
    begins, incident = _incidence(n, edges.ends, links)
    if information is None:
        information = edges.information
    return _shortest_paths(begins, incident, edges.ends, edges.measured, information, origin)


@kernel
def _incidence(n, ends, links):
    """The edges of `links` at each pose k: `incident[begins[k] : begins[k + 1]]`."""
    begins = np.zeros(n + 2, np.int64)
    for e in links:
        begins[ends[e, 0] + 2] += 1
        begins[ends[e, 1] + 2] += 1
    begins = np.cumsum(begins)
    incident = np.empty(2 * len(links), np.int64)
    for e in links:
        for k in range(2):
            here = ends[e, k] + 1
            incident[begins[here]] = e
            begins[here] += 1
    return begins[:-1], incident


@kernel
def _shortest_paths(begins, incident, ends, measured, information, origin):
    """Dijkstra's algorithm; the length of a path is the error at its end."""
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
        for e in incident[begins[here] : begins[here + 1]]:
            forth = ends[e, 0] == here
            there = ends[e, 1] if forth else ends[e, 0]
            if done[there]:
                continue
            P = _propagated(result[here], measured[e], _inverse(information[e]), forth)
            far = P[0, 0] + P[1, 1] + LEVER * LEVER * P[2, 2]
            if far < length[there]:
                length[there], result[there] = far, P
                heapq.heappush(heap, (far, there))
    return result


@kernel
def _propagated(P, move, C, forth):
    """The covariance at the other end of an edge of covariance C (in its second pose's frame)."""
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
    """The inverse of a symmetric (3, 3) matrix plus MIN_INFORMATION, by Cramer's rule."""
    a, b, c = (
        information[0, 0] + MIN_INFORMATION[0],
        information[1, 1] + MIN_INFORMATION[1],
        information[2, 2] + MIN_INFORMATION[2],
    )
    f, h, k = information[0, 1], information[0, 2], information[1, 2]
    result = np.empty((3, 3))
    result[0, 0], result[1, 1], result[2, 2] = b * c - k * k, a * c - h * h, a * b - f * f
    result[0, 1] = result[1, 0] = k * h - f * c
    result[0, 2] = result[2, 0] = f * k - b * h
    result[1, 2] = result[2, 1] = f * h - a * k
    return result / (a * result[0, 0] + f * result[0, 1] + h * result[0, 2])
