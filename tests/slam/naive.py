"""Slow, obvious references of the kernels of slam. Cells are (row, col) of the world's lattice."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from itertools import pairwise

import numpy as np

from slam.geometry import Pose2, transform_points
from slam.scan import Scan


def cast(pose: Pose2, angles, segments, max_range: float = math.inf) -> np.ndarray:
    """Range per beam from `pose`: the nearest segment (x1, y1, x2, y2); inf where there is none."""
    x1, y1, x2, y2 = np.asarray(segments, dtype=float).reshape(-1, 4).T
    ex, ey, ox, oy = x2 - x1, y2 - y1, x1 - pose.x, y1 - pose.y
    headings = [pose.theta + angle for angle in angles]
    dx, dy = (np.array([[f(h)] for h in headings]).reshape(-1, 1) for f in (math.cos, math.sin))
    across = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):  # of segments along the beam
        r, t = (ox * ey - oy * ex) / across, (ox * dy - oy * dx) / across
    hit = (across != 0) & (r > 0) & (t >= 0) & (t <= 1)
    nearest = np.where(hit, r, math.inf).min(axis=1, initial=math.inf)
    return np.where(nearest < max_range, nearest, math.inf)


def crossed(start, end, resolution: float) -> list[tuple[int, int]]:
    """Cells on the way from start to end: cut at every line of the lattice, ask each middle."""
    cuts = {0.0, 1.0}
    for a, b in zip(start, end, strict=True):
        low, high = sorted((a / resolution, b / resolution))
        for line in range(math.floor(low), math.ceil(high) + 1):
            if a != b and 0 < (line * resolution - a) / (b - a) < 1:
                cuts.add((line * resolution - a) / (b - a))
    middles = [(t0 + t1) / 2 for t0, t1 in pairwise(sorted(cuts)) if t1 - t0 > 1e-9]
    points = [[a + t * (b - a) for a, b in zip(start, end, strict=True)] for t in middles]
    return [cell(point, resolution) for point in points]


def touched(start, end, at: tuple[int, int], resolution: float) -> bool:
    """Whether the way from start to end comes within a nanometre of a cell."""
    low, high = 0.0, 1.0
    for a, b, index in zip(start, end, reversed(at), strict=True):
        left, right = index * resolution - 1e-9, (index + 1) * resolution + 1e-9
        if a == b:
            if not left <= a <= right:
                return False
            continue
        first, last = sorted(((left - a) / (b - a), (right - a) / (b - a)))
        low, high = max(low, first), min(high, last)
    return low <= high


def cell(point, resolution: float) -> tuple[int, int]:
    return math.floor(point[1] / resolution), math.floor(point[0] / resolution)


def clear(scan: Scan, k: int) -> bool:
    """Whether a beam without an echo is inside a long enough row of them."""
    kinds = "".join("-" if r >= scan.max_range else "x" if h else "?"
                    for r, h in zip(scan.ranges, scan.hit, strict=True))  # fmt: skip
    missed = len(re.findall("(?=x-x)", kinds)) / (1 + kinds[1:-1].count("x"))
    least = 3
    if missed:
        share = (1 - math.sqrt(max(1 - 4 * missed, 0))) / 2
        least = max(least, math.ceil(math.log(0.05 / len(kinds)) / math.log(share)))
    kinds = kinds[0] + kinds + kinds[-1]  # beyond the border it is the same
    if kinds[k : k + 3] != "---":
        return False
    begin, end = k, k
    while begin >= 0 and kinds[begin] == "-":
        begin -= 1
    while end < len(kinds) and kinds[end] == "-":
        end += 1
    return end - begin - 1 >= least


def beams(scan: Scan, pose: Pose2, reach: float, no_echo_reach: float):
    """The sensor, and (end, hit) of each beam that is believed."""
    sensor = pose @ scan.mount
    result = []
    for k, (r, angle) in enumerate(zip(scan.ranges, scan.angles, strict=True)):
        if math.isnan(r) or r < scan.min_range or r <= 0:
            continue
        if r >= scan.max_range:
            if not clear(scan, k):
                continue
            length, hit = min(no_echo_reach, scan.max_range), False
        else:
            length, hit = min(r, reach), r <= reach
        heading = sensor.theta + angle
        end = sensor.x + length * math.cos(heading), sensor.y + length * math.sin(heading)
        result.append((end, hit))
    return (sensor.x, sensor.y), result


def seen(scan: Scan, pose: Pose2, resolution: float, reach=30.0, no_echo_reach=8.0):
    """{cell: hit} of one scan; a hit outweighs the beams that pass."""
    sensor, ends = beams(scan, pose, reach, no_echo_reach)
    cells: dict[tuple[int, int], bool] = {}
    for end, hit in ends:
        for at in crossed(sensor, end, resolution):
            cells.setdefault(at, False)
        if hit:
            cells[cell(end, resolution)] = True
    return cells


def static(history, hit=0.85, free=-0.4, limit=math.inf, prior=0.2) -> dict[tuple[int, int], float]:
    """Log-odds per cell of a history [(time, {cell: hit})]."""
    start = math.log(prior / (1 - prior))
    log_odds: dict[tuple[int, int], float] = defaultdict(lambda: start)
    for _, cells in history:
        for at, occupied in cells.items():
            sum_ = log_odds[at] + (hit if occupied else free)
            log_odds[at] = max(-limit, min(limit, sum_))
    return log_odds


def windows(history, delta_t, hit=0.85, free=-0.4, prior=0.2) -> dict:
    """{cell: {window: log-odds}} of every window that ever was, none forgotten (eq. 6)."""
    start = math.log(prior / (1 - prior))
    result: dict = defaultdict(lambda: defaultdict(lambda: start))
    for time, cells in history:
        for at, occupied in cells.items():
            window = math.floor((time - history[0][0]) / delta_t)
            result[at][window] += hit if occupied else free
    return result


def temporal(history, delta_t, bins, hit=0.85, free=-0.4, prior=0.2, weight=0.1):
    """{cell: (h, histogram)} from every window that ever was, none forgotten (eq. 6 and 9)."""
    result = {}
    for at, sums in windows(history, delta_t, hit, free, prior).items():
        histogram = [0] * bins
        for log_odds in sums.values():
            histogram[min(int(bins * sigmoid(log_odds)), bins - 1)] += 1
        occupied = sum(n * b / (bins - 1) for b, n in enumerate(histogram))
        result[at] = (occupied + weight * prior) / (len(sums) + weight), histogram
    return result


def recency(history, scales, hit=0.85, free=-0.4, prior=0.2) -> dict[tuple[int, int], float]:
    """h per cell: the weight of every observation from its age when the cell was last seen."""
    evidence = defaultdict(list)
    for time, cells in history:
        for at, occupied in cells.items():
            evidence[at].append((time, hit if occupied else free))
    start = math.log(prior / (1 - prior))
    result = {}
    for at, all_of_it in evidence.items():
        now = all_of_it[-1][0]
        sums = [sum(e * math.exp((t - now) / scale) for t, e in all_of_it) for scale in scales]
        result[at] = sum(sigmoid(start + sum_) for sum_ in sums) / len(scales)
    return result


STEPS = 2**24


class Chain:
    """A cell of `maps.hmm`: states are 0 free and 1 occupied; None: not decided.

    margin  how close any decision so far was: rounding decides one that is too close
    """

    def __init__(self, changes: float, dwell: float, prior: float):
        self.p, self.at, self.state, self.margin = prior, None, None, math.inf
        self.seconds = [(1 - prior) * dwell, prior * dwell]
        self.changed = [changes, changes]  # closings, while free; openings, while occupied

    def see(self, time: float, ratio: float) -> None:
        gone = 0.0 if self.at is None else max(time - self.at, 0.0)
        closing, opening = self.rates
        step = np.eye(2) + self.generator * gone / STEPS
        distribution = np.array([1 - self.p, self.p]) @ np.linalg.matrix_power(step, STEPS)
        likelihood = np.array([1.0, ratio])
        self.p = (distribution * likelihood / (distribution @ likelihood))[1]
        forgotten = gone * (closing + opening)
        self.margin = min(self.margin, abs(self.p - 0.8), abs(self.p - 0.2), abs(forgotten - 1))
        if forgotten >= 1:
            self.state = None
        before, self.at = self.state, time
        if self.p > 0.8:
            self.state = 1
        elif self.p < 0.2:
            self.state = 0
        if before is not None:
            self.seconds[before] += gone
            self.changed[before] += self.state != before

    @property
    def rates(self) -> tuple[float, float]:
        """Closing and opening, 1/s."""
        return self.changed[0] / self.seconds[0], self.changed[1] / self.seconds[1]

    @property
    def generator(self) -> np.ndarray:
        closing, opening = self.rates
        return np.array([[-closing, closing], [opening, -opening]])


def hmm(history, changes, dwell, hit=0.85, free=-0.4, prior=0.2) -> dict[tuple[int, int], Chain]:
    """The chain of each cell, gone through in small steps of time."""
    chains: dict = defaultdict(lambda: Chain(changes, dwell, prior))
    for time, cells in history:
        for at, occupied in cells.items():
            chains[at].see(time, math.exp(hit if occupied else free))
    return chains


def filtered(history, sure, limit, hit=0.85, free=-0.4, prior=0.2):
    """{cell: (static log-odds, dynamic log-odds)} by the table of Wolf and Sukhatme (2005)."""
    start = math.log(prior / (1 - prior))
    grids: dict = defaultdict(lambda: (start, start))
    for _, cells in history:
        for at, occupied in cells.items():
            stays, moves = grids[at]
            surely_free = sigmoid(stays) < sure
            stays += hit if occupied and not surely_free else free
            moves += hit if occupied and surely_free else free
            grids[at] = stays, max(-limit, min(limit, moves))
    return grids


def hybrid(history, delta_t, bins, hit=0.85, free=-0.4, prior=0.2) -> dict[tuple[int, int], float]:
    """h per cell, from the whole static map and the whole history."""
    all_windows = windows(history, delta_t, hit, free, prior)
    means = temporal(history, delta_t, bins, hit, free, prior)
    result = {}
    for at, log_odds in static(history, hit, free, prior=prior).items():
        occupied_in = sum(sum_ > 0 for sum_ in all_windows[at].values())
        mean = means[at][0] if occupied_in >= 2 else 0.0
        result[at] = max(sigmoid(log_odds), mean)
    return result


def sigmoid(x: float) -> float:
    return 1 / (1 + math.exp(-x))


def centroids(history, resolution: float) -> dict[tuple[int, int], np.ndarray]:
    """Mean echo per cell, m from the cell's centre; history [(scan, pose)]."""
    echoes = defaultdict(list)
    for scan, pose in history:
        for point in transform_points(pose, scan.points):
            echoes[cell(point, resolution)].append(point)
    return {
        (row, col): np.mean(points, axis=0) - ((col + 0.5) * resolution, (row + 0.5) * resolution)
        for (row, col), points in echoes.items()
    }


def field(known, echoes, resolution, sigma, z_hit, z_rand, least=5 / 255) -> np.ndarray:
    """log(z_hit F + z_rand) at every cell's centre from (h, dx, dy) and where echoes were; a cell
    with echoes is `least` but for what stands in it. Beyond 8 sigma an echo adds 1e-14."""
    rows, cols = echoes.shape
    reach = math.ceil(8 * sigma / resolution) + 1
    y, x = np.mgrid[:rows, :cols] * resolution
    best = np.where(echoes, least, known[..., 0])
    for row, col in np.argwhere(echoes):
        h, dx, dy = known[row, col].astype(float)
        near = np.s_[max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1]
        d2 = (col * resolution + dx - x[near]) ** 2 + (row * resolution + dy - y[near]) ** 2
        best[near] = np.maximum(best[near], h * np.exp(-d2 / (2 * sigma**2)))
    return np.log(z_hit * best + z_rand)


def spline(field, x: float, y: float) -> float:
    """A quadratic B-spline with the field's values as coefficients; x, y in cells."""
    rows, cols = field.shape
    return sum(
        field[row, col] * _bump(y - row - 0.5) * _bump(x - col - 0.5)
        for row in range(max(int(y) - 2, 0), min(int(y) + 3, rows))
        for col in range(max(int(x) - 2, 0), min(int(x) + 3, cols))
    )


def _bump(t: float) -> float:
    if abs(t) <= 0.5:
        return 0.75 - t * t
    return (1.5 - abs(t)) ** 2 / 2 if abs(t) <= 1.5 else 0.0


def walls(occupied, offset, count) -> dict[tuple[int, int], float | None]:
    """{(row, col): heading of the wall, None where echoes lie on no line} of a dense map; offset in
    cells."""
    result = {}
    for row, col in np.argwhere((count > 0) & (occupied > np.float32(0.02))):
        points, weights = [], []
        own = offset[row, col] + (col, row)
        for r, c in np.argwhere(count > 0):
            if abs(r - row) <= 2 and abs(c - col) <= 2:
                points.append(offset[r, c] + (c, r) - own)
                weights.append(occupied[r, c] * math.exp(-(points[-1] @ points[-1]) / (2 * 1.5**2)))
        p, w = np.array(points), np.array(weights)
        mean = w @ p / w.sum()
        (thin, long), axes = np.linalg.eigh((p - mean).T @ ((p - mean) * w[:, None]))
        heading = math.atan2(axes[1, 1], axes[0, 1])
        straight = thin <= 0.25**2 * long and (thin + long) / 2 >= 0.05 * w.sum()
        result[row, col] = round(heading * 128 / math.pi) * math.pi / 128 if straight else None
    return result


def spans(start, heading: float, length: float):
    """((row, col), t0, t1) of the cells on the way, in units of cells."""
    end = start[0] + length * math.cos(heading), start[1] + length * math.sin(heading)
    cuts = {0.0, 1.0}
    for a, b in zip(start, end, strict=True):
        for line in range(math.floor(min(a, b)), math.ceil(max(a, b)) + 1):
            if a != b and 0 < (line - a) / (b - a) < 1:
                cuts.add((line - a) / (b - a))
    for t0, t1 in pairwise(sorted(cuts)):
        t = (t0 + t1) / 2
        x, y = (a + t * (b - a) for a, b in zip(start, end, strict=True))
        yield (math.floor(y), math.floor(x)), t0 * length, t1 * length


def first_hit(known, start, heading: float, z: float, sigma: float, spread: float, beyond: float):
    """Density of the range z, and probability of no hit before z; all in units of cells.

    known  {(row, col): (h, None or (x, y, heading or None) of the wall)}; elsewhere known[None]
    """
    dx, dy = math.cos(heading), math.sin(heading)
    survival, density = 1.0, 0.0
    for at, t0, t1 in spans(start, heading, z + beyond):
        h, wall = known.get(at, known[None])
        h = min(max(h, 0.02), 0.98)
        if wall is None:
            rate = -math.log1p(-h)
            steps = (np.arange(500) + 0.5) * (t1 - t0) / 500
            hits = survival * rate * np.exp(-rate * steps) * (t1 - t0) / 500
            density += hits @ _normal(t0 + steps - z, sigma)
            survival *= (1 - h) ** (t1 - t0)
            continue
        mx, my = wall[0] - start[0], wall[1] - start[1]
        r, s, share = mx * dx + my * dy, spread, None
        if wall[2] is not None:
            nx, ny = -math.sin(wall[2]), math.cos(wall[2])
            across = nx * dx + ny * dy
            if abs(across) > 0.02:
                r, s = (nx * mx + ny * my) / across, min(spread / abs(across), 0.3)
                share = (math.erf((t1 - r) / s / 2**0.5) - math.erf((t0 - r) / s / 2**0.5)) / 2
        stop = h * (float(t0 <= r <= t1) if share is None else share)
        density += survival * stop * _normal(r - z, math.hypot(sigma, s))
        survival *= (1 - stop) * 0.98 ** (t1 - t0)
    return density, survival


def _normal(x, sigma):
    return np.exp(-0.5 * (x / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)


def beam_reading(reading, grid, scan: Scan, pose: Pose2) -> float:
    """What `Beam` gives for a scan seen from a pose, beam by beam, cell by cell."""
    tiles, unit = grid.cells.tiles, 1 / grid.cells.tiles.resolution
    occupied, count = tiles.dense(grid.cells.occupied), tiles.dense(grid.cells.centroids.count)
    offset = tiles.dense(grid.cells.centroids.offset) / 65536
    known: dict = {None: (grid.cells.prior, None)}
    for (row, col), h in np.ndenumerate(occupied):
        known[row + tiles.row0, col + tiles.col0] = float(h), None
    for (row, col), heading in walls(occupied, offset, count).items():
        at = row + tiles.row0, col + tiles.col0
        x, y = offset[row, col] + (at[1] + 0.5, at[0] + 0.5)
        known[at] = known[at][0], (x, y, heading)
    rays, total = grid.cells.rays, 0.0
    (x, y), ends = beams(scan, pose, rays.reach, rays.no_echo_reach)
    for end, hit in ends:
        z, heading = math.hypot(end[0] - x, end[1] - y), math.atan2(end[1] - y, end[0] - x)
        density, survival = first_hit(
            known, (x * unit, y * unit), heading, z * unit, reading.sigma * unit,
            reading.spread * unit, 6.0 if hit else 0.0,
        )  # fmt: skip
        farthest = min(scan.max_range, rays.reach)
        if hit:
            total += math.log(reading.z_hit * density * unit + reading.z_rand / farthest)
        else:
            total += math.log(reading.z_hit * survival + reading.z_rand)
    return reading.beta * total


def literal_reading(reading, grid, scan: Scan, pose: Pose2) -> float:
    """What `Literal` gives: the map that the scan implies, cell by cell."""
    tiles, rays = grid.cells.tiles, grid.cells.rays
    occupied, total = tiles.dense(grid.cells.occupied), 0.0
    scan_seen = seen(scan, pose, tiles.resolution, rays.reach, rays.no_echo_reach)
    for (row, col), hit in scan_seen.items():
        r, c = row - tiles.row0, col - tiles.col0
        inside = 0 <= r < occupied.shape[0] and 0 <= c < occupied.shape[1]
        h = min(max(float(occupied[r, c]) if inside else grid.cells.prior, 0.02), 0.98)
        total += math.log(h if hit else 1 - h)
    return reading.beta * total


def outline(points) -> tuple[np.ndarray, np.ndarray]:
    """Tangents and kinds (0 nothing, 1 point, 2 line) of the echoes of a scan, one by one."""
    n = len(points)
    tangents, kinds = np.zeros((n, 2)), np.zeros(n, int)

    def apart(i: int, k: int) -> float:
        return math.dist(points[i], points[k]) if 0 <= i < n and 0 <= k < n else math.inf

    def end(i: int, step: int) -> int:
        k = i
        while apart(k, k + step) <= 0.5 and (k == i or apart(i, k + step) <= 0.1):
            k += step
        return k

    for i in range(n):
        low, high = end(i, -1), end(i, 1)
        found = []
        for first, last in ((low, high), (low, i), (i, high)):
            if last - first < 2 or apart(first, last) < 0.08:
                continue
            centred = points[first : last + 1] - np.mean(points[first : last + 1], axis=0)
            _, size, axes = np.linalg.svd(centred)
            residual = size[1] / math.sqrt(last - first - 1)
            if residual <= 0.02:
                found.append((residual * (0.7 if first < i < last else 1.0), -first, axes[0]))
        if found:
            tangents[i], kinds[i] = min(found, key=lambda one: one[0])[2], 2
        elif min(apart(i, i - 1), apart(i, i + 1)) <= 0.3:
            kinds[i] = 1
        elif 0 < i < n - 1:
            away = [math.hypot(*points[k]) for k in (i - 1, i, i + 1)]
            kinds[i] = int(away[1] < min(away[0], away[2]))
    return tangents, kinds


def pairs(seen, surfaces, cells, pose: Pose2, model) -> np.ndarray:
    """What each echo of an outline is compared with: see `Registration.pairs`."""
    tiles, result = cells.tiles, np.zeros((len(seen.points), 5))
    first, occupied = tiles.dense(surfaces.first), tiles.dense(cells.occupied)
    turn = transform_points(Pose2(0.0, 0.0, pose.theta), seen.tangents)
    for k, point in enumerate(transform_points(pose, seen.points)):
        row, col = cell(point, tiles.resolution)
        walls, spots = [], []
        for r in range(row - 1 - tiles.row0, row + 2 - tiles.row0):
            for c in range(col - 1 - tiles.col0, col + 2 - tiles.col0):
                number = first[r, c]
                while number:
                    x, y, ux, uy, _, _, count = surfaces.table[number]
                    h = min(max(float(occupied[r, c]), 0.02), 0.98) * count / (count + model.new)
                    away, along = point - (x, y), np.array([ux, uy])
                    number = surfaces.next[number]
                    if not along.any():
                        if np.abs(away).max() < 3 * model.point_sigma:
                            square = away @ away / model.point_sigma**2
                            spots.append((h * math.exp(-square / 2), x, y, h))
                    elif abs(along @ turn[k]) >= 0.92:
                        along = along * np.sign(along @ turn[k])
                        normal = np.array([-along[1], along[0]])
                        t, r_ = away @ along / tiles.resolution, away @ normal / model.sigma
                        if abs(t) < 3 and abs(r_) < 3:
                            w = h * math.exp(-(t * t + r_ * r_) / 2)
                            walls.append((w, normal, away @ normal, h))
        if seen.kind[k] == 0:
            continue
        if walls:
            total = sum(w for w, *_ in walls)
            normal = sum(w * n for w, n, *_ in walls)
            normal = np.asarray(normal) / np.linalg.norm(normal)
            off = sum(w * d for w, _, d, _ in walls) / total
            h = sum(w * h for w, _, _, h in walls) / total
            result[k] = 1.0, normal[0], normal[1], normal @ point - off, h
        elif spots:
            _, x, y, h = max(spots)
            result[k] = 2.0, x, y, 0.0, h
    return result


def registered(seen, paired, pose: Pose2, model) -> float:
    """Log-likelihood of the echoes of an outline, each compared with its pair."""
    total = 0.0
    for point, pair in zip(transform_points(pose, seen.points), paired, strict=True):
        if pair[0] == 1.0:
            square = (pair[1:3] @ point - pair[3]) ** 2 / model.sigma**2
            weight = model.beta
        elif pair[0] == 2.0:
            square = ((point - pair[1:3]) ** 2).sum() / model.point_sigma**2
            weight = model.point_beta
        else:
            continue
        total += weight * math.log(model.z_hit * pair[4] * math.exp(-square / 2) + model.z_rand)
    return total
