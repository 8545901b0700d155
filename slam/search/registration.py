"""Registration: a matched pose refined on the surfaces of the map (Segal et al. 2009, GICP)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.outline import NOTHING, Outline
from slam.maps.surfaces import COUNT, NONE, SAME, TX, TY, Surfaces, X, Y
from slam.maps.tiles import SHIFT
from slam.motion.gaussian import Prediction
from slam.sensor_models.blocks import cell_at
from slam.validation import positive, whole

CUT = 3.0  # standard deviations beyond which a surface is not an echo's
AROUND = 1  # cells around that of an echo whose surfaces may be its own
H_MIN, H_MAX = 0.02, 0.98  # limits of h
SHARPER = 1.5  # the information of echoes, by the curvature of their likelihood: chosen such that
# errors in the built-in worlds are as large as claimed, with `pose_covariance.SHARPNESS`
PLANE, SPOT = 1.0, 2.0  # what an echo is compared with


class EchoModel(NamedTuple):
    """The log-likelihood of an echo: beta log(z_hit h exp(-d^2 / 2 sigma^2) + z_rand).

    sigma        m, standard deviation of an echo's distance d to its wall
    beta         weight of an echo on a wall, since echoes are not independent given a map
    point_sigma  m, likewise of its distance to a point
    point_beta   weight of an echo at a point
    z_hit        share of echoes that the map explains
    z_rand       likelihood of an echo that it does not explain, by that of one on its wall: the
                 larger, the closer an echo must lie to count
    new          echoes: a surface of n echoes counts as n / (n + new) of one long known, so that
                 the leaf of a door that moves does not take the robot along
    """

    sigma: float = 0.02
    beta: float = 0.3
    point_sigma: float = 0.04
    point_beta: float = 0.3
    z_hit: float = 0.9
    z_rand: float = 0.3
    new: float = 3.0


ECHO = EchoModel()


@dataclass(frozen=True)
class Registration:
    """Newton steps on the distances of a scan's echoes to the surfaces of the map.

    Where on its wall an echo lies says nothing of the pose: only the distance along the wall's
    normal counts, and only surfaces of the echo's own direction are compared with it. In a
    likelihood field an echo attracts the next ones from all sides: on walls seen at a grazing angle
    each scan is drawn to the last one. The distance to a wall is the mean of those to its surfaces
    in the cells around, weighted by h; echoes at corners and on small things are compared with
    points.

    model      of an echo
    rounds     maximum; in each, echoes are paired anew with surfaces
    steps      maximum of a round
    precision  m and rad; a shorter step is the last
    farthest   m from the start, beyond which a result is refused
    paired     least share of the echoes that must lie on known walls: where a map has few echoes,
               as of a robot that scans each metre, most of the scan would not count
    """

    model: EchoModel = ECHO
    rounds: int = 5
    steps: int = 2
    precision: float = 0.0005
    farthest: float = 0.1
    paired: float = 0.7

    def __post_init__(self) -> None:
        positive(self.model, *EchoModel._fields)
        positive(self, "precision", "farthest", "paired")
        whole(self, "rounds", 1)
        whole(self, "steps", 1)

    def __call__(
        self,
        outline: Outline,
        surfaces: Surfaces,
        cells: Cells,
        prediction: Prediction,
        start: Pose2,
    ) -> tuple[Pose2, Array] | None:
        """The pose, and the information (3, 3) of the echoes about it: x, y and theta, world; None
        if it cannot be told from them.

        `cells` are those of the map that the surfaces belong to.
        """
        pose, information = start, np.zeros((3, 3))
        for _ in range(self.rounds):
            pairs = self.pairs(outline, surfaces, cells, pose)
            if (pairs[:, 0] == PLANE).sum() < self.paired * len(pairs):
                return None
            _, slope, bend = prediction.slope(pose)
            moved, information = _climbed(outline.points, pairs, np.array(pose), slope, bend,
                                          self.model, self.steps, self.precision)  # fmt: skip
            short = np.abs(moved).max() < self.precision
            pose = _plus(pose, moved)
            if short:
                break
        near = math.dist(pose[:2], start[:2]) <= self.farthest
        return (pose, SHARPER * information) if near else None

    def pairs(self, outline: Outline, surfaces: Surfaces, cells: Cells, pose: Pose2) -> Array:
        """(n, 5) what each echo is compared with: PLANE, its normal (2,), its distance from the
        origin along the normal, h; or SPOT, x, y, 0, h; zeros if with nothing."""
        tiles = cells.tiles
        where = np.array([*tiles.origin, tiles.resolution])
        return _paired(outline, np.array(pose), where, tiles.index, cells.occupied.flat,
                       surfaces.first.flat, surfaces.table, surfaces.next, self.model)  # fmt: skip


SURFACES = Registration()  # the default


def _plus(pose: Pose2, step: Array) -> Pose2:
    x, y, theta = step.tolist()
    return Pose2(pose.x + x, pose.y + y, math.remainder(pose.theta + theta, math.tau))


@kernel
def _paired(
    outline: Outline, pose, where, index, occupied, first, table, following, model: EchoModel
):
    points = outline.points
    pairs = np.zeros((len(points), 5))
    rows, cols = (index.shape[0] << SHIFT) - AROUND, (index.shape[1] << SHIFT) - AROUND
    c, s, scale = np.cos(pose[2]), np.sin(pose[2]), 1.0 / where[2]
    for k in range(len(points)):
        if outline.kind[k] == NOTHING:
            continue
        x = pose[0] + c * points[k, 0] - s * points[k, 1]
        y = pose[1] + s * points[k, 0] + c * points[k, 1]
        row, col = int((y - where[1]) * scale), int((x - where[0]) * scale)
        if not (AROUND <= row < rows and AROUND <= col < cols):
            continue
        tx = c * outline.tangents[k, 0] - s * outline.tangents[k, 1]
        ty = s * outline.tangents[k, 0] + c * outline.tangents[k, 1]
        total = nx = ny = off = mean = best = 0.0
        for i in range(row - AROUND, row + AROUND + 1):
            for j in range(col - AROUND, col + AROUND + 1):
                cell = cell_at(index, i, j)
                surface = first[cell]
                while surface != NONE:
                    known = table[surface, COUNT] / (table[surface, COUNT] + model.new)
                    h = known * min(max(occupied[cell], H_MIN), H_MAX)
                    dx, dy = x - table[surface, X], y - table[surface, Y]
                    ux, uy = table[surface, TX], table[surface, TY]
                    along = ux * tx + uy * ty
                    if ux == 0.0 and uy == 0.0:
                        w = h * _falloff(dx / model.point_sigma, dy / model.point_sigma)
                        if w > best:
                            best = w
                            pairs[k] = (SPOT, x - dx, y - dy, 0.0, h)
                    elif abs(along) >= SAME:
                        r, sign = dy * ux - dx * uy, np.copysign(1.0, along)
                        w = h * _falloff((dx * ux + dy * uy) * scale, r / model.sigma)
                        total, mean, off = total + w, mean + w * h, off + sign * w * r
                        nx, ny = nx - sign * w * uy, ny + sign * w * ux
                    surface = following[surface]
        if total > 0.0:
            length = np.hypot(nx, ny)
            nx, ny = nx / length, ny / length
            pairs[k] = (PLANE, nx, ny, nx * x + ny * y - off / total, mean / total)
    return pairs


@kernel
def _falloff(t, r):
    """The likelihood by the distances along two axes, in standard deviations."""
    return np.exp(-0.5 * (t * t + r * r)) if abs(t) < CUT and abs(r) < CUT else 0.0


@kernel
def _climbed(points, pairs, pose, slope, bend, model: EchoModel, steps, precision):
    """How far Newton steps lead from a pose, with the same pairs, and the information (3, 3) of the
    echoes there; `slope` (3,) and `bend` (3, 3) are the prediction's at the pose."""
    moved, g, H = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for _ in range(steps):
        _expand(points, pairs, pose + moved, model, g, H)
        step = np.linalg.solve(H + bend, -(g + slope + bend @ moved))
        moved += step
        if np.abs(step).max() < precision:
            break
    return moved, -H


@kernel
def _expand(points, pairs, pose, model: EchoModel, g, H):
    """Write gradient (3,) and curvature (3, 3) of the log-likelihood at a pose to g and H."""
    g[:], H[:] = 0.0, 0.0
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(points)):
        wx, wy = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        x, y, h = pose[0] + wx, pose[1] + wy, pairs[k, 4]
        if pairs[k, 0] == PLANE:
            nx, ny = pairs[k, 1], pairs[k, 2]
            off = nx * x + ny * y - pairs[k, 3]
            w = model.beta * _weight(off * off, h, model.sigma, model)
            _pull(g, H, nx, ny, off, w, wx * ny - wy * nx)
        elif pairs[k, 0] == SPOT:
            dx, dy = x - pairs[k, 1], y - pairs[k, 2]
            w = model.point_beta * _weight(dx * dx + dy * dy, h, model.point_sigma, model)
            _pull(g, H, 1.0, 0.0, dx, w, -wy)
            _pull(g, H, 0.0, 1.0, dy, w, wx)


@kernel
def _weight(square, h, sigma, model: EchoModel):
    """The derivative of log(z_hit h exp(-d^2 / 2 sigma^2) + z_rand) by -d^2 / 2."""
    explained = model.z_hit * h * np.exp(-0.5 * square / (sigma * sigma))
    return explained / ((explained + model.z_rand) * sigma * sigma)


@kernel
def _pull(g, H, nx, ny, off, w, turn):
    """Add an echo of weight `w` at distance `off` along the normal; `turn`: by the heading."""
    J = (nx, ny, turn)
    for a in range(3):
        g[a] -= w * off * J[a]
        for b in range(3):
            H[a, b] -= w * J[a] * J[b]
