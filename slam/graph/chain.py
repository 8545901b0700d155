"""How far two poses of a graph may be off each other, along the surest chain of edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from slam.geometry import Array
from slam.graph.pose_graph import Edge

LEVER = 5.0  # m: what an error of the heading is worth beside one of the place
LEAST = np.diag([1e-4, 1e-4, 1e-2])  # 1/m^2, 1/rad^2: what is not known is not off without end
TRUSTED = 0.5  # of a loop's weight, from where on it is a link


def chained(n: int, edges: Sequence[Edge], trust: Array, origin: int) -> Array:
    """(n, 3, 3) the covariance of each of n poses as seen from pose `origin`, in the pose's frame.

    Errors add up along the chain that leaves the least of them: an upper bound, since other chains
    only add to what is known (Bosse et al. 2004). Infinite where no chain leads.
    """
    links = [edge for edge, weight in zip(edges, trust, strict=True) if weight >= TRUSTED]
    if not links:
        return np.where(np.arange(n)[:, None, None] == origin, 0.0, np.full((n, 3, 3), np.inf))
    ends = np.array([(edge.first, edge.second) for edge in links])
    moves = np.array([edge.displacement for edge in links])
    information = np.array([edge.information for edge in links]) + LEAST
    covariances = np.asarray(np.linalg.inv(information), dtype=np.float64)
    forth, back = _toward(moves, covariances)
    starts = np.concatenate([ends[:, 0], ends[:, 1]])
    order = np.argsort(starts, kind="stable")
    return _spread(
        np.searchsorted(starts[order], np.arange(n + 1)),
        np.concatenate([ends[:, 1], ends[:, 0]])[order],
        np.concatenate([forth, back])[order],
        np.concatenate([covariances, _turned(back, covariances)])[order],
        origin,
    )


def _toward(moves: Array, covariances: Array) -> tuple[Array, Array]:
    """(m, 3, 3) what an error in the first's frame becomes in the second's, and the other way."""
    c, s = np.cos(moves[:, 2]), np.sin(moves[:, 2])
    x, y = moves[:, 0], moves[:, 1]
    forth = np.zeros((len(moves), 3, 3))
    forth[:, 0] = np.column_stack([c, s, s * x - c * y])
    forth[:, 1] = np.column_stack([-s, c, c * x + s * y])
    forth[:, 2, 2] = 1.0
    return forth, np.asarray(np.linalg.inv(forth), dtype=np.float64)


def _turned(matrices: Array, covariances: Array) -> Array:
    return matrices @ covariances @ np.swapaxes(matrices, 1, 2)


@njit(cache=True)
def _spread(begins, ends, toward, covariances, origin):
    """Dijkstra's algorithm, the length of a way being the error at its end."""
    n = len(begins) - 1
    result, length = np.full((n, 3, 3), np.inf), np.full(n, np.inf)
    done = np.zeros(n, np.bool_)
    result[origin], length[origin] = 0.0, 0.0
    for _ in range(n):
        here, least = -1, np.inf
        for k in range(n):
            if not done[k] and length[k] < least:
                here, least = k, length[k]
        if here < 0:
            break
        done[here] = True
        for e in range(begins[here], begins[here + 1]):
            there = ends[e]
            if done[there]:
                continue
            J = toward[e]
            P = J @ result[here] @ J.T + covariances[e]
            far = P[0, 0] + P[1, 1] + LEVER * LEVER * P[2, 2]
            if far < length[there]:
                length[there], result[there] = far, P
    return result
