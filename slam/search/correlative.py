"""Correlative search: every pose of a grid around the odometry's, then refined (Olson 2009)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Posterior
from slam.kernel import kernel
from slam.search.gauss_newton import GaussNewton
from slam.validation import positive

FEW = 100  # candidates, which are looked at one and all
SIDE = 2  # candidates side by side that share a bound
BATCH = 2  # nodes that are looked into at first, then twice as many, and so on
ROUNDING = 1e-6  # so that no bound is missed by a rounding error
Axes = tuple[Array, Array, Array]  # turns, x, y: the ticks of the grid of candidates
FARTHEST = (0.5, 0.5, math.pi)  # m, m, rad: beyond it a leap of the odometry is no motion


@dataclass(frozen=True)
class Correlative:
    """Exhaustive over what the motion model makes likely, so that no peak is missed.

    Nothing that cannot be the best is looked at: candidates of one heading that lie side by side
    share a bound from above (branch and bound, Hess et al. 2016), and are only evaluated while it
    exceeds the best found. The result is that of the exhaustive search.

    step, turn  m and rad between neighbouring candidates
    reach       how many standard deviations of the motion are searched
    refine      climbs from the best candidate to the top of its peak
    """

    step: float = 0.05
    turn: float = math.radians(1.0)
    reach: float = 1.5
    refine: GaussNewton = field(default_factory=lambda: GaussNewton(levels=1))

    def __post_init__(self) -> None:
        positive(self, "step", "turn", "reach")

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """The best candidate, refined."""
        return self.refine.climb(posterior, self.best(posterior))

    def best(self, posterior: Posterior) -> Pose2:
        """The candidate at which the posterior is largest; of equals the first."""
        axes = self._axes(posterior.prediction.deviations)
        few = math.prod(len(axis) for axis in axes) <= FEW
        return _exhaustive(posterior, axes) if few else self._branch_and_bound(posterior, axes)

    def exhaustive(self, posterior: Posterior) -> Pose2:
        """What `best` gives, by looking at every candidate."""
        return _exhaustive(posterior, self._axes(posterior.prediction.deviations))

    def _branch_and_bound(self, posterior: Posterior, axes: Axes) -> Pose2:
        prediction = posterior.prediction
        nodes, centres, bounds = _nodes(*axes, prediction.deviations)
        reach = math.sqrt(2.0) * 0.5 * (SIDE - 1) * self.step
        poses = prediction.poses(centres)
        bounds += posterior.sensor_model.bound(posterior.scan, poses, reach) + ROUNDING
        order = np.argsort(-bounds, kind="stable")
        nodes, bounds = nodes[order], bounds[order]
        best, pose, place, begin, size = -math.inf, poses[0], 0, 0, BATCH
        while begin < len(nodes) and bounds[begin] >= best:
            end = min(begin + size, int(np.searchsorted(-bounds, -best, side="right")))
            errors, places = _children(nodes[begin:end], *axes)
            poses = prediction.poses(errors)
            values = posterior(poses, best)
            k = np.lexsort((places, -values))[0]
            if values[k] > best or (values[k] == best and places[k] < place):
                best, pose, place = values[k], poses[k], places[k]
            begin, size = end, 2 * size
        return Pose2.of(pose)

    def _axes(self, deviations: Array) -> Axes:
        x, y, turn = np.minimum(self.reach * deviations, FARTHEST).tolist()
        return _ticks(turn, self.turn), _ticks(x, self.step), _ticks(y, self.step)


def _exhaustive(posterior: Posterior, axes: Axes) -> Pose2:
    poses = posterior.prediction.poses(_grid(*axes))
    return Pose2.of(poses[posterior(poses).argmax()])


def _ticks(reach: float, step: float) -> Array:
    """Every place up to `reach` from zero is half a step at most from a tick."""
    n = max(math.ceil(reach / step - 0.5), 0)
    return np.arange(-n, n + 1, dtype=np.float64) * step


@kernel
def _grid(turns, xs, ys):
    """(n, 3) errors of all candidates, in the order of their places: heading outermost."""
    errors = np.empty((len(turns) * len(xs) * len(ys), 3))
    n = 0
    for t in turns:
        for x in xs:
            for y in ys:
                errors[n, 0], errors[n, 1], errors[n, 2] = x, y, t
                n += 1
    return errors


@kernel
def _nodes(turns, xs, ys, deviations):
    """Squares of SIDE x SIDE candidates of one heading: (n, 3) turn and first x and y of each,
    (n, 3) the errors at their middles, (n,) the largest log prior within."""
    wide, high = (len(xs) + SIDE - 1) // SIDE, (len(ys) + SIDE - 1) // SIDE
    n = len(turns) * wide * high
    nodes, centres, priors = np.empty((n, 3), np.int64), np.empty((n, 3)), np.empty(n)
    k = 0
    for t in range(len(turns)):
        for i in range(0, len(xs), SIDE):
            for j in range(0, len(ys), SIDE):
                x, y = xs[i : i + SIDE], ys[j : j + SIDE]
                nodes[k, 0], nodes[k, 1], nodes[k, 2] = t, i, j
                centres[k, 0] = 0.5 * (x[0] + x[-1])
                centres[k, 1] = 0.5 * (y[0] + y[-1])
                centres[k, 2] = turns[t]
                least_x, least_y = np.abs(x).min() / deviations[0], np.abs(y).min() / deviations[1]
                turned = turns[t] / deviations[2]
                priors[k] = -0.5 * (least_x * least_x + least_y * least_y + turned * turned)
                k += 1
    return nodes, centres, priors


@kernel
def _children(nodes, turns, xs, ys):
    """(m, 3) errors of all candidates in some nodes, and (m,) their places in the full grid."""
    errors = np.empty((len(nodes) * SIDE * SIDE, 3))
    places = np.empty(len(errors), np.int64)
    n = 0
    for k in range(len(nodes)):
        t = nodes[k, 0]
        for i in range(nodes[k, 1], min(nodes[k, 1] + SIDE, len(xs))):
            for j in range(nodes[k, 2], min(nodes[k, 2] + SIDE, len(ys))):
                errors[n, 0], errors[n, 1], errors[n, 2] = xs[i], ys[j], turns[t]
                places[n] = (t * len(xs) + i) * len(ys) + j
                n += 1
    return errors[:n], places[:n]
