"""Globally consistent alignment of keyframes by links between them (Lu and Milios 1997)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array, Pose2, between, compose, wrap_angle
from slam.graph.echoes import Echoes
from slam.graph.edges import Edges
from slam.graph.links import Links
from slam.graph.system import System
from slam.kernel import kernel
from slam.memory import give_back
from slam.motion.gaussian import GaussianMotion
from slam.validation import positive

LINKS = Links()  # the default
SAME = 0.92  # cosine of the angle between the tangents of two echoes of one surface, at least
CUT = 3.0  # standard deviations beyond which two echoes are not of one surface
LEAST_INFORMATION = 1.0  # 1/m^2, 1/rad^2, of a link: makes it invertible
DRIFT = GaussianMotion(rotation_per_m=math.radians(20.0), rotation_per_rad=0.2)
FAR = 256  # keyframes between two whose headings the map holds together: some 30 m apart
EVERY = 16  # keyframes from one such pair to the next


@dataclass(frozen=True)
class Alignment:
    """Moves all keyframes such that each sees the same surfaces as the keyframes around it.

    Maximum likelihood SLAM lays each scan on a map whose errors stay, and a pose graph moves rigid
    pieces of that map. Here every keyframe is a node. A link compares the echoes of two keyframes:
    the distances along the normals of the surfaces that both see (Chen and Medioni 1991). Its
    minimum is a measured displacement of the one from the other, and its curvature the information;
    all links are solved together. Consecutive keyframes are also held together as by an odometry
    as good as scan matching, which decides where the scans do not, as along a bare corridor.
    Headings FAR apart are held together too: a map of many scans bends less than a chain of links.

    links   which keyframes are compared
    sigmas  m, standard deviation of the distances, of one Gauss-Newton step each: the first one
            brings together what the pose graph left farther apart
    along   m, along the surface, between two echoes that are compared
    beta    weight of an echo in one link; it is compared in about twenty
    z_rand  likelihood of an echo that is not of the same surface, by that of one that is
    drift   errors of the displacement between consecutive keyframes, as estimated before
    bend    rad, likewise of the heading between keyframes 256 apart (FAR)
    """

    links: Links = LINKS
    sigmas: tuple[float, ...] = (0.04, 0.02)
    along: float = 0.15
    beta: float = 0.015
    z_rand: float = 0.3
    drift: GaussianMotion = DRIFT
    bend: float = math.radians(2.0)

    def __post_init__(self) -> None:
        positive(self, "along", "beta", "z_rand", "bend")

    def __call__(self, echoes: Echoes, poses: Array) -> Array:
        """(n, 3) the poses of keyframes at about `poses` (n, 3), in the order of time. The first
        one stays."""
        if len(poses) < 2:
            return poses
        links = self.links(poses)
        system = System(self._edges(links, poses), len(poses))
        for sigma in self.sigmas:
            self._measure(echoes, poses, sigma, system.edges, len(links))
            give_back()  # what the links and their measures took: the matrix is larger than all
            poses = poses + system.step(poses, np.ones(len(system.edges)))
            poses[:, 2] = wrap_angle(poses[:, 2])
        return poses

    def _edges(self, links: np.ndarray, poses: Array) -> Edges:
        """The links, without information, then what holds `poses` (n, 3) together."""
        steps, far = _apart(len(poses), 1, 1), _apart(len(poses), FAR, EVERY)
        ends = np.concatenate([links, steps, far])
        displacements = between(poses[ends[:, 0]], poses[ends[:, 1]])
        information, last = np.zeros((len(ends), 3, 3)), len(links) + len(steps)
        information[len(links) : last] = self._of_odometry(displacements[len(links) : last])
        information[last:, 2, 2] = self.bend**-2
        return Edges.of(ends, displacements, information)

    def _of_odometry(self, displacements: Array) -> Array:
        """(n, 3, 3) information about displacements (n, 3) between consecutive keyframes."""
        deviations = np.array([self.drift.deviations(Pose2.of(one)) for one in displacements])
        return deviations[:, :, None] ** -2 * np.eye(3)

    def _measure(self, echoes: Echoes, poses: Array, sigma: float, edges: Edges, n: int) -> None:
        """Write to the first n edges what the links measure around `poses` (n, 3)."""
        ends = edges.ends[:n]
        here = between(poses[ends[:, 0]], poses[ends[:, 1]])
        model = self.along, sigma, self.z_rand
        information, gradient = _compared(echoes, ends, here, model)
        information *= self.beta / sigma**2
        gradient *= self.beta / sigma**2
        information += LEAST_INFORMATION * np.eye(3)
        off = np.linalg.solve(information, gradient[:, :, None])[:, :, 0]
        edges.measured[:n] = compose(here, -off)
        edges.information[:n] = information


def _apart(n: int, k: int, every: int) -> np.ndarray:
    """(pairs, 2) of n keyframes: numbers 0, `every`, ..., each with the one k after it."""
    first = np.arange(0, n - k, every)
    return np.column_stack([first, first + k])


@kernel(error_model="numpy")
def _compared(echoes: Echoes, ends, displacements, model):
    """Curvature (n, 3, 3) and gradient (n, 3) of half the weighted squared distances of the echoes
    of the second keyframe of each link to those of the first, by the displacement of the second,
    in its own frame.

    ends           (n, 2) numbers of the keyframes
    displacements  (n, 3) of the second from the first
    model          m along a surface; m, standard deviation across; likelihood of another surface
    """
    begins, points, tangents, bearings, weights, sensors = echoes
    along, sigma, z_rand = model
    H, g = np.zeros((len(ends), 3, 3)), np.zeros((len(ends), 3))
    for n in range(len(ends)):
        first, second, pose = ends[n, 0], ends[n, 1], displacements[n]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        begin, end, place = begins[first], begins[first + 1], begins[first]
        gx = gy = gt = xx = xy = yy = xt = yt = tt = 0.0
        for k in range(begins[second], begins[second + 1]):
            own_x, own_y = np.float64(points[k, 0]), np.float64(points[k, 1])
            x, y = pose[0] + c * own_x - s * own_y, pose[1] + s * own_x + c * own_y
            tx = c * tangents[k, 0] - s * tangents[k, 1]
            ty = s * tangents[k, 0] + c * tangents[k, 1]
            dx, dy = x - sensors[first, 0], y - sensors[first, 1]
            bearing, width = np.arctan2(dy, dx), along / max(np.sqrt(dx * dx + dy * dy), along)
            while place > begin and bearings[place - 1] >= bearing - width:
                place -= 1
            while place < end and bearings[place] < bearing - width:
                place += 1
            nearest, other, m = along * along, -1, place
            while m < end and bearings[m] <= bearing + width:
                dx, dy = x - points[m, 0], y - points[m, 1]
                square = dx * dx + dy * dy
                if square < nearest and tx * tangents[m, 0] + ty * tangents[m, 1] >= SAME:
                    nearest, other = square, m
                m += 1
            if other < 0:
                continue
            nx, ny = -(ty + tangents[other, 1]), tx + tangents[other, 0]
            length = np.sqrt(nx * nx + ny * ny)
            nx, ny = nx / length, ny / length
            off = nx * (x - points[other, 0]) + ny * (y - points[other, 1])
            if abs(off) > CUT * sigma:
                continue
            stands = np.float64(min(weights[k], weights[other]))
            same = stands * np.exp(-0.5 * (off / sigma) ** 2)
            w = same / (same + z_rand)
            nx, ny = c * nx + s * ny, c * ny - s * nx  # in the second one's frame
            nt = ny * own_x - nx * own_y
            gx, gy, gt = gx + w * off * nx, gy + w * off * ny, gt + w * off * nt
            xx, xy, yy = xx + w * nx * nx, xy + w * nx * ny, yy + w * ny * ny
            xt, yt, tt = xt + w * nx * nt, yt + w * ny * nt, tt + w * nt * nt
        g[n, 0], g[n, 1], g[n, 2] = gx, gy, gt
        H[n, 0, 0], H[n, 1, 1], H[n, 2, 2] = xx, yy, tt
        H[n, 0, 1] = H[n, 1, 0] = xy
        H[n, 0, 2] = H[n, 2, 0] = xt
        H[n, 1, 2] = H[n, 2, 1] = yt
    return H, g


ALIGNED = Alignment()  # the default
