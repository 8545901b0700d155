"""Maps that share tiles against maps that do not."""

import math
from copy import deepcopy
from itertools import count

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.interface import MapModel, SensorModel
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.maps.tiles import AREA, TILE, TileIndex, Tiles
from slam.scan import Scan
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from tests.slam.worlds import FAN, MAX_RANGE, ROOM, beam, scan_at

VIEWS = [scan_at(Pose2(0.2, 0.1, 0.3 * k), walls=np.delete(ROOM, k, axis=0)) for k in range(4)]
MAX_SIGMA = 0.1  # m, the largest sigma that cells of 5 cm allow: a field of 6 cells
PARTS = [(Static, lambda: Endpoint(sigma=MAX_SIGMA)), (Histogram, Endpoint), (Static, Beam)]

places = st.integers(-60, 60).map(lambda n: n * 0.0707)
poses = st.builds(Pose2, places, places, st.sampled_from([0.0, 1.0, 2.5]))
forks, drops = st.just("fork"), st.just("drop")
steps = st.tuples(
    st.one_of(forks, drops, poses, poses, poses), st.integers(0, 99), st.integers(0, len(VIEWS) - 1)
)
programs = st.lists(steps, min_size=1, max_size=25)
parts = pytest.mark.parametrize(("model", "reading"), PARTS)


def view(number: int, time: float) -> Scan:
    return Scan(VIEWS[number].ranges, FAN, MAX_RANGE, time=time)


def integrate(grid: MapModel, reading: SensorModel, scan: Scan, pose: Pose2) -> None:
    reading.refresh(grid, grid.integrate(scan, pose))


class Particles:
    """Maps in one pool of tiles, each with a mirror that has tiles of its own."""

    def __init__(self, model, reading):
        self.grid, self.reading = model(), reading()
        self.tiles: Tiles = self.grid.cells.tiles
        self.branches = [self.tiles.current]
        self.mirrors = [(model(), reading())]
        self.times = count()
        self.integrate(0, view(0, 1.7 * next(self.times)), Pose2())

    def integrate(self, which: int, scan: Scan, pose: Pose2) -> None:
        self.tiles.switch(self.branches[which])
        integrate(self.grid, self.reading, scan, pose)
        integrate(*self.mirrors[which], scan, pose)

    def fork(self, which: int) -> None:
        self.tiles.switch(self.branches[which])
        self.branches.append(self.tiles.fork())
        self.mirrors.append(deepcopy(self.mirrors[which]))

    def drop(self, which: int) -> None:
        self.tiles.release(self.branches.pop(which))
        self.mirrors.pop(which)

    def run(self, program) -> "Particles":
        for what, which, number in program:
            which %= len(self.branches)
            if isinstance(what, Pose2):
                self.integrate(which, view(number, 1.7 * next(self.times)), what)
            elif what == "fork":
                self.fork(which)
            elif len(self.branches) > 1:
                self.drop(which)
        return self


def assert_same_map(ours: Tiles, theirs: Tiles) -> None:
    assert ours.spec == theirs.spec
    for mine, other in zip(ours._layers, theirs._layers, strict=True):
        np.testing.assert_array_equal(mine.values[ours.index], other.values[theirs.index])


def assert_each_is_its_mirror(particles: Particles) -> None:
    tiles = particles.tiles
    near = np.random.default_rng(0).normal(0, 0.5, (9, 3))
    for branch, (grid, reading) in zip(particles.branches, particles.mirrors, strict=True):
        tiles.switch(branch)
        assert_same_map(tiles, grid.cells.tiles)
        ours, theirs = particles.grid.cells.grid(), grid.cells.grid()
        np.testing.assert_array_equal(ours.occupied, theirs.occupied)
        np.testing.assert_array_equal(ours.observed, theirs.observed)
        for scan in VIEWS:
            values = particles.reading.log_likelihood(scan, near)
            np.testing.assert_array_equal(values, reading.log_likelihood(scan, near))


def assert_in_order(tiles: Tiles, branches: list[TileIndex]) -> None:
    """The slots of all maps, their places, references and the free ones are consistent."""
    recount = np.zeros(tiles.used, np.int32)
    recount[0] = 1
    for branch in branches:
        recount[branch.slots] += 1
        assert len(set(branch.slots.tolist())) == len(branch.slots)
        for row, col in np.argwhere(branch.index):
            place = row + branch.row0 // TILE, col + branch.col0 // TILE
            assert tuple(tiles.places[branch.index[row, col]]) == place
    assert tiles.references.dtype == np.int32
    np.testing.assert_array_equal(tiles.references, recount)
    np.testing.assert_array_equal(tiles.free, np.flatnonzero(recount == 0))
    assert tiles.shared or (recount < 2).all()
    one = sum(layer.values[0].nbytes for layer in tiles._layers)
    assert tiles.nbytes == np.count_nonzero(recount) * one
    for layer in tiles._layers:
        assert len(layer.values) == tiles.used
        assert (layer.values[0] == layer.fill).all()


@parts
@settings(max_examples=50)
@given(program=programs)
@example([("fork", 0, 0), (Pose2(0.5, 0.0, 0.2), 0, 1), (Pose2(-0.5, 0.0, 0.0), 1, 2)])
def test_every_branch_is_what_a_map_of_its_own_would_be(model, reading, program) -> None:
    particles = Particles(model, reading).run(program)
    assert_in_order(particles.tiles, particles.branches)
    assert_each_is_its_mirror(particles)


@settings(max_examples=40)
@given(poses, st.integers(0, 3), st.integers(0, 3))
def test_what_one_branch_sees_leaves_the_others_bytes_alone(pose, first, second) -> None:
    grid, reading = Static(), Endpoint(sigma=MAX_SIGMA)
    tiles = grid.cells.tiles
    for k in range(3):
        integrate(grid, reading, view(first, k), Pose2())
    other = tiles.fork()
    slots = other.slots
    before = [layer.values[slots] for layer in tiles._layers]
    own, spec = tiles.current, tiles.spec
    integrate(grid, reading, view(second, 4.0), pose)
    for layer, values in zip(tiles._layers, before, strict=True):
        np.testing.assert_array_equal(layer.values[slots], values)
    tiles.switch(other)
    assert tiles.spec == spec
    assert tiles.current is not own


def test_a_beam_through_a_wall_of_old_changes_a_tile_that_it_does_not_cross() -> None:
    grid, reading = Static(), Endpoint(sigma=MAX_SIGMA)
    tiles, pose = grid.cells.tiles, Pose2(0.5, 0.02)  # along the border of two tiles
    integrate(grid, reading, beam(1.5), pose)
    other = tiles.fork()
    below = other.index[-1 - tiles.corner[0], -tiles.corner[1]]
    before = reading.field().values[below].copy()
    integrate(grid, reading, beam(5.5), pose)  # whose echo is in another tile's column
    now = tiles.index[-1 - tiles.corner[0], -tiles.corner[1]]
    assert now != below
    np.testing.assert_array_equal(reading.field().values[below], before)
    assert (reading.field().values[now] != before).any()


def test_ids_that_a_map_gives_are_those_of_its_own_tiles() -> None:
    grid = Static()
    tiles = grid.cells.tiles
    first = grid.integrate(view(0, 0.0), Pose2())
    other = tiles.fork()
    copied = grid.integrate(view(0, 1.0), Pose2())
    assert (copied % AREA == first % AREA).all()
    assert not np.isin(copied // AREA, other.slots).any()
    assert np.isin(copied // AREA, tiles.current.slots).all()
    tiles.switch(other)
    assert not np.isin(grid.integrate(view(0, 2.0), Pose2()) // AREA, copied // AREA).any()


def test_only_tiles_that_are_written_to_are_copied() -> None:
    grid, reading = Static(), Endpoint()
    tiles = grid.cells.tiles
    for x in range(0, 40, 4):
        integrate(grid, reading, view(0, x), Pose2(float(x)))
    other = tiles.fork()
    integrate(grid, reading, view(0, 50.0), Pose2(1.0))
    same = np.intersect1d(tiles.current.slots, other.slots)
    assert 0 < len(tiles.current.slots) - len(same) < len(same)


def test_dropped_slots_are_used_again() -> None:
    grid, reading = Histogram(), Endpoint()
    tiles, most = grid.cells.tiles, 0
    for k in range(200):
        stays = tiles.current
        fork = tiles.fork()
        for branch in (stays, fork)[: 1 + k % 2]:
            tiles.switch(branch)
            pose = Pose2(math.cos(k), math.sin(k), 0.1 * k)
            integrate(grid, reading, view(k % 4, 0.5 * k), pose)
        keep, gone = (stays, fork) if k % 3 else (fork, stays)
        most = max(most, len(stays.slots), len(fork.slots))
        tiles.release(gone)
        tiles.switch(keep)
        assert not tiles.shared
        assert_in_order(tiles, [keep])
    assert tiles.used <= 1 + 2 * most < 60


def test_a_slot_used_again_is_blank() -> None:
    grid, reading = Static(), Endpoint()
    tiles = grid.cells.tiles
    empty = tiles.fork()
    integrate(grid, reading, view(0, 0.0), Pose2())
    full, used = tiles.current, tiles.used
    tiles.switch(empty)
    tiles.release(full)
    assert len(tiles.free) == used - 1
    assert tiles.nbytes == sum(layer.values[0].nbytes for layer in tiles._layers)
    integrate(grid, reading, view(1, 1.0), Pose2(0.3))
    fresh, its_reading = Static(), Endpoint()
    integrate(fresh, its_reading, view(1, 1.0), Pose2(0.3))
    assert_same_map(tiles, fresh.cells.tiles)
    assert tiles.used == max(used, fresh.cells.tiles.used)


def test_a_branch_that_was_dropped_is_empty_and_may_be_dropped_again() -> None:
    tiles = Tiles(1.0)
    tiles.extend((0.0, 0.0), (200.0, 200.0))
    tiles.index[1, 2] = 1
    tiles.allocate(2)
    fork = tiles.fork()
    for _ in range(2):
        tiles.release(fork)
        assert_in_order(tiles, [tiles.current])
    assert fork.index.size == 0
    tiles.release(tiles.current)
    assert tiles.free.tolist() == [1]
    tiles.extend((-5.0, -5.0), (5.0, 5.0))
    assert tiles.spec.extent == (-TILE, TILE, -TILE, TILE)
