"""Expected information: how many bits a scan from somewhere would bring.

A ray learns the state of each cell that it reaches, and reaches one with the probability that all
cells before it are free: the gain of a beam model without noise, which Bourgault et al. (2002) and
Stachniss et al. (2005) maximise, taken in expectation over what the ray meets rather than by
sampling maps.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from slam.geometry import Array
from slam.kernel import kernel

RAYS = 120  # around a viewpoint
FAINT = 0.02  # a ray that gets no farther than with this probability ends
UNSEEN = 0.1  # probability that a cell of which nothing is known stops a ray: one in a metre
SETTLED = 0.02  # h so near to 0 or 1 counts as known: a wall is not looked at for its last bits


def entropy(beliefs: Beliefs) -> NDArray[np.float32]:
    """(rows, cols) bits that are not known of each cell: 1 where nothing was seen."""
    h = np.clip(beliefs.occupied, 1e-6, 1 - 1e-6)
    bits = -(h * np.log2(h) + (1 - h) * np.log2(1 - h))
    bits[(h < SETTLED) | (h > 1 - SETTLED)] = 0.0
    return np.where(beliefs.observed, bits, 1.0).astype(np.float32)


def expected_bits(
    beliefs: Beliefs,
    points: Array,
    field_of_view: float = math.pi,
    max_range: float = 8.0,
) -> tuple[Array, Array]:
    """Bits (n,) that a scan from each of the points (n, 2), m, brings, and the best headings (n,).

    field_of_view  rad; the heading, rad, is that which sees the most bits
    max_range      m
    """
    stops = np.where(beliefs.observed, beliefs.occupied, UNSEEN).astype(np.float32)
    bits = np.zeros((len(points), RAYS))
    lattice = points / beliefs.spec.resolution - (beliefs.spec.col0, beliefs.spec.row0)
    reach = int(max_range / beliefs.spec.resolution)
    _cast(lattice, stops, entropy(beliefs), reach, bits)
    return _best_window(bits, max(1, min(RAYS, round(RAYS * field_of_view / math.tau))))


def seen_around(beliefs: Beliefs, points: Array, max_range: float = 8.0) -> Array:
    """(n,) how many known cells are in sight from points (n, 2), m, to who turns round there.

    max_range  m
    """
    bits = np.zeros((len(points), RAYS))
    stops = np.where(beliefs.observed, beliefs.occupied, 1.0).astype(np.float32)
    lattice = points / beliefs.spec.resolution - (beliefs.spec.col0, beliefs.spec.row0)
    reach = int(max_range / beliefs.spec.resolution)
    _cast(lattice, stops, beliefs.observed.astype(np.float32), reach, bits)
    return bits.sum(axis=1)


def _best_window(bits: Array, width: int) -> tuple[Array, Array]:
    """The largest sums (n,) of `width` neighbouring rays of (n, RAYS), and where they look."""
    ahead = np.concatenate([bits, bits[:, :width]], axis=1).cumsum(axis=1)
    sums = ahead[:, width:] - ahead[:, :-width]  # ray k is in the window that begins after k - 1
    best = sums.argmax(axis=1)
    first = best + 1
    headings = (first + (width - 1) / 2) * (math.tau / RAYS)
    return sums[np.arange(len(bits)), best], np.remainder(headings + math.pi, math.tau) - math.pi


@kernel
def _cast(points, stops, entropy, reach, bits):
    """Write the bits (n, rays) of the rays from points (n, 2), x and y in cells.

    A cell counts once a viewpoint, for the first ray that meets it.
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
                    # beyond the map all is unknown
                    left = reach + 1 - s
                    total += open_so_far * (1.0 - (1.0 - UNSEEN) ** left) / UNSEEN
                    break
                if met[i, j] != v:
                    met[i, j] = v
                    total += open_so_far * entropy[i, j]
                open_so_far *= 1.0 - stops[i, j]
                if open_so_far < FAINT:
                    break
            bits[v, k] = total
