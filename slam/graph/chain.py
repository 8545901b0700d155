"""Relative covariances of the poses of a graph, along the chain of least uncertainty."""

from __future__ import annotations

import heapq

import numpy as np

from slam.geometry import Array
from slam.graph.covariance import carried, carried_back, covariance_of, size
from slam.graph.edges import Edges
from slam.kernel import kernel

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
            C = covariance_of(information[e])
            if forth:
                P = carried(result[here], measured[e]) + C
            else:
                P = carried_back(result[here] + C, measured[e])
            far = size(P)
            if far < length[there]:
                length[there], result[there] = far, P
                heapq.heappush(heap, (far, there))
    return result
