from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import Array, Pose2, wrap_angle
from slam.grid import OccupancyGrid
from slam.layers import Layers, layers
from slam.layers.classification import (
    DOOR_LEAF,
    GLASS,
    KEPT_REASONS,
    NO_REASON,
    SEEN_IN_PART,
    SEEN_ONCE,
    WENT_AWAY,
)
from slam.scan import Scan
from tests.slam.layers.rooms import AJAR, CLOSED, HOUSE, box, scan, watch

ROOM = box(-3.02, -1.02, 3.02, 1.02)
MIDDLE = np.array([(0.0, 0.0)])


def at(made: Layers, x: float, y: float) -> int:
    ((row, col),) = made.spec.cells(np.array([(x, y)]))
    return int(made.kind[row, col])


def share_static(made: Layers, y: float, left: float, right: float) -> float:
    """Of a wall along x: the share of its cells, or one beside, that always stand."""
    points = np.stack([np.arange(left, right, 0.05), np.full(len(np.arange(left, right, 0.05)), y)])
    rows, cols = made.spec.cells(points.T).T
    near = made.static[rows] | made.static[rows - 1] | made.static[rows + 1]
    return float(near[np.arange(len(rows)), cols].mean())


def drive(n: int, y: float = 0.0) -> list[Pose2]:
    return [Pose2(x, y, 0.0) for x in np.linspace(-1.2, 1.2, n)]


def test_a_wall_that_is_grazed_stands() -> None:
    """The beams run along the wall at 10 cm: they cross its cells again and again."""
    scans, poses = watch([ROOM] * 40, drive(40, 0.92))
    made = layers(scans, poses)
    assert share_static(made, 1.02, -2.8, 2.8) > 0.95
    assert not made.changing.any()


def test_a_grazed_wall_stands_though_poses_err() -> None:
    rng = np.random.default_rng(3)
    scans, poses = watch([ROOM] * 60, drive(60, 0.5))
    made = layers(scans, poses + rng.normal(0.0, (0.02, 0.02, 0.005), poses.shape))
    assert share_static(made, 1.02, -2.5, 2.5) > 0.95
    assert made.changing.sum() <= 0.02 * made.static.sum()


def test_a_wall_that_was_seen_for_two_seconds_is_a_wall() -> None:
    scans, poses = watch([ROOM] * 20, [Pose2()] * 20)
    made = layers(scans, poses)
    assert share_static(made, 1.02, -1.0, 1.0) > 0.6  # one echo each 2 cm and more
    assert at(made, 0.0, 0.5) == 1


def test_what_nobody_saw_is_unknown() -> None:
    scans, poses = watch([HOUSE] * 30, drive(30))
    made = layers(scans, poses)
    closed = np.concatenate([HOUSE, CLOSED])
    behind = layers(*watch([closed] * 30, drive(30)))
    assert made.free[tuple(made.spec.cells(np.array([(0.0, 2.0)])).T)].all()
    assert behind.unknown[tuple(behind.spec.cells(np.array([(0.0, 2.0)])).T)].all()
    assert not (made.static & made.free).any()


def doors(closed: int, opened: int, rounds: int) -> Layers:
    shut, ajar = np.concatenate([HOUSE, CLOSED]), np.concatenate([HOUSE, AJAR])
    moments = ([shut] * closed + [ajar] * opened) * rounds
    return layers(*watch(moments, drive(len(moments))))


def test_a_door_that_closes_and_opens_changes_and_is_found() -> None:
    made = doors(30, 60, 3)
    assert at(made, 0.0, 1.06) == 3
    assert len(made.doors) == 1
    door = made.doors[0]
    assert door.ends.mean(axis=0) == pytest.approx((0.0, 1.06), abs=0.06)
    assert door.width == pytest.approx(0.9, abs=0.15)
    assert door.open_share == pytest.approx(2 / 3, abs=0.12)
    assert door.flips == pytest.approx(5, abs=1)
    assert 0.5 < door.open_probability < door.open_share
    assert door.per_hour == pytest.approx(3600 * 5 / 27, rel=0.3)
    assert 0.0 <= door.first < door.last <= 27.0
    assert door.sure
    assert 0.9 <= door.probability < 1.0
    assert door.seen_open > 20
    assert door.seen_closed > 20
    hinge = door.ends[door.hinge]  # the leaf rests on the left, beyond the doorway
    assert door.hinge >= 0
    assert hinge == pytest.approx((-0.45, 1.06), abs=0.12)
    line = door.ends[1] - door.ends[0]
    assert door.swing == np.sign(line[0])  # y above: to the left of the way to the right


def test_the_leaf_at_rest_is_no_wall() -> None:
    """No beam passes through it, but within a door's swing it is the leaf."""
    made = doors(30, 60, 2)
    grid = made.static_map()
    cells = made.spec.cells(np.array([(-0.45, y) for y in np.arange(1.35, 1.95, 0.05)]))
    assert not made.static[tuple(cells.T)].any()
    assert (grid.occupied[tuple(cells.T)] <= 0.5).all()


def test_the_wall_behind_an_open_door_stands() -> None:
    made = doors(40, 40, 2)
    assert share_static(made, 3.03, -0.4, 0.4) > 0.8


def test_a_door_that_stays_closed_is_told_by_its_shape_and_stands() -> None:
    shut = np.concatenate([HOUSE, CLOSED])
    made = layers(*watch([shut] * 60, drive(60)))
    (door,) = made.doors
    assert not door.moved
    assert (door.seen_open, door.seen_closed) == (0, 60)
    assert door.open_share == 0
    assert door.open_probability == pytest.approx(1 / 3)  # it may be open another time
    assert door.per_hour == 0
    assert share_static(made, 1.06, -0.3, 0.3) > 0.9


def test_a_door_that_stays_open_is_told_by_its_leaf() -> None:
    ajar = layers(*watch([np.concatenate([HOUSE, AJAR])] * 60, drive(60)))
    (door,) = ajar.doors
    assert not door.moved
    assert door.open_share == 1
    cells = ajar.spec.cells(np.array([(-0.45, y) for y in np.arange(1.3, 1.9, 0.05)]))
    assert ajar.static[tuple(cells.T)].mean() > 0.8  # what always stood stands
    without = layers(*watch([HOUSE] * 60, drive(60)))
    assert max((one.probability for one in without.doors), default=0.0) < door.probability


@pytest.mark.parametrize("later", [-50.0, 40_000_000.0])
def test_another_day_with_another_clock_goes_on(later: float) -> None:
    """Concatenated sessions; the clock of the second day restarts, or is a year ahead."""
    shut, ajar = np.concatenate([HOUSE, CLOSED]), np.concatenate([HOUSE, AJAR])
    moments = ([shut] * 30 + [ajar] * 60) * 3
    scans, poses = watch(moments, drive(len(moments)))
    again, _ = watch(moments, drive(len(moments)), later)
    made = layers([*scans, *again], np.vstack([poses, poses]))
    assert len(made.doors) == 1
    assert made.doors[0].flips == pytest.approx(11, abs=2)
    assert made.doors[0].open_share == pytest.approx(2 / 3, abs=0.12)
    assert made.doors[0].watched == pytest.approx(54, abs=8)


def test_a_person_who_crosses_is_neither_wall_nor_door() -> None:
    moments = []
    for x in np.linspace(-2.5, 2.5, 50):
        moments.append(np.concatenate([ROOM, box(x - 0.2, 0.4, x + 0.2, 0.7)]))
    moments = [ROOM] * 20 + moments + [ROOM] * 20
    made = layers(*watch(moments, [Pose2(0.0, -0.5, 0.0)] * len(moments)))
    rows, cols = np.nonzero(made.static)
    y = made.spec.centres(np.stack([rows, cols], axis=1))[:, 1]
    assert not ((y > -0.7) & (y < 0.8) & (np.abs(made.spec.centres(
        np.stack([rows, cols], axis=1))[:, 0]) < 2.5)).any()  # fmt: skip
    assert not made.doors


def test_the_static_map_agrees_with_the_layers() -> None:
    made = doors(30, 60, 2)
    grid = made.static_map()
    assert ((grid.occupied > 0.5) == (made.static | made.kept)).all()
    assert (grid.observed == ~made.unknown).all()
    layer = made.static.astype(int) + made.changing + made.free + made.unknown + made.kept
    assert (layer == 1).all()


@settings(max_examples=8, deadline=None)
@given(
    start=st.floats(-1e6, 1e6),
    x=st.floats(-50.0, 50.0).map(lambda v: round(v / 0.05) * 0.05),
)
def test_neither_the_clock_nor_the_frame_matters(start: float, x: float) -> None:
    scans, poses = watch([ROOM] * 10, drive(10, 0.01))
    moved, there = watch([ROOM] * 10, drive(10, 0.01), start)
    one, other = layers(scans, poses), layers(moved, there + (x, 0.0, 0.0))
    assert one.static.sum() == pytest.approx(other.static.sum(), rel=0.05)
    assert one.changing.sum() == other.changing.sum()


def test_no_echo_at_all_is_free_space() -> None:
    empty = np.empty((0, 4))
    made = layers(*watch([empty] * 3, [Pose2()] * 3))
    assert made.free.any()
    assert not made.static.any()
    assert not made.doors


@pytest.mark.parametrize(
    ("poses", "resolution", "told"),
    [
        (np.zeros((2, 3)), 0.05, "one pose a scan"),
        (np.zeros((1, 2)), 0.05, "shape"),
        (np.full((1, 3), np.nan), 0.05, "finite"),
        (np.zeros((1, 3)), 0.0, "resolution"),
    ],
)
def test_what_cannot_be_used_is_told(poses: np.ndarray, resolution: float, told: str) -> None:
    with pytest.raises(InputError, match=told):
        layers([scan(ROOM, Pose2(), 0.0)], poses, resolution)


def test_no_scans_are_told() -> None:
    with pytest.raises(InputError, match="one pose a scan"):
        layers([], np.empty((0, 3)))


LEG = box(-0.03, 0.47, 0.03, 0.53)  # of a table
BOX = box(-0.3, 0.3, 0.3, 0.6)


def around(made: Layers, x: float, y: float, reach: float = 0.1) -> np.ndarray:
    """(rows, cols) bool: the cells near a point."""
    row, col = np.indices(made.kind.shape)
    centres = made.spec.centres(np.stack([row.ravel(), col.ravel()], axis=1))
    return (np.abs(centres - (x, y)).max(axis=1) <= reach).reshape(made.kind.shape)


def test_what_is_thin_is_kept_though_beams_pass_it() -> None:
    """Every second scan misses the leg: other beams hit it, or the pose errs."""
    moments = [np.concatenate([ROOM, LEG]), ROOM] * 40
    scans, poses = watch(moments, drive(80))
    alone = layers(scans, poses)
    near = around(alone, 0.0, 0.5)
    assert not alone.changing[near].any()
    everything = np.ones(near.shape, bool)
    made = layers(scans, poses, believed=OccupancyGrid(alone.spec, near * 1.0, everything))
    assert (made.static_map().occupied[near] > 0.5).all()
    assert (made.reason[near] == SEEN_IN_PART).any()


def test_what_was_seen_once_is_kept_and_marked() -> None:
    poses = [Pose2()] * 20
    made = layers(*watch([ROOM] * 20 + [np.concatenate([ROOM, BOX])], [*poses, Pose2(0, -0.5, 0)]))
    believed = OccupancyGrid(made.spec, np.zeros(made.spec.shape), np.ones(made.spec.shape, bool))
    seen = around(made, 0.0, 0.3, 0.25)
    believed.occupied[seen] = 1.0
    scans, poses = watch([np.concatenate([ROOM, BOX])], [Pose2(0, -0.5, 0)])
    once = layers(scans, poses, believed=believed)
    shown = once.static_map()
    rows, cols = once.spec.cells(believed.spec.centres(np.argwhere(seen))).T
    assert (shown.occupied[rows, cols] > 0.5).all()
    assert set(once.reason[rows, cols].tolist()) == {SEEN_ONCE}


def test_what_went_away_is_left_out_and_the_reason_is_told() -> None:
    full = np.concatenate([ROOM, BOX])
    moments = [full] * 40 + [ROOM] * 80
    scans, poses = watch(moments, drive(40) + drive(40)[::-1] + drive(40))
    made = layers(scans, poses)
    front = around(made, 0.0, 0.3, 0.26) & ~around(made, 0.0, 0.45, 0.1)
    assert (made.static_map().occupied[front] > 0.5).mean() < 0.1
    everything = OccupancyGrid(made.spec, np.ones(made.spec.shape), np.ones(made.spec.shape, bool))
    told = layers(scans, poses, believed=everything)
    assert (told.reason[told.changing] == WENT_AWAY).mean() > 0.9


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_nothing_believed_is_lost_without_a_reason(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moments = [np.concatenate([ROOM, BOX]) if rng.random() < 0.5 else ROOM for _ in range(20)]
    scans, poses = watch(moments, drive(20))
    spec = layers(scans, poses).spec
    believed = OccupancyGrid(spec, rng.random(spec.shape), rng.random(spec.shape) < 0.5)
    made = layers(scans, poses, believed=believed)
    lost = (believed.occupied > 0.5) & believed.observed & ~(made.static | made.kept)
    assert np.isin(made.reason[lost], (WENT_AWAY, DOOR_LEAF)).all()
    assert np.isin(made.reason[made.kept], KEPT_REASONS).all()
    assert (made.reason[made.static] == NO_REASON).all()


PANE = np.array([(-0.5, 1.02, 0.5, 1.02)])
BEHIND = box(-3.02, -1.02, 3.02, 2.5)
SIDES = np.array([(-3.02, 1.02, -0.5, 1.02), (0.5, 1.02, 3.02, 1.02)])


def seen_through(pane: np.ndarray, poses: list[Pose2], widest: float) -> tuple[list[Scan], Array]:
    """Scans of a room with a window of glass: beams that meet it at up to `widest` (rad) end."""
    scans = []
    for k, pose in enumerate(poses):
        open_, shut = (
            scan(np.concatenate([BEHIND, SIDES, more]), pose, k / 10) for more in (pane[:0], pane)
        )
        incidence = np.abs(wrap_angle(open_.angles + pose.theta - np.pi / 2))
        ranges = np.where(incidence <= widest, shut.ranges, open_.ranges)
        scans.append(replace(open_, ranges=ranges))
    return scans, np.array(poses)


def test_glass_is_kept_and_marked_though_the_slam_holds_it_to_be_free() -> None:
    scans, poses = seen_through(PANE, drive(60), np.radians(5.0))
    spec = layers(scans, poses).spec
    free = OccupancyGrid(spec, np.zeros(spec.shape), np.ones(spec.shape, bool))
    made = layers(scans, poses, believed=free)
    rows, cols = made.spec.cells(np.stack([np.arange(-0.4, 0.4, 0.05), np.full(16, 1.02)]).T).T
    assert set(made.reason[rows, cols].tolist()) <= {GLASS, NO_REASON}
    assert (made.reason[rows, cols] == GLASS).mean() > 0.8
    assert made.static_map().solid[rows, cols].mean() > 0.9
    assert not made.static_map((SEEN_ONCE, SEEN_IN_PART)).solid[rows, cols].any()


def test_what_is_hit_at_all_angles_and_goes_is_no_glass() -> None:
    away, there = seen_through(PANE, drive(60), 0.0), seen_through(PANE, drive(60), np.pi)
    scans = [replace(one, time=k / 10) for k, one in enumerate([*there[0], *away[0]])]
    made = layers(scans, np.vstack([there[1], away[1]]))
    assert not (made.reason == GLASS).any()
