"""Correlative search: the best pose of a grid around the prediction, refined (Olson 2009)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Posterior
from slam.kernel import kernel
from slam.motion.gaussian import log_density, with_errors
from slam.search.candidates import likeliest
from slam.search.gauss_newton import GaussNewton, ascended_field
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive

FEW = 16  # candidates of which all are evaluated in full: a floor would cost more than it saves
MAX_EXHAUSTIVE = 100  # candidates up to which all are evaluated, without bounds
MAX_IN_FIELD = 2000  # the same in the field of an `Endpoint`, by one kernel
NODE_SIDE = 2  # candidates along the side of a node, which share a bound
FIRST_BATCH = 2  # nodes evaluated at first; then twice as many, and so on
ROUNDING = 1e-6  # added to bounds, which rounding errors could make too small
MAX_REACH = (0.5, 0.5, math.pi)  # m, m, rad, of the search: farther, the odometry has jumped
PRECISION = 0.0005  # m and rad, of the climb; registration, which follows, has one of its own
Axes = tuple[Array, Array, Array]  # turns, x, y: the ticks of the grid of candidates


@dataclass(frozen=True)
class Correlative:
    """Exhaustive search of the poses that the motion model makes likely, so that no peak is missed.

    By branch and bound (Hess et al. 2016): neighbouring candidates of one heading share an upper
    bound, and are evaluated only if it exceeds the best value found. The result is that of the
    exhaustive search.

    step, turn  m and rad between neighbouring candidates
    reach       half the width of the search window, in standard deviations of the motion
    refine      climbs from the best candidate to the local maximum
    """

    step: float = 0.05
    turn: float = math.radians(1.0)
    reach: float = 1.5
    refine: GaussNewton = field(default_factory=lambda: GaussNewton(levels=1, precision=PRECISION))

    def __post_init__(self) -> None:
        positive(self, "step", "turn", "reach")

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """The best candidate, refined."""
        model, axes = posterior.sensor_model, self._axes(posterior.prediction.deviations)
        alone = type(self.refine) is GaussNewton and self.refine.levels == 1
        if not (isinstance(model, Endpoint) and _few(axes) and alone):
            return self.refine.climb(posterior, self.best(posterior))
        return Pose2(*_refined_in_field(
            axes, posterior.prediction.gaussian, posterior.scan.points, model.samples,
            model.reading(0), self.refine.limits,
        ))  # fmt: skip

    def best(self, posterior: Posterior) -> Pose2:
        """The candidate with the largest posterior; the first of equal ones."""
        axes, model = self._axes(posterior.prediction.deviations), posterior.sensor_model
        if isinstance(model, Endpoint) and _few(axes):
            points, prior = posterior.scan.points, posterior.prediction.gaussian
            return Pose2(*_best_in_field(axes, prior, points, model.samples))
        few = _few(axes, MAX_EXHAUSTIVE)
        return _exhaustive(posterior, axes) if few else self._branch_and_bound(posterior, axes)

    def exhaustive(self, posterior: Posterior) -> Pose2:
        """The same as `best`, by evaluating every candidate."""
        return _exhaustive(posterior, self._axes(posterior.prediction.deviations))

    def _branch_and_bound(self, posterior: Posterior, axes: Axes) -> Pose2:
        prediction = posterior.prediction
        nodes, centres, bounds = _nodes(*axes, prediction.deviations)
        reach = math.sqrt(2.0) * 0.5 * (NODE_SIDE - 1) * self.step
        poses = prediction.poses(centres)
        bounds += posterior.sensor_model.bound(posterior.scan, poses, reach) + ROUNDING
        order = np.argsort(-bounds, kind="stable")
        nodes, bounds = nodes[order], bounds[order]
        best, pose, place, begin, size = -math.inf, poses[0], 0, 0, FIRST_BATCH
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
        x, y, turn = (
            min(self.reach * deviation, most)
            for deviation, most in zip(deviations.tolist(), MAX_REACH, strict=True)
        )
        return _ticks(turn, self.turn), _ticks(x, self.step), _ticks(y, self.step)


def _few(axes: Axes, most: int = MAX_IN_FIELD) -> bool:
    """Whether there are so many candidates at most."""
    return len(axes[0]) * len(axes[1]) * len(axes[2]) <= most


def _exhaustive(posterior: Posterior, axes: Axes) -> Pose2:
    poses = posterior.prediction.poses(_grid(*axes))
    middle = len(poses) // 2
    floor = posterior(poses[middle : middle + 1])[0] if len(poses) > FEW else -math.inf
    return Pose2.of(poses[posterior(poses, floor).argmax()])


def _ticks(reach: float, step: float) -> Array:
    """Multiples of `step`: every place within `reach` of zero is at most step / 2 from one."""
    return _multiples(max(math.ceil(reach / step - 0.5), 0), step)


@lru_cache
def _multiples(n: int, step: float) -> Array:
    """The multiples of `step` from -n to n; not to be written to."""
    return np.arange(-n, n + 1, dtype=np.float64) * step


@kernel
def _grid(turns, xs, ys):
    """(n, 3) errors of all candidates, heading outermost."""
    errors = np.empty((len(turns) * len(xs) * len(ys), 3))
    n = 0
    for t in turns:
        for x in xs:
            for y in ys:
                errors[n, 0], errors[n, 1], errors[n, 2] = x, y, t
                n += 1
    return errors


@kernel
def _best_in_field(axes, prior, points, samples):
    """The same as `_exhaustive`, compiled.

    prior    see `Prediction.gaussian`
    samples  see `Endpoint.samples`
    """
    poses = with_errors(_grid(*axes), prior[0], prior[1])
    group = len(axes[1]) * len(axes[2])
    best = likeliest(poses, log_density(poses, *prior), group, points, *samples)
    return poses[best, 0], poses[best, 1], poses[best, 2]


@kernel
def _refined_in_field(axes, prior, points, samples, reading, limits):
    """The best candidate, refined: `_best_in_field` and `ascended_field`, in one call."""
    start = _best_in_field(axes, prior, points, samples)
    return ascended_field(start, points, reading, prior, limits)[0]


@kernel
def _nodes(turns, xs, ys, deviations):
    """Nodes of NODE_SIDE x NODE_SIDE candidates of one heading.

    Returns (n, 3) the indices of turn, first x and first y of each, (n, 3) the errors at the
    centres, (n,) the largest log prior within.
    """
    wide, high = (len(xs) + NODE_SIDE - 1) // NODE_SIDE, (len(ys) + NODE_SIDE - 1) // NODE_SIDE
    n = len(turns) * wide * high
    nodes, centres, priors = np.empty((n, 3), np.int64), np.empty((n, 3)), np.empty(n)
    k = 0
    for t in range(len(turns)):
        for i in range(0, len(xs), NODE_SIDE):
            for j in range(0, len(ys), NODE_SIDE):
                x, y = xs[i : i + NODE_SIDE], ys[j : j + NODE_SIDE]
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
    """(m, 3) errors of all candidates in `nodes`, and (m,) their numbers in the full grid."""
    errors = np.empty((len(nodes) * NODE_SIDE * NODE_SIDE, 3))
    places = np.empty(len(errors), np.int64)
    n = 0
    for k in range(len(nodes)):
        t = nodes[k, 0]
        for i in range(nodes[k, 1], min(nodes[k, 1] + NODE_SIDE, len(xs))):
            for j in range(nodes[k, 2], min(nodes[k, 2] + NODE_SIDE, len(ys))):
                errors[n, 0], errors[n, 1], errors[n, 2] = xs[i], ys[j], turns[t]
                places[n] = (t * len(xs) + i) * len(ys) + j
                n += 1
    return errors[:n], places[:n]
