import numpy as np
import pytest

from slam.graph.kept_places import OTHER_TURN, best_first, keep, no_places

TURNS = np.array([0.0, 0.5, 3.0, -3.0]) * OTHER_TURN
WINDOW = np.array([6, 4])  # columns and rows to both sides
LEAST = 10


def test_a_candidate_that_is_not_kept_displaces_none() -> None:
    kept = no_places(3, LEAST, TURNS, 4.0, WINDOW)
    for col, candidate in ((0, 20), (4, 40), (2, 30)):  # the last one is near to both others
        keep(kept, 0, 0, col, candidate, LEAST)
    assert best_first(kept).tolist() == [[0, 0, 4], [0, 0, 0]]
    keep(kept, 0, 0, 2, 50, LEAST)  # it is better than both
    assert best_first(kept).tolist() == [[0, 0, 2]]


@pytest.mark.parametrize("most", [1, 3, 20, 200])
@pytest.mark.parametrize("radius", [0.0, 1.5, 6.25])
def test_it_keeps_what_a_comparison_with_all_others_keeps(most: int, radius: float) -> None:
    """`radius` 0: places are single cells; a place at the border has fewer cells around it."""
    rng = np.random.default_rng(int(10 * radius) + most)
    kept, worst = no_places(most, LEAST, TURNS, radius, WINDOW), LEAST
    room: list[tuple[int, ...] | None] = [None] * most
    for _ in range(600):
        one = tuple(int(rng.integers(*span)) for span in ((0, 4), (-4, 5), (-6, 7), (11, 90)))
        if one[3] <= worst:
            continue
        worst = keep(kept, *one, worst)
        same = [other for other in room if other and is_same_place(one, other, radius)]
        if all(other[3] < one[3] for other in same):
            room = [None if other in same else other for other in room]
            values = [LEAST if other is None else other[3] for other in room]
            room[values.index(min(values))] = one
        assert worst == min(LEAST if other is None else other[3] for other in room)
    expected = sorted((other for other in room if other), key=lambda other: -other[3])
    assert best_first(kept).tolist() == [list(other[:3]) for other in expected]


def is_same_place(one: tuple[int, ...], other: tuple[int, ...], radius: float) -> bool:
    turn = abs(TURNS[one[0]] - TURNS[other[0]])
    near = (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2 <= radius
    return near and min(turn, 2.0 * np.pi - turn) <= OTHER_TURN
