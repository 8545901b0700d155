from dataclasses import replace

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.layers import Layers, layers
from slam.layers.classification import CHANGING, KEPT, KEPT_REASONS, SEEN_IN_PART, SEEN_ONCE
from slam.layers.doors import MappedDoor
from slam.layers.filter_masks import (
    CHANGING_LIMIT,
    CLOSED,
    DOOR_LIMIT,
    NO_LIMIT,
    OPEN,
    UNSEEN,
    keepout_mask,
    speed_mask,
)
from tests.slam.layers.rooms import box, watch

ROOM = box(-3.02, -2.02, 3.02, 2.02)
DOOR = MappedDoor(np.array([(-0.4, -1.0), (0.4, -1.0)]), 0.5, 3, 9.0, 0.0, 9.0, 5, 5, 0.95)


@pytest.fixture
def made() -> Layers:
    """An empty room; a cell of glass at (1, 1), one seen once at (-1, 1), one that changed."""
    scans, poses = watch([ROOM] * 12, [Pose2(0.1 * k, 0.0, 0.0) for k in range(12)])
    one = layers(scans, poses)
    kind, reason = one.kind.copy(), one.reason.copy()
    for (x, y), why in (((1.0, 1.0), SEEN_IN_PART), ((-1.0, 1.0), SEEN_ONCE)):
        kind[at(one, x, y)], reason[at(one, x, y)] = KEPT, why
    kind[at(one, 2.0, 0.0)] = CHANGING
    return replace(one, kind=kind, reason=reason, doors=(DOOR,))


def at(made: Layers, x: float, y: float) -> tuple[int, int]:
    ((row, col),) = made.spec.cells(np.array([(x, y)])).tolist()
    return row, col


def test_what_only_some_beams_hit_is_closed_and_its_neighbours(made: Layers) -> None:
    mask = keepout_mask(made, KEPT_REASONS)
    row, col = at(made, 1.0, 1.0)
    assert (mask[row - 1 : row + 2, col - 1 : col + 2] == CLOSED).all()
    assert (mask == CLOSED).sum() == 9
    assert mask[at(made, -1.0, 1.0)] == OPEN
    assert (mask[made.unknown] == UNSEEN).all()
    assert not (keepout_mask(made, (SEEN_ONCE,)) == CLOSED).any()


def test_the_robot_is_slow_near_doors_and_where_things_move(made: Layers) -> None:
    mask = speed_mask(made)
    for x, y, limit in [(0.0, -1.0, DOOR_LIMIT), (0.0, -1.9, DOOR_LIMIT), (0.0, 0.5, NO_LIMIT),
                        (2.0, 0.45, CHANGING_LIMIT), (2.0, 0.6, NO_LIMIT)]:  # fmt: skip
        assert mask[at(made, x, y)] == limit
    assert (mask[made.unknown] == UNSEEN).all()
    assert 0 < DOOR_LIMIT < CHANGING_LIMIT < 100  # percent; 0 is no limit


def test_without_doors_and_changes_nothing_is_slow(made: Layers) -> None:
    plain = replace(made, kind=np.where(made.kind == CHANGING, 1, made.kind), doors=())
    assert not (speed_mask(plain) > 0).any()
