"""WorldTable: where the arrays of n worlds lie, so that one call of a kernel steps all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dynslam_env.sensors.laser import SCANS_PER_DRAW, Scanner
from dynslam_env.sensors.odometry import read_displacements, read_velocities, take
from dynslam_env.sensors.raycast import look
from dynslam_env.simulation.bodies import APART, HEADER, STATE_SIZE
from dynslam_env.simulation.fleet import Fleet, fleet_of
from dynslam_env.simulation.pointers import (
    ADDRESS,
    WORDS,
    integers,
    pointers_to,
    short_integers,
    table,
    vector,
)
from dynslam_env.simulation.robot import command, read_bodies
from dynslam_env.simulation.swinging import swing_ahead
from dynslam_env.simulation.task import PathPositions, StepResults, TaskTerms, judge
from dynslam_env.simulation.world_step import CONTROL_DT, PHYSICS_DT, UNMOVED, begin_swung
from slam.geometry import Array
from slam.kernel import kernel

if TYPE_CHECKING:
    from dynslam_env.simulation.world import World

Rows = NDArray[np.int64]

# arrays of a world and of its scanner
MEMORY, SEGMENTS, DOORS, CORNERS, FIRST, NOISE, HITS, TAKEN, FIRST_EDGE, ARRAYS = range(10)
MOTION_NOISE, SCAN_NOISE = 8, 16  # bits beside those of `begin_step`: which noise is used up


class WorldTable:
    """Pointers to the arrays of n worlds, of their scanners and of their `Fleet`.

    remains  (n,) bits of the last `begin`
    """

    def __init__(self, n: int):
        self._pointers = np.zeros((n, ARRAYS, WORDS), dtype=np.int64)
        self._fleet_pointers = np.zeros((0, WORDS), dtype=np.int64)
        self._kept: list[object] = [None] * n  # what the pointers point to
        self._fleet: Fleet | None = None
        self.remains = np.zeros(n, dtype=np.int64)

    def __reduce__(self) -> tuple[type[WorldTable], tuple[int]]:
        """A copy's worlds lie elsewhere."""
        return WorldTable, (len(self.remains),)

    @property
    def bound(self) -> bool:
        """Whether there are pointers; a copy has none."""
        return self._fleet is not None

    def bound_to(self, paths: Array) -> bool:
        """Whether there are pointers to a fleet with these paths, which may need another array when
        an episode begins."""
        return self._fleet is not None and self._fleet.paths is paths

    def bind(self, i: int, world: World, scanner: Scanner) -> None:
        """Let row `i` be this world."""
        arrays = *world.moving, scanner.noise, scanner.hits, scanner.taken, world.first_edges
        self._pointers[i], self._kept[i] = pointers_to(arrays), arrays

    def bind_fleet(self, fleet: Fleet) -> None:
        """Let the robots be these."""
        self._fleet_pointers, self._fleet = pointers_to(fleet), fleet

    def begin(self, which: Rows, actions: Array, speed: float) -> int:
        """Let robots `which` drive as `actions` (n, 2) say, as far as no Python is needed.

        The bits of all their `remains`; -1 - i, and nothing is done, for a robot i whose action is
        not two finite numbers.

        speed  rad/s, full speed of leaves
        """
        return _begin(which, actions, speed, self._fleet_pointers, self._pointers, self.remains)

    def sense(self, which: Rows) -> None:
        """Read poses, odometry, progress and scans of robots `which` after a step."""
        _sense(which, self._fleet_pointers, self._pointers)


@kernel(error_model="numpy")
def _apart(which, pointers):
    """(n,) addresses of the memories of those worlds in which nothing touches anything."""
    found, count = np.empty(len(which), np.int64), 0
    for i in which:
        if vector(pointers[i, MEMORY])[APART] != 0.0:
            found[count] = pointers[i, MEMORY, ADDRESS]
            count += 1
    return found[:count]


@kernel(nogil=True, error_model="numpy")
def _begin(which, actions, speed, fleet_pointers, pointers, remains):
    f = fleet_of(fleet_pointers)
    wrong = command(which, actions, f.scale, f.wheel_settings, f.poses, f.velocities,
                    f.wheels, f.chords, f.speeds, f.rolled)  # fmt: skip
    if wrong >= 0:
        return -1 - wrong
    take(which, f.drawn, f.taken, f.noise)
    swing_ahead(_apart(which, pointers), PHYSICS_DT)
    all_remains = 0
    for i in which:
        f.before[i] = f.poses[i]
        p = pointers[i]
        doors = table(p[DOORS])
        segments, corners, first = table(p[SEGMENTS]), table(p[CORNERS]), integers(p[FIRST])
        wheels = f.wheels[i, 0], f.wheels[i, 1], f.wheels[i, 2]
        memory = vector(p[MEMORY])
        remain = begin_swung(memory, segments, doors, corners, first, speed, wheels)
        if not remain & UNMOVED:
            for k in range(STATE_SIZE):
                f.bodies[i, k] = memory[HEADER + k]  # the first row
        if f.taken[i] == f.drawn.shape[1]:
            remain |= MOTION_NOISE
        if integers(p[TAKEN])[0] % SCANS_PER_DRAW == 0:
            remain |= SCAN_NOISE
        remains[i] = remain
        all_remains |= remain
    return all_remains


@kernel(nogil=True, error_model="numpy")
def _sense(which, fleet_pointers, pointers):
    f = fleet_of(fleet_pointers)
    read_bodies(which, f.bodies, f.chords, f.poses, f.velocities)
    e = f.errors
    alphas = e[1], e[2], e[3], e[4]
    read_displacements(which, f.before, f.poses, f.noise, e[0], alphas, f.displacements, f.odometry)
    read_velocities(which, f.displacements, CONTROL_DT, f.fastest, f.heard)
    positions = PathPositions(f.paths, f.legs, f.at, f.arrived)
    results = StepResults(f.terms, f.rewards, f.over)
    task = TaskTerms(f.kinds, f.weights, f.ends)
    judge(which, f.poses, f.collided, CONTROL_DT, f.reach[0], positions, task, results)
    lost = np.empty((0, 0), dtype=np.bool_)
    for i in which:
        p = pointers[i]
        taken = integers(p[TAKEN])
        row = taken[0] % SCANS_PER_DRAW
        taken[0] += 1
        look(f.bodies[i], f.laser, f.fan, table(p[SEGMENTS]), integers(p[FIRST_EDGE])[0], row,
             table(p[NOISE]), lost, f.ranges[i], f.scans[i], short_integers(p[HITS]))  # fmt: skip
