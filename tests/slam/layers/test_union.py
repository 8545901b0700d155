import numpy as np

from slam.geometry import Pose2
from slam.layers import layers
from slam.layers.classification import CHANGING, FREE, STATIC, UNKNOWN
from slam.layers.union import united
from tests.slam.layers.rooms import box, watch

ROOM = box(-3.02, -1.02, 3.02, 1.02)
LOW = np.array([(0.99, -0.31, 0.99, 0.31)])
"""A low barrier, which only the lower of two lasers sees."""
POSES = [Pose2(x, 0.0, 0.0) for x in np.linspace(-1.2, 0.0, 30)]


def kind_at(made, x: float, y: float) -> int:
    ((row, col),) = made.spec.cells(np.array([(x, y)]))
    return int(made.kind[row, col])


def test_what_one_of_two_lasers_sees_standing_stands() -> None:
    """In the layers of all scans together, beams of the higher laser pass through it."""
    high, poses = watch([ROOM] * 30, POSES)
    low, _ = watch([np.concatenate([ROOM, LOW])] * 30, POSES, start=0.05)
    parts = [layers(high, poses), layers(low, poses)]
    both = united(parts)
    assert kind_at(parts[0], 0.99, 0.0) == FREE
    assert kind_at(both, 0.99, 0.0) == STATIC
    mixed = [scan for pair in zip(high, low, strict=True) for scan in pair]
    together = layers(mixed, np.repeat(poses, 2, axis=0))
    standing = (together.kind == STATIC).sum()
    assert kind_at(together, 0.99, 0.0) != STATIC
    assert (both.kind == STATIC).sum() > standing


def test_the_strongest_class_holds_on_the_grid_of_all() -> None:
    near, poses = watch([ROOM] * 10, POSES[:10])
    far, apart = watch([ROOM + 8.0] * 10, [Pose2(p.x + 8.0, p.y + 8.0, 0.0) for p in POSES[:10]])
    one, two = layers(near, poses), layers(far, apart)
    both = united([one, two])
    left, right, low, high = both.spec.extent
    for part in (one, two):
        a, b, c, d = part.spec.extent
        assert left <= a
        assert right >= b
        assert low <= c
        assert high >= d
        row, col = part.spec.row0 - both.spec.row0, part.spec.col0 - both.spec.col0
        there = both.kind[row : row + part.spec.rows, col : col + part.spec.cols]
        assert (there[part.kind != UNKNOWN] != UNKNOWN).all()
    assert (both.kind == STATIC).sum() == one.static.sum() + two.static.sum()
    assert not (both.kind == CHANGING).any()


def test_one_laser_is_itself() -> None:
    scans, poses = watch([ROOM] * 5, POSES[:5])
    one = layers(scans, poses)
    assert united([one]) is one
