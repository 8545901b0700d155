"""A pose graph: poses, measured displacements between them, and the poses that fit them best."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.graph.edges import Edges
from slam.graph.system import System

STEPS = 10  # Gauss-Newton steps at most, at one kernel
SMALL = 1e-4  # m and rad: a shorter step is the last
ROUGH = 1e-3  # m and rad: of the recent poses, which are soon fitted again
NARROWING = 4.0  # of the kernel, from one stage of a graduation to the next
RECENT = 20  # poses that are fitted to new loops before all are
STRAIN = 3.0  # of the cost, for every new loop, that these take up: the mean of a true one's square
GROWN = 1.1  # so many times as many poses as at the last time: all are fitted


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
    edges: Edges = field(default_factory=Edges)
    scale: float = 11.3
    _settled: int = 0  # edges that poses were fitted to before
    _fitted: tuple[int, int] = (0, 0)  # poses and edges that there were when all were fitted

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
        n, edges = len(self.poses), len(self.edges)
        new = self._settled
        self._settled, self._fitted = edges, (n, edges)
        if n > 1:
            yield from self._descent(self.poses, System(self.edges, n), new, SMALL)

    def adjusting(self) -> Iterator[Array]:
        """`steps` for as few poses as will do: where the RECENT ones take up the new loops without
        strain, only those; where they do not, or the poses have become many more, all."""
        n, edges, new = len(self.poses), len(self.edges), self._settled
        if GROWN * self._fitted[0] > n > RECENT:
            system = System(self.edges, n, n - RECENT)
            old = system.numbers < new
            before = self._costs(system.edges.squares(self.poses), system.edges.loops)[old].sum()
            found = self.poses
            for poses in self._descent(found, system, new, ROUGH):
                found = poses
                yield poses
            after = self._costs(system.edges.squares(found), system.edges.loops).sum()
            if after - before <= STRAIN * (system.edges.loops & ~old).sum():
                self._settled = edges
                return
        yield from self.steps()

    @property
    def outdated(self) -> bool:
        """Whether there are loops that not all poses were fitted to."""
        return bool(self.edges.loops[self._fitted[1] :].any())

    def trust(self) -> Array:
        """(edges,) how far each edge counts at the poses of now, from 0 to 1."""
        return _weights(self.edges.squares(self.poses), self.edges.loops, self.scale)

    def _descent(self, poses: Array, system: System, new: int, small: float) -> Iterator[Array]:
        """Steps to the minimum, by graduation where edges from number `new` on ask for it; one
        shorter than `small` is the last."""
        looped = system.edges.loops & (system.numbers >= new)
        widest = system.edges.squares(poses)[looped].max(initial=0.0)
        scale = max(2.0 * widest, self.scale)
        while True:
            last = scale <= self.scale
            for _ in range(STEPS if last else 2):
                weights = _weights(system.edges.squares(poses), system.edges.loops, scale)
                step = system.step(poses, weights)
                poses = poses + step
                poses[:, 2] = wrap_angle(poses[:, 2])
                yield poses
                if np.abs(step).max() < small:
                    break
            if last:
                return
            scale = max(scale / NARROWING, self.scale)

    def _costs(self, squares: Array, loops: np.ndarray) -> Array:
        """(m,) what edges add to the sum that is minimised."""
        return np.where(loops, self.scale * squares / (self.scale + squares), squares)


def _weights(squares: Array, loops: np.ndarray, scale: float) -> Array:
    """(m,) of the kernel; 1 for what is no loop."""
    return np.where(loops, (scale / (scale + squares)) ** 2, 1.0)
