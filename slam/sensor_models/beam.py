"""Beam reading: what the laser met first (Moravec 1988; Thrun, Burgard, Fox 2005, 6.3)."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import MapModel, Slope
from slam.kernel import kernel
from slam.maps.tiles import MASK, SHIFT, TILE
from slam.scan import Scan
from slam.sensor_models import differences
from slam.validation import positive, whole

H_LOW, H_HIGH = 0.02, 0.98  # h is clipped to these
SHORT = 3
BLOCK = 1 << SHORT  # cells; side of the squares that a beam leaps through where they are even
BLOCKS = TILE // BLOCK
FAR = 1e30  # where a beam meets the border that it runs along
LOG_FREE, GONE = math.log1p(-H_LOW), -25.0  # log survival
UNEVEN, STALE = np.float32(1.0), np.float32(2.0)
ANGLES = 128  # directions of a wall, over half a turn
NO_WALL, DUE = 255, 254  # echoes that lie on no line; a direction to be found anew
NEAR = 2  # cells around, whose echoes say how a wall runs
WIDTH = 1.5  # cells, how fast their say falls off
FLAT = 0.25  # a wall is at most so thick for its length (standard deviations)
BEYOND = 4.5  # deviations: what lies farther behind an echo says nothing of it
WIDEST = 0.3  # cells, of a wall that is met at a grazing angle
GRAZING = 0.02  # sine of an angle at which no beam meets a wall
ROUNDING = 1e-6
NOTHING = 1e-9
GOLDEN = 0.6180339887  # parts a circle evenly, at whichever beam one stops
COS, SIN = np.cos(np.arange(ANGLES) * np.pi / ANGLES), np.sin(np.arange(ANGLES) * np.pi / ANGLES)


class Beam:
    """log p(z | s, h) = beta sum_k log p(z_k | s, h) over the beams k, m_t integrated out.

    With independent cells (equation 8) a beam's first hit is in cell c with probability
    h_c prod_{j<c} (1 - h_j), and its echo comes from there with Gaussian noise:

        p(z) = z_hit sum_c h_c prod_{j<c} (1 - h_j) N(z; r_c, sigma) + z_rand / max_range

    A beam without echo has z_hit prod_j (1 - h_j) + z_rand, as far as it is believed.

    Beams are a millimetre's business, cells are not. So a cell that gave echoes is hit where the
    beam meets its wall, the line through the centroid of its echoes that runs as those around lie;
    a beam that crosses the cell beside its wall is not stopped by it. A cell that gave none
    (unknown or free) is a fog, as dense everywhere: crossing l of its side it stops a beam with
    1 - (1 - h)^l. Even fog is crossed at a leap.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, noise of the ranges
    spread  m, how far off its line a wall may be
    z_hit   share of beams that the map explains
    z_rand  share of beams that may end anywhere
    stride  every so many-th beam is looked at
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
        self._map_model: MapModel | None = None

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Take notice of the `changed` cells (ids) of the map."""
        if map_model is not self._map_model:
            self._begin(map_model)
        cells, tiles = map_model.cells, map_model.cells.tiles
        _take_notice(
            changed, cells.occupied.flat, cells.centroids.offset.flat, cells.centroids.count.flat,
            self._passing.flat, self._wall.flat, self._even.values, tiles.places, tiles.corner,
            tiles.index,
        )  # fmt: skip

    def _begin(self, map_model: MapModel) -> None:
        """Layers for a map that was not read before: what is unknown takes the map's prior."""
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
        """(n,) log p(scan | pose, h) of the poses (n, 3); maybe -inf where it is below `floor`."""
        tiles, unit = self._tiles, 1 / self._tiles.resolution
        sensor, ends, hit = self._beams(scan)
        model = (self.sigma * unit, self.spread * unit, self.z_hit * unit,
                 self.z_rand / self._farthest(scan), self.z_hit, self.z_rand)  # fmt: skip
        maps = (
            tiles.index,
            self._passing.flat,
            self._wall.flat,
            self._even.values,
            self._offset.flat,
        )
        origin = tiles.origin[0] * unit, tiles.origin[1] * unit
        return self.beta * _sums(poses, sensor, ends, hit, origin, unit, maps, self._unknown, model,
                                 floor / self.beta - ROUNDING, self._tops(scan))  # fmt: skip

    def bound(self, scan: Scan, poses: Array, reach: float) -> Array:
        """(n,) what the scan would have if the map explained every beam: no more is known but by
        following the beams."""
        hit = self._beams(scan)[2]
        echo, none = self._tops(scan)
        return np.full(len(poses), self.beta * (echo * hit.sum() + none * (~hit).sum()))

    def _beams(self, scan: Scan) -> tuple[Array, Array, np.ndarray]:
        """Sensor, ends, and which are hits, in the robot's frame: as the map believes them."""
        sensor, ends, hit = self._rays.ends(scan, Pose2())
        order = np.argsort(np.arange(0, len(ends), self.stride) * GOLDEN % 1) * self.stride
        return sensor, ends[order], hit[order]

    def _farthest(self, scan: Scan) -> float:
        return min(scan.max_range, self._rays.reach)

    def _tops(self, scan: Scan) -> tuple[float, float]:
        """The most that log p can be, of a beam with an echo and of one without."""
        densest = self.z_hit / (math.sqrt(2 * math.pi) * self.sigma)
        echo = math.log(densest + self.z_rand / self._farthest(scan))
        return echo, math.log(self.z_hit + self.z_rand)

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature of the log-likelihood, by differences."""
        return differences.slope(lambda poses: self.log_likelihood(scan, poses), pose)


@kernel
def _take_notice(changed, occupied, offset, count, passing, wall, even, places, corner, index):
    """Bring up to date what beams look at.

    passing  (cells,) log(1 - h) of fog, -log(1 - h) of a cell that has a wall; written
    wall     (cells,) which way the wall runs, or NO_WALL; written
    even     (slots, BLOCKS^2) log(1 - h) of blocks of nothing but even fog, else UNEVEN; written
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
                    same = UNEVEN
                    break
        even[slot, block] = same
    _turn(changed, passing, wall, occupied, offset, count, places, corner, index)


@kernel
def _turn(changed, passing, wall, occupied, offset, count, places, corner, index):
    """Find anew which way the walls run within NEAR of changed cells that gave echoes."""
    most = 0
    for cell in changed:
        most += count[cell] > 0
    due = np.empty((most * (2 * NEAR + 1) ** 2, 3), np.int64)
    n = 0
    for cell in changed:
        if count[cell]:
            slot = cell >> (2 * SHIFT)
            row = ((places[slot, 0] - corner[0]) << SHIFT) + ((cell >> SHIFT) & MASK)
            col = ((places[slot, 1] - corner[1]) << SHIFT) + (cell & MASK)
            for r in range(row - NEAR, row + NEAR + 1):
                for c in range(col - NEAR, col + NEAR + 1):
                    near = _cell(index, r, c)
                    if near >= 0 and passing[near] > 0 and wall[near] != DUE:
                        wall[near] = DUE
                        due[n, 0], due[n, 1], due[n, 2] = near, r, c
                        n += 1
    for k in range(n):
        wall[due[k, 0]] = _direction(due[k, 1], due[k, 2], occupied, offset, count, index)


@kernel
def _direction(row, col, occupied, offset, count, index):
    """Which way the wall of a cell runs: along the echoes of the cells around."""
    w = sx = sy = sxx = sxy = syy = 0.0
    cell = _cell(index, row, col)
    x0, y0 = offset[cell, 0] / 65536.0, offset[cell, 1] / 65536.0
    for r in range(-NEAR, NEAR + 1):
        for c in range(-NEAR, NEAR + 1):
            cell = _cell(index, row + r, col + c)
            if cell >= 0 and count[cell]:
                x, y = c + offset[cell, 0] / 65536.0 - x0, r + offset[cell, 1] / 65536.0 - y0
                h = occupied[cell] * np.exp(-(x * x + y * y) / (2 * WIDTH * WIDTH))
                w += h
                sx += h * x
                sy += h * y
                sxx += h * x * x
                sxy += h * x * y
                syy += h * y * y
    xx, xy, yy = sxx - sx * sx / w, sxy - sx * sy / w, syy - sy * sy / w
    mean, apart = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    if mean - apart > FLAT * FLAT * (mean + apart) or mean < 0.05 * w:
        return NO_WALL
    return np.int64(np.round(0.5 * np.arctan2(2 * xy, xx - yy) * (ANGLES / np.pi))) % ANGLES


@kernel
def _sums(poses, sensor, ends, hit, origin, unit, maps, unknown, model, floor, tops):
    """(n,) sum of log p of the beams as seen from each pose; -inf where it cannot reach `floor`."""
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
            density, survival = _follow(x0, y0, dx / z, dy / z, z, hit[k], maps, unknown, model)
            if hit[k]:
                total += np.log(model[2] * density + model[3])
                rest -= tops[0]
            else:
                total += np.log(model[4] * survival + model[5])
                rest -= tops[1]
            if total + rest < floor:
                total = -np.inf
                break
        result[n] = total
    return result


@kernel
def _follow(x0, y0, dx, dy, z, hit, maps, unknown, model):
    """Density of a first hit that gives the range z, and the probability of none up to there.

    In units of cells; (dx, dy) is a unit vector, t the way so far, log_s the log survival.
    """
    index, passing, wall, even, offset = maps
    sigma, spread = model[0], model[1]
    around = BEYOND * np.sqrt(sigma * sigma + WIDEST * WIDEST) if hit else 0.0
    last, close = z + around, BEYOND * sigma if hit else -np.inf
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    inv_x, inv_y = 1.0 / dx if dx != 0 else FAR, 1.0 / dy if dy != 0 else FAR
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    ahead_x, ahead_y = (1 if dx > 0 else 0), (1 if dy > 0 else 0)
    col, row = np.int64(np.floor(x0)), np.int64(np.floor(y0))
    t, log_s, density = 0.0, 0.0, 0.0
    while t < last and log_s > GONE:
        left, low = col & -BLOCK, row & -BLOCK
        fog, slot = unknown, np.int64(0)
        if 0 <= row < rows and 0 <= col < cols:
            slot = np.int64(index[row >> SHIFT, col >> SHIFT])
            fog = even[slot, ((row & MASK) >> SHORT) * BLOCKS + ((col & MASK) >> SHORT)]
        if fog <= 0:  # a leap
            out_x = (left + BLOCK * ahead_x - x0) * inv_x if dx != 0 else FAR
            out_y = (low + BLOCK * ahead_y - y0) * inv_y if dy != 0 else FAR
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
        next_x = (col + ahead_x - x0) * inv_x if dx != 0 else FAR
        next_y = (row + ahead_y - y0) * inv_y if dy != 0 else FAR
        base = (slot << (2 * SHIFT)) + ((low & MASK) << SHIFT) + (left & MASK)
        r, c = row - low, col - left
        while r | c == (r | c) & (BLOCK - 1) and t < last:
            cell = base + (r << SHIFT) + c
            fog = passing[cell]
            out = min(next_x, next_y)
            if fog > 0:
                mx = left + c + 0.5 + offset[cell, 0] / 65536.0 - x0
                my = low + r + 0.5 + offset[cell, 1] / 65536.0 - y0
                hit_at, s, share = _meet(mx, my, dx, dy, wall[cell], spread, t, out)
                stop = share * -np.expm1(-fog)
                if stop > NOTHING:
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
def _meet(mx, my, dx, dy, wall, spread, t, out):
    """Where a beam meets a wall through (mx, my), how sure that is, and the share of it that lies
    between t and out, in the cell."""
    if wall != NO_WALL:
        nx, ny = -SIN[wall], COS[wall]
        across = nx * dx + ny * dy
        if abs(across) > GRAZING:
            r, s = (nx * mx + ny * my) / across, min(spread / abs(across), WIDEST)
            return r, s, _below((out - r) / s) - _below((t - r) / s)
    r = mx * dx + my * dy
    return r, spread, 1.0 if t <= r <= out else 0.0


@kernel
def _fogged(rate, a, b, z, sigma, log_s):
    """Density at z of a first hit between a and b in fog of so many hits per cell."""
    mean = z - rate * sigma * sigma
    share = _below((b - mean) / sigma) - _below((a - mean) / sigma)
    return rate * np.exp(log_s - rate * (z - a) + 0.5 * (rate * sigma) ** 2) * share


@kernel
def _below(x):
    """Share of a normal distribution below x."""
    return 0.5 * (1.0 + math.erf(x * 0.7071067811865476))


@kernel
def _cell(index, row, col):
    """The id of a cell; -1 outside of the map."""
    r, c = row >> SHIFT, col >> SHIFT
    if not (0 <= r < index.shape[0] and 0 <= c < index.shape[1]):
        return -1
    return (index[r, c] << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)
