"""Expected information gain, in bits, of a scan from a given point.

A ray observes the state of each cell that it reaches, and reaches a cell with the probability that
all cells before it are free: the gain of a beam model without noise that Bourgault et al. (2002)
and Stachniss et al. (2005) maximise, as an expectation instead of by sampling maps.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from slam.geometry import Array
from slam.kernel import kernel

RAYS = 120  # of a viewpoint, over the full circle
MIN_RAY_PROBABILITY = 0.02  # a ray ends where it arrives with less
UNSEEN_OCCUPANCY = 0.1  # P(an unobserved cell stops a ray): about one in a metre
CERTAIN_OCCUPANCY = 0.02  # h this near to 0 or 1 has no entropy: walls are not worth a visit


def entropy(beliefs: Beliefs) -> NDArray[np.float32]:
    """(rows, cols) bits, entropy of each cell; 1 if it was never observed."""
    h = np.clip(beliefs.occupied, 1e-6, 1 - 1e-6)
    bits = -(h * np.log2(h) + (1 - h) * np.log2(1 - h))
    bits[(h < CERTAIN_OCCUPANCY) | (h > 1 - CERTAIN_OCCUPANCY)] = 0.0
    return np.where(beliefs.observed, bits, 1.0).astype(np.float32)


def expected_bits(
    beliefs: Beliefs,
    points: Array,
    field_of_view: float = math.pi,
    max_range: float = 8.0,
) -> tuple[Array, Array]:
    """Expected bits (n,) of a scan from each of the points (n, 2), m, and the best headings (n,).

    field_of_view  rad; the best heading, rad, is that of the most bits
    max_range      m
    """
    stops = np.where(beliefs.observed, beliefs.occupied, UNSEEN_OCCUPANCY).astype(np.float32)
    bits = np.zeros((len(points), RAYS))
    lattice = points / beliefs.spec.resolution - (beliefs.spec.col0, beliefs.spec.row0)
    reach = int(max_range / beliefs.spec.resolution)
    _cast(lattice, stops, entropy(beliefs), reach, bits)
    return _best_window(bits, max(1, min(RAYS, round(RAYS * field_of_view / math.tau))))


def seen_around(beliefs: Beliefs, points: Array, max_range: float = 8.0) -> Array:
    """(n,) expected number of observed cells in a full turn at points (n, 2), m.

    max_range  m
    """
    bits = np.zeros((len(points), RAYS))
    stops = np.where(beliefs.observed, beliefs.occupied, 1.0).astype(np.float32)
    lattice = points / beliefs.spec.resolution - (beliefs.spec.col0, beliefs.spec.row0)
    reach = int(max_range / beliefs.spec.resolution)
    _cast(lattice, stops, beliefs.observed.astype(np.float32), reach, bits)
    return bits.sum(axis=1)


def _best_window(bits: Array, width: int) -> tuple[Array, Array]:
    """The largest sums (n,) of `width` neighbouring rays of (n, RAYS), and their headings (n,)."""
    ahead = np.concatenate([bits, bits[:, :width]], axis=1).cumsum(axis=1)
    sums = ahead[:, width:] - ahead[:, :-width]  # window k begins at ray k + 1
    best = sums.argmax(axis=1)
    first = best + 1
    headings = (first + (width - 1) / 2) * (math.tau / RAYS)
    return sums[np.arange(len(bits)), best], np.remainder(headings + math.pi, math.tau) - math.pi


@kernel
def _cast(points, stops, entropy, reach, bits):
    """Write the bits (n, rays) of the rays from points (n, 2), x and y in cells.

    A cell counts once a viewpoint, for the first ray that crosses it.
    """
    rows, cols = stops.shape
    rays = bits.shape[1]
    met = np.full((rows, cols), -1, dtype=np.int32)
    for v in range(len(points)):
        for k in range(rays):
            angle = k * math.tau / rays
            dx, dy = math.cos(angle), math.sin(angle)
            open_so_far, total = 1.0, 0.0
            for s in range(1, reach + 1):
                i = int(np.floor(points[v, 1] + s * dy))
                j = int(np.floor(points[v, 0] + s * dx))
                if i < 0 or i >= rows or j < 0 or j >= cols:
                    # beyond the map all cells are unobserved
                    left = reach + 1 - s
                    total += (
                        open_so_far * (1.0 - (1.0 - UNSEEN_OCCUPANCY) ** left) / UNSEEN_OCCUPANCY
                    )
                    break
                if met[i, j] != v:
                    met[i, j] = v
                    total += open_so_far * entropy[i, j]
                open_so_far *= 1.0 - stops[i, j]
                if open_so_far < MIN_RAY_PROBABILITY:
                    break
            bits[v, k] = total
