"""Beam sensor model: the first hit along each beam (Moravec 1988; Thrun et al. 2005, 6.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import MapModel, Slope
from slam.kernel import kernel
from slam.maps.tiles import MASK, SHIFT, TILE
from slam.scan import Scan
from slam.sensor_models import differences
from slam.sensor_models.blocks import BLOCK, BLOCKS
from slam.validation import positive, whole

H_LOW, H_HIGH = 0.02, 0.98  # h is clipped to these
BLOCK_SHIFT = BLOCK.bit_length() - 1
NO_CROSSING = 1e30  # cells, distance to a border that a beam runs parallel to
LOG_FREE = math.log1p(-H_LOW)
MIN_LOG_SURVIVAL = -25.0  # a beam is followed down to this probability of not having hit
MIXED, STALE = np.float32(1.0), np.float32(2.0)  # blocks of different cells; to be computed again
ANGLES = 128  # directions of a wall, over half a turn
NO_WALL, STALE_WALL = 255, 254  # echoes that lie on no line; a direction to be computed again
WALL_RADIUS = 2  # cells around a cell whose echoes its wall is fitted to
WALL_SIGMA = 1.5  # cells, of the Gaussian weight of those echoes
MAX_THICKNESS = 0.25  # of a wall by its length, both standard deviations
SHARPNESS = 0.35  # at beta 1, see `SensorModel`
MAX_DEVIATIONS = 4.5  # sigmas from an echo beyond which a hit has no density
MAX_SPREAD = 0.3  # cells, of a wall met at a grazing angle
MIN_SINE = 0.02  # of the angle between beam and wall below which they do not meet
ROUNDING = 1e-6
MIN_STOP = 1e-9  # probability of a hit in a cell below which it is neglected
GOLDEN = 0.6180339887  # golden ratio: any first part of the beams is spread evenly
COS, SIN = np.cos(np.arange(ANGLES) * np.pi / ANGLES), np.sin(np.arange(ANGLES) * np.pi / ANGLES)


class BeamMap(NamedTuple):
    """The arrays that beams are traced through; flat layers, see `_update`.

    tile_index  (tile rows, tile columns) `Tiles.index`
    passing     (cells,)
    wall        (cells,)
    even        (slots, BLOCKS^2)
    offset      (cells, 2) of the centroids
    unknown     log(1 - h) outside of the map
    """

    tile_index: np.ndarray
    passing: np.ndarray
    wall: np.ndarray
    even: np.ndarray
    offset: np.ndarray
    unknown: float


class BeamParameters(NamedTuple):
    """The parameters of a `Beam`; lengths and densities in cells.

    hit_weight    z_hit cells per m, the weight of a density per cell
    rand_density  per m, density of an echo that the map does not explain
    """

    sigma: float
    spread: float
    hit_weight: float
    rand_density: float
    z_hit: float
    z_rand: float


class Beam:
    """log p(z | s, h) = beta sum_k log p(z_k | s, h) over the beams k, m_t integrated out.

    With independent cells (equation 8) a beam's first hit is in cell c with probability
    h_c prod_{j<c} (1 - h_j), and its echo comes from there with Gaussian noise:

        p(z) = z_hit sum_c h_c prod_{j<c} (1 - h_j) N(z; r_c, sigma) + z_rand / max_range

    A beam without echo has z_hit prod_j (1 - h_j) + z_rand, up to `Rays.no_echo_reach`.

    Ranges are more exact than cells. So a cell with echoes is hit where the beam meets its wall:
    the line through the centroid of its echoes, in the direction fitted to the centroids around. A
    beam that crosses the cell beside its wall is not stopped by it. A cell without echoes (unknown
    or free) is a fog of uniform density: over a length of l cells it stops a beam with probability
    1 - (1 - h)^l. Blocks of uniform fog are crossed in one step.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, noise of the ranges
    spread  m, standard deviation of a wall's distance from its line
    z_hit   share of beams that the map explains
    z_rand  share of beams that may end anywhere
    stride  every stride-th beam is used
    """

    levels = 1

    def __init__(
        self,
        beta: float = 0.2,
        sigma: float = 0.012,
        spread: float = 0.003,
        z_hit: float = 0.95,
        z_rand: float = 0.05,
        stride: int = 1,
    ):
        self.beta = beta
        self.sigma = sigma
        self.spread = spread
        self.z_hit = z_hit
        self.z_rand = z_rand
        self.stride = stride
        positive(self, "beta", "sigma", "spread", "z_hit", "z_rand")
        whole(self, "stride", 1)
        self.sharpness = SHARPNESS / beta
        self._map_model: MapModel | None = None

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Update the layers for the `changed` cells (ids) of the map."""
        if map_model is not self._map_model:
            self._begin(map_model)
        cells, tiles = map_model.cells, map_model.cells.tiles
        _update(
            changed, cells.occupied.flat, cells.centroids.offset.flat, cells.centroids.count.flat,
            self._passing.flat, self._wall.flat, self._even.values, tiles.places, tiles.corner,
            tiles.index,
        )  # fmt: skip

    def _begin(self, map_model: MapModel) -> None:
        """Add the layers for a new map; unknown cells have the map's prior."""
        self._map_model, self._tiles, self._rays = (
            map_model,
            map_model.cells.tiles,
            map_model.cells.rays,
        )
        self._offset = map_model.cells.centroids.offset
        self._unknown = math.log1p(-min(max(map_model.cells.prior, H_LOW), H_HIGH))
        self._passing = self._tiles.layer(np.float32, self._unknown)
        self._wall = self._tiles.layer(np.uint8, NO_WALL)
        self._even = self._tiles.layer(np.float32, self._unknown, (BLOCKS**2,))

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3); may be -inf where below `floor`."""
        tiles, unit = self._tiles, 1 / self._tiles.resolution
        sensor, ends, hit = self._beams(scan)
        parameters = BeamParameters(
            self.sigma * unit,
            self.spread * unit,
            self.z_hit * unit,
            self.z_rand / self._max_range(scan),
            self.z_hit,
            self.z_rand,
        )
        beam_map = BeamMap(
            tiles.index,
            self._passing.flat,
            self._wall.flat,
            self._even.values,
            self._offset.flat,
            self._unknown,
        )
        origin = tiles.origin[0] * unit, tiles.origin[1] * unit
        return self.beta * _sums(poses, sensor, ends, hit, origin, unit, beam_map, parameters,
                                 floor / self.beta - ROUNDING, self._tops(scan))  # fmt: skip

    def _beams(self, scan: Scan) -> tuple[Array, Array, np.ndarray]:
        """Sensor, end points (robot's frame) and which are hits, limited by the map's `Rays`."""
        sensor, ends, hit = self._rays.ends(scan, Pose2())
        order = np.argsort(np.arange(0, len(ends), self.stride) * GOLDEN % 1) * self.stride
        return sensor, ends[order], hit[order]

    def _max_range(self, scan: Scan) -> float:
        return min(scan.max_range, self._rays.reach)

    def _tops(self, scan: Scan) -> tuple[float, float]:
        """The maximum of log p of a beam with an echo, and of one without."""
        densest = self.z_hit / (math.sqrt(2 * math.pi) * self.sigma)
        echo = math.log(densest + self.z_rand / self._max_range(scan))
        return echo, math.log(self.z_hit + self.z_rand)

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature of the log-likelihood, by central differences."""
        return differences.slope(lambda poses: self.log_likelihood(scan, poses), pose)


@kernel
def _update(changed, occupied, offset, count, passing, wall, even, places, corner, index):
    """Update the layers that beams are traced through.

    passing  (cells,) log(1 - h) of fog, -log(1 - h) of a cell that has a wall; written
    wall     (cells,) direction of the wall, as a number below ANGLES, or NO_WALL; written
    even     (slots, BLOCKS^2) log(1 - h) of blocks of uniform fog, else MIXED; written
    """
    low, high = np.float32(H_LOW), np.float32(H_HIGH)
    blocks = np.empty((len(changed), 2), np.int64)
    n = 0
    for cell in changed:
        h = min(max(occupied[cell], low), high)
        pass_ = np.float32(np.log1p(-h))
        solid = h > low and count[cell]
        passing[cell] = -pass_ if solid else pass_
        slot = cell >> (2 * SHIFT)
        block = ((cell >> SHIFT) & MASK) // BLOCK * BLOCKS + (cell & MASK) // BLOCK
        if even[slot, block] != STALE:
            even[slot, block] = STALE
            blocks[n, 0], blocks[n, 1] = slot, block
            n += 1
    for k in range(n):
        slot, block = blocks[k]
        first = (slot << (2 * SHIFT)) + (block // BLOCKS << SHIFT) * BLOCK + block % BLOCKS * BLOCK
        same = passing[first]
        for r in range(BLOCK):
            for c in range(BLOCK):
                if passing[first + r * TILE + c] != same or passing[first + r * TILE + c] > 0:
                    same = MIXED
                    break
        even[slot, block] = same
    _update_walls(changed, passing, wall, occupied, offset, count, places, corner, index)


@kernel
def _update_walls(changed, passing, wall, occupied, offset, count, places, corner, index):
    """Compute the directions of the walls within WALL_RADIUS of changed cells with echoes."""
    echoes = 0
    for cell in changed:
        echoes += count[cell] > 0
    due = np.empty((echoes * (2 * WALL_RADIUS + 1) ** 2, 3), np.int64)
    n = 0
    for cell in changed:
        if count[cell]:
            slot = cell >> (2 * SHIFT)
            row = ((places[slot, 0] - corner[0]) << SHIFT) + ((cell >> SHIFT) & MASK)
            col = ((places[slot, 1] - corner[1]) << SHIFT) + (cell & MASK)
            for r in range(row - WALL_RADIUS, row + WALL_RADIUS + 1):
                for c in range(col - WALL_RADIUS, col + WALL_RADIUS + 1):
                    near = _cell(index, r, c)
                    if near >= 0 and passing[near] > 0 and wall[near] != STALE_WALL:
                        wall[near] = STALE_WALL
                        due[n, 0], due[n, 1], due[n, 2] = near, r, c
                        n += 1
    for k in range(n):
        wall[due[k, 0]] = _direction(due[k, 1], due[k, 2], occupied, offset, count, index)


@kernel
def _direction(row, col, occupied, offset, count, index):
    """The direction of the wall of a cell, fitted to the centroids of the cells around."""
    w = sx = sy = sxx = sxy = syy = 0.0
    cell = _cell(index, row, col)
    x0, y0 = offset[cell, 0] / 65536.0, offset[cell, 1] / 65536.0
    for r in range(-WALL_RADIUS, WALL_RADIUS + 1):
        for c in range(-WALL_RADIUS, WALL_RADIUS + 1):
            cell = _cell(index, row + r, col + c)
            if cell >= 0 and count[cell]:
                x, y = c + offset[cell, 0] / 65536.0 - x0, r + offset[cell, 1] / 65536.0 - y0
                h = occupied[cell] * np.exp(-(x * x + y * y) / (2 * WALL_SIGMA * WALL_SIGMA))
                w += h
                sx += h * x
                sy += h * y
                sxx += h * x * x
                sxy += h * x * y
                syy += h * y * y
    xx, xy, yy = sxx - sx * sx / w, sxy - sx * sy / w, syy - sy * sy / w
    mean, apart = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    if mean - apart > MAX_THICKNESS * MAX_THICKNESS * (mean + apart) or mean < 0.05 * w:
        return NO_WALL
    return np.int64(np.round(0.5 * np.arctan2(2 * xy, xx - yy) * (ANGLES / np.pi))) % ANGLES


@kernel
def _sums(
    poses, sensor, ends, hit, origin, unit, beam_map: BeamMap, parameters: BeamParameters, floor,
    tops,
):  # fmt: skip
    """(n,) sum of log p of the beams for each pose (n, 3); -inf if it cannot reach `floor`.

    unit  cells per m; tops  the maximum of log p of a beam with an echo, and of one without
    """
    echoes = hit.sum()
    result = np.empty(len(poses))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]) * unit, np.sin(poses[n, 2]) * unit
        x0 = poses[n, 0] * unit - origin[0] + c * sensor[0] - s * sensor[1]
        y0 = poses[n, 1] * unit - origin[1] + s * sensor[0] + c * sensor[1]
        total, rest = 0.0, echoes * tops[0] + (len(hit) - echoes) * tops[1]
        for k in range(len(ends)):
            dx, dy = ends[k, 0] - sensor[0], ends[k, 1] - sensor[1]
            dx, dy = c * dx - s * dy, s * dx + c * dy
            z = max(np.sqrt(dx * dx + dy * dy), 1e-12)
            density, survival = _follow(x0, y0, dx / z, dy / z, z, hit[k], beam_map, parameters)
            if hit[k]:
                total += np.log(parameters.hit_weight * density + parameters.rand_density)
                rest -= tops[0]
            else:
                total += np.log(parameters.z_hit * survival + parameters.z_rand)
                rest -= tops[1]
            if total + rest < floor:
                total = -np.inf
                break
        result[n] = total
    return result


@kernel
def _follow(x0, y0, dx, dy, z, hit, beam_map: BeamMap, parameters: BeamParameters):
    """Density of a first hit that gives the range z, and the probability of no hit up to there.

    In units of cells; (dx, dy) is a unit vector, t the distance so far, log_s the log survival.
    """
    tile_index, passing, wall, even, offset, unknown = beam_map
    sigma, spread = parameters.sigma, parameters.spread
    around = MAX_DEVIATIONS * np.sqrt(sigma * sigma + MAX_SPREAD * MAX_SPREAD) if hit else 0.0
    last, close = z + around, MAX_DEVIATIONS * sigma if hit else -np.inf
    rows, cols = tile_index.shape[0] << SHIFT, tile_index.shape[1] << SHIFT
    inv_x, inv_y = 1.0 / dx if dx != 0 else NO_CROSSING, 1.0 / dy if dy != 0 else NO_CROSSING
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    ahead_x, ahead_y = (1 if dx > 0 else 0), (1 if dy > 0 else 0)
    col, row = np.int64(np.floor(x0)), np.int64(np.floor(y0))
    t, log_s, density = 0.0, 0.0, 0.0
    while t < last and log_s > MIN_LOG_SURVIVAL:
        left, low = col & -BLOCK, row & -BLOCK
        fog, slot = unknown, np.int64(0)
        if 0 <= row < rows and 0 <= col < cols:
            slot = np.int64(tile_index[row >> SHIFT, col >> SHIFT])
            fog = even[slot, ((row & MASK) >> BLOCK_SHIFT) * BLOCKS + ((col & MASK) >> BLOCK_SHIFT)]
        if fog <= 0:  # the whole block at once
            out_x = (left + BLOCK * ahead_x - x0) * inv_x if dx != 0 else NO_CROSSING
            out_y = (low + BLOCK * ahead_y - y0) * inv_y if dy != 0 else NO_CROSSING
            out = max(min(out_x, out_y), t)
            if out > z - close and t < z + close:
                density += _fogged(-fog, t, min(out, last), z, sigma, log_s)
            log_s += fog * (min(out, last) - t)
            t = out
            if out_x < out_y:
                col = left + BLOCK if dx > 0 else left - 1
                row = min(max(np.int64(np.floor(y0 + out * dy)), low), low + BLOCK - 1)
            else:
                row = low + BLOCK if dy > 0 else low - 1
                col = min(max(np.int64(np.floor(x0 + out * dx)), left), left + BLOCK - 1)
            continue
        next_x = (col + ahead_x - x0) * inv_x if dx != 0 else NO_CROSSING
        next_y = (row + ahead_y - y0) * inv_y if dy != 0 else NO_CROSSING
        base = (slot << (2 * SHIFT)) + ((low & MASK) << SHIFT) + (left & MASK)
        r, c = row - low, col - left
        while r | c == (r | c) & (BLOCK - 1) and t < last:
            cell = base + (r << SHIFT) + c
            fog = passing[cell]
            out = min(next_x, next_y)
            if fog > 0:
                mx = left + c + 0.5 + offset[cell, 0] / 65536.0 - x0
                my = low + r + 0.5 + offset[cell, 1] / 65536.0 - y0
                hit_at, s, share = _meet_wall(mx, my, dx, dy, wall[cell], spread, t, out)
                stop = share * -np.expm1(-fog)
                if stop > MIN_STOP:
                    if abs(z - hit_at) < around:
                        v = sigma * sigma + s * s
                        near = np.exp(log_s - 0.5 * (z - hit_at) ** 2 / v)
                        density += stop * near / np.sqrt(2 * np.pi * v)
                    log_s += np.log1p(-stop)
                fog = LOG_FREE
            elif out > z - close and t < z + close:
                density += _fogged(-fog, t, min(out, last), z, sigma, log_s)
            log_s += fog * (min(out, last) - t)
            t = out
            if next_x < next_y:
                next_x += abs(inv_x)
                c += step_x
            else:
                next_y += abs(inv_y)
                r += step_y
        row, col = low + r, left + c
    return density, np.exp(log_s)


@kernel
def _meet_wall(mx, my, dx, dy, wall, spread, t, out):
    """Distance at which a beam meets a wall through (mx, my), its standard deviation, and the
    probability that it lies between t and out, in the cell."""
    if wall != NO_WALL:
        nx, ny = -SIN[wall], COS[wall]
        across = nx * dx + ny * dy
        if abs(across) > MIN_SINE:
            r, s = (nx * mx + ny * my) / across, min(spread / abs(across), MAX_SPREAD)
            return r, s, _normal_cdf((out - r) / s) - _normal_cdf((t - r) / s)
    r = mx * dx + my * dy
    return r, spread, 1.0 if t <= r <= out else 0.0


@kernel
def _fogged(rate, a, b, z, sigma, log_s):
    """Density at z of a first hit between a and b in fog of density `rate`, hits per cell."""
    mean = z - rate * sigma * sigma
    share = _normal_cdf((b - mean) / sigma) - _normal_cdf((a - mean) / sigma)
    return rate * np.exp(log_s - rate * (z - a) + 0.5 * (rate * sigma) ** 2) * share


@kernel
def _normal_cdf(x):
    """Cumulative distribution function of the standard normal distribution."""
    return 0.5 * (1.0 + math.erf(x * 0.7071067811865476))


@kernel
def _cell(index, row, col):
    """The id of a cell; -1 outside of the map."""
    r, c = row >> SHIFT, col >> SHIFT
    if not (0 <= r < index.shape[0] and 0 <= c < index.shape[1]):
        return -1
    return (index[r, c] << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)
