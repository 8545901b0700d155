import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynslam_env.worlds.outline import Rect, outline

SIZE = 12
sides = st.integers(0, SIZE - 1)
rects = st.builds(
    lambda x, y, w, h: Rect(x, y, min(x + w, SIZE), min(y + h, SIZE)),
    sides, sides, st.integers(1, 6), st.integers(1, 6),
)  # fmt: skip


def naive(rects):
    """Unit edges between free and solid unit squares, with the side that is free."""
    free = np.zeros((SIZE + 2, SIZE + 2), dtype=int)
    for left, bottom, right, top in rects:
        free[left + 1 : right + 1, bottom + 1 : top + 1] = 1
    upright = {(x, y, int(step)) for (x, y), step in np.ndenumerate(np.diff(free, axis=0)) if step}
    level = {(x, y, int(step)) for (x, y), step in np.ndenumerate(np.diff(free, axis=1)) if step}
    return upright, level


def count_runs(edges, dx, dy):
    return sum((x - dx, y - dy, step) not in edges for x, y, step in edges)


@given(st.lists(rects, min_size=1, max_size=8))
def test_as_few_segments_as_there_can_be_on_all_edges_of_the_union(rects):
    upright, level = naive(rects)
    found = outline(rects).tolist()
    drawn_upright = [(x1, y + 1) for x1, y1, x2, y2 in found if x1 == x2
                     for y in range(int(y1), int(y2))]  # fmt: skip
    drawn_level = [(x + 1, y1) for x1, y1, x2, y2 in found if y1 == y2
                   for x in range(int(x1), int(x2))]  # fmt: skip
    assert sorted(drawn_upright) == sorted((x, y) for x, y, _ in upright)
    assert sorted(drawn_level) == sorted((x, y) for x, y, _ in level)
    assert len(found) == count_runs(upright, 0, 1) + count_runs(level, 1, 0)


def test_one_room():
    walls = outline([Rect(1.0, 2.0, 4.0, 3.0)])
    assert walls.tolist() == [[1, 2, 1, 3], [4, 2, 4, 3], [1, 2, 4, 2], [1, 3, 4, 3]]


def test_rooms_that_touch_have_no_wall_between_them():
    assert len(outline([Rect(0, 0, 1, 1), Rect(1, 0, 3, 1)])) == 4
    assert len(outline([Rect(0, 0, 1, 1), Rect(1.1, 0, 3, 1)])) == 8


def test_a_block_in_the_middle_stays():
    ring = [Rect(0, 0, 9, 2), Rect(7, 0, 9, 9), Rect(0, 7, 9, 9), Rect(0, 0, 2, 9)]
    assert np.hypot(*np.diff(outline(ring).reshape(-1, 2, 2), axis=1)[:, 0].T).sum() == (
        pytest.approx(4 * 9 + 4 * 5)
    )
