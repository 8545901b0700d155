"""Pose graph optimisation: poses that fit measured displacements best."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.graph.contraction import contract
from slam.graph.edges import Edges
from slam.graph.system import System

MAX_STEPS = 10  # Gauss-Newton steps at one scale of the robust kernel
PRECISION = 1e-4  # m and rad; a shorter step is the last
RECENT_PRECISION = 1e-3  # m and rad, if only recent poses are fitted, soon to be refitted
SCALE_FACTOR = 4.0  # between the scales of the robust kernel, from one stage to the next
RECENT_POSES = 20  # number of poses fitted to new loops first, before all are fitted
MAX_LOOP_COST = 3.0  # added per new loop if only recent poses are fitted: the mean of a true loop
MAX_GROWTH = 1.1  # of the number of poses, beyond which all are fitted again


@dataclass
class PoseGraph:
    """argmin_x sum_edges e' Omega e + sum_loops rho(e' Omega e), the first pose given.

    rho is Geman and McClure's kernel, c r^2 / (c + r^2), by which outliers among the loops lose
    their weight. It is minimised by graduated non-convexity (Yang et al. 2020): the kernel starts
    so wide that all new loops have full weight, and is narrowed stage by stage.

    poses  (n, 3) current estimate
    edges  of the graph
    scale  c, the squared residual (3 degrees of freedom) beyond which a loop loses weight
    """

    poses: Array = field(default_factory=lambda: np.zeros((0, 3)))
    edges: Edges = field(default_factory=Edges)
    scale: float = 11.3
    _fitted_edges: int = 0  # that some poses at least were fitted to
    _fitted: tuple[int, int] = (0, 0)  # number of poses and edges when all were fitted

    def add_pose(self, pose: Pose2) -> int:
        """Add a pose; returns its number."""
        self.poses = np.vstack([self.poses, pose])
        return len(self.poses) - 1

    def forget(self, number: int, into: int) -> None:
        """Remove a pose, not the first one; pose `into` lies at the same place (see `contract`).
        Poses and edges after it are renumbered; the other poses stay where they are."""
        removed = contract(self.edges, self.poses, self.trust(), number, into)
        self.edges.remove(removed)
        self.edges.remove_pose(number)
        self.poses = np.delete(self.poses, number, axis=0)
        poses, edges = self._fitted
        self._fitted = poses - 1, edges - sum(k < edges for k in removed)
        self._fitted_edges -= sum(k < self._fitted_edges for k in removed)

    def optimise(self) -> None:
        """Optimise the poses, all steps at once."""
        for poses in self.steps():
            self.poses = poses

    def steps(self) -> Iterator[Array]:
        """Yield the poses (n, 3) after each step of the optimisation of the current graph, without
        poses and edges added in between."""
        n, edges = len(self.poses), len(self.edges)
        new = self._fitted_edges
        self._fitted_edges, self._fitted = edges, (n, edges)
        if n > 1:
            yield from self._descent(self.poses, System(self.edges, n), new, PRECISION)

    def adjusting(self) -> Iterator[Array]:
        """`steps` of the RECENT_POSES only, if they fit the new loops at little cost; of all poses
        otherwise, and when the graph has grown by MAX_GROWTH."""
        n, edges, new = len(self.poses), len(self.edges), self._fitted_edges
        if MAX_GROWTH * self._fitted[0] > n > RECENT_POSES:
            system = System(self.edges, n, n - RECENT_POSES)
            old = system.numbers < new
            before = self._costs(system.edges.squares(self.poses), system.edges.loops)[old].sum()
            found = self.poses
            for poses in self._descent(found, system, new, RECENT_PRECISION):
                found = poses
                yield poses
            after = self._costs(system.edges.squares(found), system.edges.loops).sum()
            if after - before <= MAX_LOOP_COST * (system.edges.loops & ~old).sum():
                self._fitted_edges = edges
                return
        yield from self.steps()

    @property
    def outdated(self) -> bool:
        """Whether there are loops that some poses were not fitted to."""
        return bool(self.edges.loops[self._fitted[1] :].any())

    def trust(self) -> Array:
        """(edges,) weight of each edge at the current poses, from 0 to 1."""
        return _weights(self.edges.squares(self.poses), self.edges.loops, self.scale)

    def _descent(self, poses: Array, system: System, new: int, precision: float) -> Iterator[Array]:
        """Yield the poses after each step to the minimum, by graduated non-convexity as far as the
        residuals of loops from number `new` on need it; a step below `precision` is the last."""
        looped = system.edges.loops & (system.numbers >= new)
        widest = system.edges.squares(poses)[looped].max(initial=0.0)
        scale = max(2.0 * widest, self.scale)
        while True:
            last = scale <= self.scale
            for _ in range(MAX_STEPS if last else 2):
                weights = _weights(system.edges.squares(poses), system.edges.loops, scale)
                step = system.step(poses, weights)
                poses = poses + step
                poses[:, 2] = wrap_angle(poses[:, 2])
                yield poses
                if np.abs(step).max() < precision:
                    break
            if last:
                return
            scale = max(scale / SCALE_FACTOR, self.scale)

    def _costs(self, squares: Array, loops: np.ndarray) -> Array:
        """(m,) cost of the edges."""
        return np.where(loops, self.scale * squares / (self.scale + squares), squares)


def _weights(squares: Array, loops: np.ndarray, scale: float) -> Array:
    """(m,) weights by the robust kernel; 1 for edges that are no loops."""
    return np.where(loops, (scale / (scale + squares)) ** 2, 1.0)
