import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.grid import GridSpec
from slam.metrics.raster import TOUCH, rasterise, times_touched

SPEC = GridSpec(0.5, -4, -6, 14, 12)
# Multiples of 1/64 m: often on a border or through a corner, never within rounding of one.
place = st.integers(-256, 256).map(lambda n: n / 64) | st.integers(-8, 8).map(lambda n: n / 2)
segments = st.lists(st.tuples(place, place, place, place), min_size=1, max_size=4)


def touches(segment: tuple[float, ...], low: tuple[float, float], size: float) -> bool:
    """Naive: clip the segment by the four sides of the square, widened by the same `TOUCH`."""
    start, end = np.array(segment[:2]), np.array(segment[2:])
    a, b = 0.0, 1.0
    for axis in range(2):
        least, most = low[axis] - TOUCH * size, low[axis] + (1 + TOUCH) * size
        d = end[axis] - start[axis]
        if d == 0:
            if not least <= start[axis] <= most:
                return False
            continue
        t = sorted(((least - start[axis]) / d, (most - start[axis]) / d))
        a, b = max(a, t[0]), min(b, t[1])
    return a <= b


def naive(lines: list[tuple[float, ...]], spec: GridSpec) -> np.ndarray:
    result = np.zeros(spec.shape, bool)
    for row, col in np.ndindex(*spec.shape):
        low = ((spec.col0 + col) * spec.resolution, (spec.row0 + row) * spec.resolution)
        result[row, col] = any(touches(line, low, spec.resolution) for line in lines)
    return result


@given(segments)
def test_cells_agree_with_clipping_every_square(lines: list[tuple[float, ...]]) -> None:
    assert (rasterise(np.array(lines), SPEC) == naive(lines, SPEC)).all()


def test_a_wall_on_a_border_occupies_both_sides() -> None:
    found = rasterise(np.array([[0.1, 0.0, 0.9, 0.0]]), SPEC)
    assert np.argwhere(found).tolist() == [[3, 6], [3, 7], [4, 6], [4, 7]]


def test_moments_are_counted_once_each() -> None:
    moving = np.zeros((5, 2, 4))
    moving[:, :, :] = (0.1, 0.1, 0.2, 0.2)  # two segments in one cell: still one moment
    moving[3:] += 1.0
    count = times_touched(moving, SPEC)
    assert count[4, 6] == 3
    assert count[6, 8] == 2
    assert count.sum() == 5
