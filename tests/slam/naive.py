"""Slow, obvious references of the kernels of slam. Cells are (row, col) of the world's lattice."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise

import numpy as np

from slam.geometry import Pose2, transform_points
from slam.scan import Scan


def cast(pose: Pose2, angles, segments, max_range: float = math.inf) -> np.ndarray:
    """Range per beam from `pose`: the nearest segment (x1, y1, x2, y2); inf where there is none."""
    return np.array([_nearest(pose, pose.theta + angle, segments, max_range) for angle in angles])


def _nearest(pose, heading, segments, max_range):
    dx, dy = math.cos(heading), math.sin(heading)
    nearest = math.inf
    for x1, y1, x2, y2 in segments:
        ex, ey, ox, oy = x2 - x1, y2 - y1, x1 - pose.x, y1 - pose.y
        across = dx * ey - dy * ex
        if across == 0:
            continue
        r, t = (ox * ey - oy * ex) / across, (ox * dy - oy * dx) / across
        if r > 0 and 0 <= t <= 1:
            nearest = min(nearest, r)
    return nearest if nearest < max_range else math.inf


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


def beams(scan: Scan, pose: Pose2, reach: float, no_echo_reach: float):
    """The sensor, and (end, hit) of each beam that is believed."""
    sensor = pose @ scan.mount
    result = []
    for r, angle in zip(scan.ranges, scan.angles, strict=True):
        if math.isnan(r) or r < scan.min_range or r <= 0:
            continue
        if r >= scan.max_range:
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


def temporal(history, delta_t, bins, hit=0.85, free=-0.4, prior=0.2, weight=0.1):
    """{cell: (h, histogram)} from every window that ever was, none forgotten (eq. 6 and 9)."""
    start = math.log(prior / (1 - prior))
    windows: dict = defaultdict(lambda: defaultdict(lambda: start))
    for time, cells in history:
        for at, occupied in cells.items():
            windows[at][math.floor(time / delta_t)] += hit if occupied else free
    result = {}
    for at, sums in windows.items():
        histogram = [0] * bins
        for log_odds in sums.values():
            histogram[min(int(bins / (1 + math.exp(-log_odds))), bins - 1)] += 1
        occupied = sum(n * b / (bins - 1) for b, n in enumerate(histogram))
        result[at] = (occupied + weight * prior) / (len(sums) + weight), histogram
    return result


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


def field(known, echoes, resolution, sigma, z_hit, z_rand) -> np.ndarray:
    """log(z_hit F + z_rand) at every cell's centre from (h, dx, dy) and where echoes were."""
    rows, cols = echoes.shape
    y, x = np.mgrid[:rows, :cols] * resolution
    best = known[..., 0].astype(float)
    for row, col in np.argwhere(echoes):
        h, dx, dy = known[row, col].astype(float)
        d2 = (col * resolution + dx - x) ** 2 + (row * resolution + dy - y) ** 2
        best = np.maximum(best, h * np.exp(-d2 / (2 * sigma**2)))
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
