"""The directions of the surfaces that the echoes of one scan lie on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel
from slam.scan import Scan

REACH = 0.1  # m from an echo up to which its neighbours are fitted by a line
MAX_GAP = 0.5  # m between neighbouring echoes of one line
MAX_RESIDUAL = 0.02  # m, standard deviation of the echoes' distances from their line
MIN_LENGTH = 0.08  # m from the first echo of a line to the last
MIN_ECHOES = 3  # of a line
CENTRED = (
    0.7  # by which the residual of a line is multiplied that reaches to both sides of its echo
)
NEAR = 0.3  # m to the nearer neighbour, up to which an echo without a line counts as a point
NOTHING, POINT, LINE = 0, 1, 2  # kinds of an echo


class Outline(NamedTuple):
    """The echoes of a scan in the robot's frame, and what they lie on.

    points    (n, 2) m
    tangents  (n, 2) unit vectors along the surface; zero where it is not known
    kind      (n,) uint8: LINE: on a line with its neighbours. POINT: an echo of something small, or
              at a corner. NOTHING: a lone echo at a grazing angle, which tells of no place
    """

    points: Array
    tangents: Array
    kind: np.ndarray


def outline(points: Array) -> Outline:
    """The outline of echoes (n, 2), m, in the order of the beams.

    The line of an echo is fitted to the neighbours within REACH on both sides, or on one side if
    that fits better, as at a corner. Neighbours farther apart, up to MAX_GAP, are used where there
    are none within REACH: at a grazing angle echoes of one wall are half a metre apart.
    """
    return Outline(points, *_outline(points))


def outlined(scan: Scan) -> Outline:
    """The outline of a scan, kept with it like its cached properties: that of a keyframe is needed
    when it is matched, when it is drawn, and when the next local map begins with it."""
    kept = vars(scan)
    if "outline" not in kept:
        kept["outline"] = outline(scan.points)
    return kept["outline"]


@kernel(error_model="numpy")
def _outline(points):
    n = len(points)
    tangents, kind = np.zeros((n, 2)), np.zeros(n, np.uint8)
    sums = _sums(points)
    for i in range(n):
        low, high = _end(points, i, -1), _end(points, i, 1)
        best, along, apart, xy = np.inf, 0.0, 1.0, 0.0
        for first, last in ((low, high), (low, i), (i, high)):
            echoes, square = last - first + 1, _squared_distance(points, first, last)
            if echoes < MIN_ECHOES or square < MIN_LENGTH**2:
                continue
            square, line = _fitted(sums, first, last)
            ranked = square * CENTRED**2 if first < i < last else square
            if square <= MAX_RESIDUAL**2 and ranked < best:
                best, (along, apart, xy), kind[i] = ranked, line, LINE
        if kind[i] == LINE:
            c = along / max(apart, 1e-12)  # of twice the angle
            tangents[i, 0] = math.sqrt(max(0.5 * (1.0 + c), 0.0))
            tangents[i, 1] = math.copysign(math.sqrt(max(0.5 * (1.0 - c), 0.0)), xy)
        elif _is_point(points, i):
            kind[i] = POINT
    return tangents, kind


@kernel
def _sums(points):
    """(n + 1, 5) sums of x, y, x^2, x y and y^2 over the echoes before each."""
    sums = np.zeros((len(points) + 1, 5))
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        for m, value in enumerate((x, y, x * x, x * y, y * y)):
            sums[k + 1, m] = sums[k, m] + value
    return sums


@kernel(error_model="numpy")
def _end(points, i, step):
    """The last echo from echo `i` on, in steps of 1 or -1, that a line through `i` is fitted to."""
    k = i
    while 0 <= k + step < len(points):
        if _squared_distance(points, k, k + step) > MAX_GAP**2:
            break
        if k != i and _squared_distance(points, i, k + step) > REACH**2:
            break
        k += step
    return k


@kernel(error_model="numpy")
def _fitted(sums, first, last):
    """The line through echoes `first` to `last`, by least squares: the variance of their distances
    from it; and (d cos 2a, d, d sin 2a), where `a` is its angle, and d > 0."""
    n = last - first + 1
    x, y = (sums[last + 1, 0] - sums[first, 0]) / n, (sums[last + 1, 1] - sums[first, 1]) / n
    xx = sums[last + 1, 2] - sums[first, 2] - n * x * x
    xy = sums[last + 1, 3] - sums[first, 3] - n * x * y
    yy = sums[last + 1, 4] - sums[first, 4] - n * y * y
    along = 0.5 * (xx - yy)
    apart = math.sqrt(along * along + xy * xy)
    return max(0.5 * (xx + yy) - apart, 0.0) / (n - 2), (along, apart, xy)


@kernel(error_model="numpy")
def _is_point(points, i):
    """Whether an echo without a line has a neighbour near by, or lies before both of them."""
    before = _squared_distance(points, i, i - 1) if i > 0 else np.inf
    after = _squared_distance(points, i, i + 1) if i < len(points) - 1 else np.inf
    if min(before, after) <= NEAR**2:
        return True
    if i == 0 or i == len(points) - 1:
        return False
    return _squared_range(points, i) < min(
        _squared_range(points, i - 1), _squared_range(points, i + 1)
    )


@kernel
def _squared_range(points, i):
    """The squared distance of an echo from the robot, m^2."""
    return points[i, 0] * points[i, 0] + points[i, 1] * points[i, 1]


@kernel(error_model="numpy")
def _squared_distance(points, i, k):
    """The squared distance between two echoes, m^2."""
    x, y = points[i, 0] - points[k, 0], points[i, 1] - points[k, 1]
    return x * x + y * y
