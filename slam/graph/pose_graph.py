"""A pose graph: poses, measured displacements between them, and the poses that fit them best."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from slam.geometry import Array, Pose2, between, wrap_angle

STEPS = 10  # Gauss-Newton steps at most, at one kernel
AXES = np.arange(3)
SMALL = 1e-4  # m and rad: a shorter step is the last
NARROWING = 4.0  # of the kernel, from one stage of a graduation to the next


class Edge(NamedTuple):
    """A measured displacement.

    first, second  numbers of the poses
    displacement   of the second as seen from the first
    information    (3, 3) inverse covariance of x, y in m and theta in rad, in the second's frame
    loop           whether it closes a loop: such a one may be wrong altogether
    """

    first: int
    second: int
    displacement: Pose2
    information: Array
    loop: bool = False


@dataclass
class PoseGraph:
    """argmin_x sum_edges e' Omega e + sum_loops rho(e' Omega e), the first pose given.

    rho is Geman and McClure's kernel, c r^2 / (c + r^2): a loop that the others contradict is
    switched off. Its minimum is looked for by graduated non-convexity (Yang et al. 2020): the
    kernel begins so wide that all new loops count in full, and narrows stage by stage.

    poses  (n, 3) as believed now
    edges  of the graph
    scale  c, the square of a residual (3 degrees of freedom) beyond which a loop is doubted
    """

    poses: Array = field(default_factory=lambda: np.zeros((0, 3)))
    edges: list[Edge] = field(default_factory=list)
    scale: float = 11.3
    _settled: int = 0  # edges that the poses were fitted to before

    def add_pose(self, pose: Pose2) -> int:
        """A new pose; its number."""
        self.poses = np.vstack([self.poses, pose])
        return len(self.poses) - 1

    def optimise(self) -> None:
        """Find the poses; every step at once."""
        for poses in self.steps():
            self.poses = poses

    def steps(self) -> Iterator[Array]:
        """Step by step: the poses (n, 3) of the graph as it is now. What is added while the steps
        are taken is left out of them."""
        poses, system = self.poses.copy(), System(self.edges)
        if len(poses) < 2:
            return
        new = system.loops & (np.arange(len(system.loops)) >= self._settled)
        widest = system.squares(poses)[new].max(initial=0.0)
        scale = max(2.0 * widest, self.scale)
        self._settled = len(system.loops)
        while True:
            last = scale <= self.scale
            for _ in range(STEPS if last else 2):
                step = system.step(poses, system.weights(poses, scale))
                poses = poses + step
                poses[:, 2] = wrap_angle(poses[:, 2])
                yield poses
                if np.abs(step).max() < SMALL:
                    break
            if last:
                return
            scale = max(scale / NARROWING, self.scale)

    def trust(self) -> Array:
        """(edges,) how far each edge counts at the poses of now, from 0 to 1."""
        system = System(self.edges)
        return system.weights(self.poses, self.scale)


class System:
    """The normal equations of some edges."""

    def __init__(self, edges: list[Edge]):
        self.first = np.array([edge.first for edge in edges], dtype=np.int64)
        self.second = np.array([edge.second for edge in edges], dtype=np.int64)
        self.measured = np.array([edge.displacement for edge in edges]).reshape(-1, 3)
        self.information = np.array([edge.information for edge in edges]).reshape(-1, 3, 3)
        self.loops = np.array([edge.loop for edge in edges], dtype=np.bool_)

    def errors(self, poses: Array) -> Array:
        """(edges, 3) what was measured minus what the poses say, in the second's frame."""
        return between(self.measured, between(poses[self.first], poses[self.second]))

    def squares(self, poses: Array) -> Array:
        """(edges,) e' Omega e."""
        errors = self.errors(poses)
        return np.einsum("ni,nij,nj->n", errors, self.information, errors)

    def weights(self, poses: Array, scale: float) -> Array:
        """(edges,) of the kernel; 1 for what is no loop."""
        kept = (scale / (scale + self.squares(poses))) ** 2
        return np.where(self.loops, kept, 1.0)

    def step(self, poses: Array, weights: Array) -> Array:
        """(n, 3) the Gauss-Newton step; that of the first pose is zero."""
        n = len(poses)
        before, after, errors = self._jacobians(poses)
        information = self.information * weights[:, None, None]
        rows, cols, values = [], [], []
        gradient = np.zeros((n, 3))
        for a, J in ((self.first, before), (self.second, after)):
            JO = np.swapaxes(J, 1, 2) @ information
            np.add.at(gradient, a, (JO @ errors[:, :, None])[:, :, 0])
            for b, K in ((self.first, before), (self.second, after)):
                rows.append(3 * a[:, None, None] + AXES[None, :, None] + 0 * AXES)
                cols.append(3 * b[:, None, None] + AXES[None, None, :] + 0 * AXES[:, None])
                values.append(JO @ K)
        where = (np.concatenate(rows).ravel(), np.concatenate(cols).ravel())
        hessian = csc_matrix((np.concatenate(values).ravel(), where), shape=(3 * n, 3 * n))
        solver = splu(hessian[3:, 3:], permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                      options={"SymmetricMode": True})  # fmt: skip
        step = np.zeros(3 * n)
        step[3:] = -solver.solve(gradient.ravel()[3:])
        return step.reshape(n, 3)

    def _jacobians(self, poses: Array) -> tuple[Array, Array, Array]:
        """(edges, 3, 3) of the errors by the first and by the second pose, and the errors."""
        first, second = poses[self.first], poses[self.second]
        errors = self.errors(poses)
        turn = first[:, 2] + self.measured[:, 2]
        c, s = np.cos(turn), np.sin(turn)
        dx, dy = (second - first)[:, :2].T
        after = np.zeros((len(first), 3, 3))
        after[:, 0, 0], after[:, 0, 1] = c, s
        after[:, 1, 0], after[:, 1, 1] = -s, c
        after[:, 2, 2] = 1.0
        before = -after
        before[:, 0, 2], before[:, 1, 2] = c * dy - s * dx, -s * dy - c * dx
        return before, after, errors
