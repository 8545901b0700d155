import numpy as np
import pytest

from dynslam_env.drawing.view import MAX_PANEL, MIN_PANEL, View, extent
from slam.errors import InputError


def room(width, height):
    ends = [(0, 0, width, 0), (width, 0, width, height), (width, height, 0, height)]
    return np.array([*ends, (0, height, 0, 0)], dtype=np.float64)


@pytest.mark.parametrize("size", [(12, 8.4), (20, 15), (60, 8), (8, 60), (3, 2), (12.123, 8.456)])
def test_the_whole_world_fits_a_panel_of_a_sensible_and_even_size(size):
    walls, view = room(*size), View()
    width, height = view.panel(walls)
    assert width % 2 == height % 2 == 0
    assert MIN_PANEL[0] <= width <= MAX_PANEL[0]
    assert MIN_PANEL[1] <= height <= MAX_PANEL[1]
    projection = view.projection(walls, (1.0, 1.0), (width, height))
    assert projection.scale <= 60
    pixels = projection.points(np.array(extent(walls)))
    assert pixels.min() >= -1e-6
    assert (pixels <= (width + 1e-6, height + 1e-6)).all()


@pytest.mark.parametrize("scale", [5.0, 60.0, 400.0])
def test_a_point_is_where_the_scale_puts_it(scale):
    view = View(scale, centre=(3.0, 2.0), size=(300, 201))
    assert view.panel(room(12, 8)) == (300, 202)
    projection = view.projection(room(12, 8), (0.0, 0.0), (300, 202))
    assert projection.at(3.0, 2.0) == pytest.approx((150, 101))
    assert projection.at(3.1, 2.2) == pytest.approx((150 + 0.1 * scale, 101 - 0.2 * scale))
    both = projection.points(np.array([(3.0, 2.0), (3.1, 2.2)]))
    np.testing.assert_allclose(both[1], projection.at(3.1, 2.2))


def test_followed_the_robot_is_in_the_middle():
    projection = View(100.0, follow=True).projection(room(12, 8), (7.0, 1.5), (400, 300))
    assert projection.at(7.0, 1.5) == pytest.approx((200, 150))


def test_a_wide_panel_has_the_map_below():
    assert View().below((1100, 160))
    assert not View().below((762, 546))
    assert View(stacked=True).below((762, 546))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"pixels_per_metre": 0.0}, "pixels_per_metre"),
        ({"centre": (0.0, float("nan"))}, "centre"),
        ({"centre": 3.0}, "tuple of two"),
        ({"centre": (0.0, 0.0), "follow": True}, "got both"),
        ({"size": (100, 10)}, "size"),
        ({"size": (100.0, 100.0)}, "size"),
    ],
)
def test_senseless_views_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        View(**arguments)
