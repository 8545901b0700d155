"""Correlative search: the best pose of a grid around the prediction, refined (Olson 2009)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Posterior
from slam.kernel import kernel
from slam.maps.tiles import AREA
from slam.motion.gaussian import log_density, with_errors
from slam.search.candidates import likeliest
from slam.search.gauss_newton import GaussNewton, ascended_field
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive

FEW = 16  # candidates of which all are evaluated in full: a floor would cost more than it saves
MAX_REACH = (0.5, 0.5, math.pi)  # m, m, rad, of the search: farther, the odometry has jumped
PRECISION = 0.0005  # m and rad, of the climb; registration, which follows, has one of its own


@dataclass(frozen=True)
class Correlative:
    """Exhaustive search of the poses that the motion model makes likely, so that no peak is missed.

    In the field of an `Endpoint` candidates are compared by the cells that the echoes lie in, and
    those that are close to the best one then on the interpolated field (`candidates.likeliest`).

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
        model = posterior.sensor_model
        alone = type(self.refine) is GaussNewton and self.refine.levels == 1
        if not (isinstance(model, Endpoint) and alone):
            return self.refine.climb(posterior, self.best(posterior))
        return Pose2(*_refined_in_field(
            self._spacing, posterior.prediction.gaussian, posterior.scan.points, model.samples,
            self.refine.limits,
        ))  # fmt: skip

    def best(self, posterior: Posterior) -> Pose2:
        """The candidate with the largest posterior, the first of equal ones; in the field of an
        `Endpoint` as of `candidates.likeliest`."""
        model, prediction = posterior.sensor_model, posterior.prediction
        if not isinstance(model, Endpoint):
            errors, _ = _candidates(prediction.deviations, *self._spacing)
            return _exhaustive(posterior, prediction.poses(errors))
        points = posterior.scan.points
        return Pose2(*_best_in_field(self._spacing, prediction.gaussian, points, model.samples))

    @property
    def _spacing(self) -> tuple[float, float, float]:
        return self.step, self.turn, self.reach


def _exhaustive(posterior: Posterior, poses: Array) -> Pose2:
    """The best of all candidates (n, 3); few of them are worth more than the predicted pose."""
    middle = len(poses) // 2
    floor = posterior(poses[middle : middle + 1])[0] if len(poses) > FEW else -math.inf
    return Pose2.of(poses[posterior(poses, floor).argmax()])


@kernel
def _candidates(deviations, step, turn, reach):
    """(n, 3) errors of all candidates, heading outermost, and the number of those of a heading.

    deviations         of the motion, see `Prediction`
    step, turn, reach  see `Correlative`
    """
    xs = _ticks(min(reach * deviations[0], MAX_REACH[0]), step)
    ys = _ticks(min(reach * deviations[1], MAX_REACH[1]), step)
    turns = _ticks(min(reach * deviations[2], MAX_REACH[2]), turn)
    errors = np.empty((len(turns) * len(xs) * len(ys), 3))
    n = 0
    for t in turns:
        for x in xs:
            for y in ys:
                errors[n, 0], errors[n, 1], errors[n, 2] = x, y, t
                n += 1
    return errors, len(xs) * len(ys)


@kernel
def _ticks(reach, step):
    """Multiples of `step`: every place within `reach` of zero is at most step / 2 from one."""
    n = max(np.int64(np.ceil(reach / step - 0.5)), 0)
    return np.arange(-n, n + 1) * step


@kernel
def _best_in_field(spacing, prior, points, samples):
    """The best candidate in the field of an `Endpoint`.

    spacing  step, turn and reach, see `Correlative`
    prior    see `Prediction.gaussian`
    samples  see `Endpoint.samples`
    """
    errors, group = _candidates(prior[2], *spacing)
    poses = with_errors(errors, prior[0], prior[1])
    best = likeliest(poses, log_density(poses, *prior), group, points, *samples)
    return poses[best, 0], poses[best, 1], poses[best, 2]


@kernel
def _refined_in_field(spacing, prior, points, samples, limits):
    """The best candidate, refined: `_best_in_field` and `ascended_field`, in one call."""
    index, field, origin, resolution, _, _, beta = samples
    reading = index, field.reshape(-1, AREA), origin, resolution, 0, beta
    start = _best_in_field(spacing, prior, points, samples)
    return ascended_field(start, points, reading, prior, limits)[0]
