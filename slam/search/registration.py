"""Registration: a matched pose refined on the surfaces of the map (Segal et al. 2009, GICP)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.outline import NOTHING, Outline
from slam.maps.surfaces import COUNT, NONE, SAME, TX, TY, Surfaces, X, Y
from slam.maps.tiles import MASK, SHIFT, TILE
from slam.motion.gaussian import Prediction, add_slope
from slam.search.gauss_newton import newton_step
from slam.sensor_models.blocks import cell_at
from slam.validation import positive, whole

CUT = 3.0  # standard deviations beyond which a surface is not an echo's
AROUND = 1  # cells around that of an echo whose surfaces may be its own
H_MIN, H_MAX = 0.02, 0.98  # limits of h
SHARPER = 1.5  # the information of echoes, by the curvature of their likelihood
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


class SurfaceMap(NamedTuple):
    """Surfaces, and the cells that they belong to, as kernels read them.

    left, low   m, world, where `lattice` begins
    resolution  m, side of a cell
    lattice     slots of the tiles, see `Tiles.index`
    occupied    (cells,) h
    first, table, next  see `Surfaces`
    """

    left: float
    low: float
    resolution: float
    lattice: np.ndarray
    occupied: np.ndarray
    first: np.ndarray
    table: np.ndarray
    next: np.ndarray


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
    sharpness  of its information, see `SensorModel`
    """

    sharpness: ClassVar[float] = 30.0

    model: EchoModel = ECHO
    rounds: int = 5
    steps: int = 2
    precision: float = 0.002
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
        limits = self.rounds, self.steps, self.precision, self.paired
        pose, information, enough = _registered(
            tuple(outline), tuple(start), _map(surfaces, cells), tuple(self.model),
            prediction.gaussian, limits,
        )  # fmt: skip
        if not enough or math.dist(pose[:2], start[:2]) > self.farthest:
            return None
        return Pose2(*pose), information

    def pairs(self, outline: Outline, surfaces: Surfaces, cells: Cells, pose: Pose2) -> Array:
        """(n, 5) what each echo is compared with: PLANE, its normal (2,), its distance from the
        origin along the normal, h; or SPOT, x, y, 0, h; zeros if with nothing."""
        pairs = np.zeros((len(outline.points), 5))
        _pair(outline, pose, SurfaceMap(*_map(surfaces, cells)), self.model, pairs)
        return pairs


SURFACES = Registration()  # the default


def _map(surfaces: Surfaces, cells: Cells) -> tuple[Any, ...]:
    """A `SurfaceMap` as a plain tuple."""
    tiles = cells.tiles
    return (*tiles.origin, tiles.resolution, tiles.index, cells.occupied.flat,
            surfaces.first.flat, surfaces.table, surfaces.next)  # fmt: skip


@kernel
def _registered(outline, start, where, model, prior, limits):
    """The pose (x, y, theta) at which the steps end, the information (3, 3) of the echoes there,
    and whether enough of them were paired.

    The first four arguments are an `Outline`, a pose, a `SurfaceMap` and an `EchoModel` as plain
    tuples: a call with named ones takes 0.6 us more for each.

    prior   of the pose, see `Prediction.gaussian`
    limits  rounds, steps of a round, precision, least share of echoes on walls
    """
    rounds, steps, precision, least = limits
    points, pose, H, model = outline[0], start, np.zeros((3, 3)), EchoModel(*model)
    pairs, slope, bend = np.empty((len(points), 5)), np.empty(3), np.empty((3, 3))
    for _ in range(rounds):
        if _pair(outline, pose, where, model, pairs) < least * len(points):
            return pose, H, False
        slope[:], bend[:] = 0.0, 0.0
        add_slope(*pose, *prior, slope, bend)
        x, y, theta = _climb(points, pairs, pose, slope, bend, model, steps, precision, H)
        turned = (pose[2] + theta + np.pi) % (2.0 * np.pi) - np.pi
        pose = pose[0] + x, pose[1] + y, turned
        if max(abs(x), abs(y), abs(theta)) < precision:
            break
    return pose, -SHARPER * H, True


@kernel(error_model="numpy")
def _pair(outline: Outline, pose, where: SurfaceMap, model: EchoModel, pairs):
    """Write to pairs (n, 5) what the echoes are compared with; returns how many with planes.

    The surfaces along an echo's tangent are averaged, weighted by their likelihood; of points the
    most likely one counts. (One loop: numba counts references to arrays at calls of functions.)
    """
    points, tangents, kind = outline
    left, low, resolution, index, occupied, first, table, following = where
    rows, cols = (index.shape[0] << SHIFT) - AROUND, (index.shape[1] << SHIFT) - AROUND
    c, s, scale, planes = np.cos(pose[2]), np.sin(pose[2]), 1.0 / resolution, 0
    across, around = CUT * model.sigma, CUT * model.point_sigma
    for k in range(len(points)):
        pairs[k] = 0.0
        if kind[k] == NOTHING:
            continue
        x = pose[0] + c * points[k, 0] - s * points[k, 1]
        y = pose[1] + s * points[k, 0] + c * points[k, 1]
        row, col = int((y - low) * scale), int((x - left) * scale)
        if not (AROUND <= row < rows and AROUND <= col < cols):
            continue
        tx = c * tangents[k, 0] - s * tangents[k, 1]
        ty = s * tangents[k, 0] + c * tangents[k, 1]
        total = nx = ny = off = mean = best = 0.0
        inside = AROUND <= row & MASK <= MASK - AROUND and AROUND <= col & MASK <= MASK - AROUND
        here = np.uint64(cell_at(index, row, col))
        for i in range(-AROUND, AROUND + 1):
            for j in range(-AROUND, AROUND + 1):
                cell = here + np.uint64(i * TILE + j)
                if not inside:
                    cell = np.uint64(cell_at(index, row + i, col + j))
                surface = np.uint64(first[cell])
                while surface != NONE:
                    dx, dy = x - table[surface, X], y - table[surface, Y]
                    ux, uy, echoes = table[surface, TX], table[surface, TY], table[surface, COUNT]
                    surface = np.uint64(following[surface])
                    along, r = ux * tx + uy * ty, dy * ux - dx * uy
                    if abs(along) >= SAME and abs(r) < across:
                        h = _known(echoes, model.new, occupied[cell])
                        w = h * _falloff((dx * ux + dy * uy) * scale, r / model.sigma)
                        total, mean = total + w, mean + w * h
                        w = np.copysign(w, along)
                        nx, ny, off = nx - w * uy, ny + w * ux, off + w * r
                    elif ux == 0.0 and uy == 0.0 and max(abs(dx), abs(dy)) < around:
                        h = _known(echoes, model.new, occupied[cell])
                        w = h * _falloff(dx / model.point_sigma, dy / model.point_sigma)
                        if w > best:
                            best, pairs[k, 0], pairs[k, 4] = w, SPOT, h
                            pairs[k, 1], pairs[k, 2] = x - dx, y - dy
        if total > 0.0:
            length = np.sqrt(nx * nx + ny * ny)
            pairs[k, 0], pairs[k, 1], pairs[k, 2] = PLANE, nx / length, ny / length
            pairs[k, 3] = (nx * x + ny * y) / length - off / total
            pairs[k, 4] = mean / total
            planes += 1
    return planes


@kernel(error_model="numpy")
def _known(echoes, new, h):
    """h of a surface of so many echoes in a cell."""
    return echoes / (echoes + new) * min(max(h, H_MIN), H_MAX)


@kernel
def _falloff(t, r):
    """The likelihood by the distances along two axes, in standard deviations."""
    return np.exp(-0.5 * (t * t + r * r))


@kernel
def _climb(points, pairs, pose, slope, bend, model: EchoModel, steps, precision, H):
    """How far Newton steps lead from a pose, with the same pairs; the curvature (3, 3) of the
    echoes there is written to H. `slope` (3,) and `bend` (3, 3) are the prediction's at the pose.
    """
    x = y = theta = 0.0
    g, both = np.empty(3), np.empty((3, 3))
    for _ in range(steps):
        _expand(points, pairs, (pose[0] + x, pose[1] + y, pose[2] + theta), model, g, H)
        for k in range(3):
            g[k] += slope[k] + bend[k, 0] * x + bend[k, 1] * y + bend[k, 2] * theta
            for m in range(3):
                both[k, m] = H[k, m] + bend[k, m]
        dx, dy, turn = newton_step(g, both)
        x, y, theta = x + dx, y + dy, theta + turn
        if max(abs(dx), abs(dy), abs(turn)) < precision:
            break
    return x, y, theta


@kernel(error_model="numpy")
def _expand(points, pairs, pose, model: EchoModel, g, H):
    """Write gradient (3,) and curvature (3, 3) of the log-likelihood at a pose to g and H."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    gx = gy = gt = xx = xy = yy = xt = yt = tt = 0.0
    for k in range(len(points)):
        wx, wy = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        x, y, h = pose[0] + wx, pose[1] + wy, pairs[k, 4]
        if pairs[k, 0] == PLANE:
            nx, ny = pairs[k, 1], pairs[k, 2]
            off, turn = nx * x + ny * y - pairs[k, 3], wx * ny - wy * nx
            w = model.beta * _weight(off * off, h, model.sigma, model.z_hit, model.z_rand)
            gx, gy, gt = gx - w * off * nx, gy - w * off * ny, gt - w * off * turn
            xx, xy, yy = xx - w * nx * nx, xy - w * nx * ny, yy - w * ny * ny
            xt, yt, tt = xt - w * nx * turn, yt - w * ny * turn, tt - w * turn * turn
        elif pairs[k, 0] == SPOT:
            dx, dy = x - pairs[k, 1], y - pairs[k, 2]
            square = dx * dx + dy * dy
            w = model.point_beta * _weight(square, h, model.point_sigma, model.z_hit, model.z_rand)
            gx, gy, gt = gx - w * dx, gy - w * dy, gt + w * (dx * wy - dy * wx)
            xx, yy, xt, yt = xx - w, yy - w, xt + w * wy, yt - w * wx
            tt -= w * (wx * wx + wy * wy)
    g[0], g[1], g[2] = gx, gy, gt
    H[0, 0], H[1, 1], H[2, 2] = xx, yy, tt
    H[0, 1] = H[1, 0] = xy
    H[0, 2] = H[2, 0] = xt
    H[1, 2] = H[2, 1] = yt


@kernel(error_model="numpy")
def _weight(square, h, sigma, z_hit, z_rand):
    """The derivative of log(z_hit h exp(-d^2 / 2 sigma^2) + z_rand) by -d^2 / 2."""
    explained = z_hit * h * np.exp(-0.5 * square / (sigma * sigma))
    return explained / ((explained + z_rand) * sigma * sigma)
