import math

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import Corridor, Door, DoorWorldEnv, Layout
from dynslam_env.worlds.layout import Generator
from slam import InputError, Pose2

DOOR = Door((1.0, 2.0), 0.0, 1, 0.898, 0.04)
ROOM = [(0, 0, 4, 0), (4, 0, 4, 2), (4, 2, 0, 2), (0, 2, 0, 0)]
GIVEN = {"walls": ROOM, "doors": [DOOR], "start": (1, 1, 0), "path": [(1, 1), (3, 1)]}


def test_a_world_given_as_lists():
    layout = Layout(**{**GIVEN, "routes": [[(1, 1.5), (3, 1.5)]]})
    assert layout.walls.dtype == layout.path.dtype == np.float64
    assert layout.walls.shape == (4, 4)
    assert layout.start == Pose2(1.0, 1.0, 0.0)
    assert layout.doors == (DOOR,)
    assert [route.tolist() for route in layout.routes] == [[[1.0, 1.5], [3.0, 1.5]]]


def test_a_layout_draws_itself():
    layout = Layout(**GIVEN)
    assert isinstance(layout, Generator)
    assert layout.layout(np.random.default_rng(0)) is layout


@pytest.mark.parametrize("world", [Layout(**GIVEN), Corridor(people=2)])
def test_an_environment_takes_it(world):
    env = gym.make("DoorCorridor-v0", world=world)
    env.reset(seed=0)
    inner = env.unwrapped
    assert isinstance(inner, DoorWorldEnv)
    assert inner.layout.walls.shape[1] == 4
    env.step(np.zeros(2, dtype=np.float32))


def test_what_was_given_is_copied():
    walls = np.array(ROOM, dtype=float)
    layout = Layout(**{**GIVEN, "walls": walls})
    walls[:] = 9.0
    assert layout.walls.max() == 4.0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"walls": [(0, 0, 1)]}, r"Layout\.walls must have shape \(n, 4\), got \(1, 3\)"),
        ({"walls": [(0, 0, 1, 1), (0, 0)]}, r"Layout\.walls must have shape \(n, 4\)"),
        ({"walls": [(0, 0, 1, "1")]}, r"Layout\.walls must hold finite numbers only"),
        ({"walls": None}, r"Layout\.walls must have shape \(n, 4\)"),
        ({"path": [(0.0, math.nan)]}, r"Layout\.path must hold finite numbers only"),
        ({"path": np.empty((0, 2))}, r"Layout\.path needs at least one waypoint"),
        ({"start": (1.0, 1.0)}, r"Layout\.start must be three numbers x, y, theta"),
        ({"start": 3.0}, r"Layout\.start must be three numbers"),
        ({"start": (1.0, 1.0, math.inf)}, r"Layout\.start must hold finite"),
        ({"doors": [(1.0, 2.0)]}, r"Layout\.doors\[0\] must be a Door"),
        ({"doors": [DOOR, DOOR._replace(width=0.0)]}, r"Layout\.doors\[1\]\.width .* above 0"),
        ({"doors": [DOOR._replace(thickness=-0.1)]}, r"Layout\.doors\[0\]\.thickness .* above 0"),
        ({"doors": [DOOR._replace(swing=0)]}, r"Layout\.doors\[0\]\.swing must be one of 1, -1"),
        ({"doors": [DOOR._replace(closed=math.nan)]}, r"door of Layout\.doors must hold finite"),
        ({"doors": [DOOR._replace(hinge=(1.0,))]}, r"Layout\.doors\[0\]\.hinge must be two"),
        ({"doors": [DOOR._replace(hinge=None)]}, r"Layout\.doors\[0\]\.hinge must be two"),
        ({"routes": [[(1.0, 1.0)]]}, r"Layout\.routes\[0\] needs at least two waypoints"),
        ({"routes": [[(1, 1), (1, 1), (2, 1)]]}, r"Layout\.routes\[0\] .* another than the one"),
        ({"routes": [[(1, 1, 1), (2, 1, 1)]]}, r"Layout\.routes\[0\] must have shape \(n, 2\)"),
        ({"routes": [[(1, 1), (2, math.nan)]]}, r"Layout\.routes\[0\] must hold finite"),
    ],
)
def test_what_cannot_be_is_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Layout(**{**GIVEN, **wrong})


def test_turned_and_moved():
    routes = [[(1.0, 1.5), (3.0, 1.5)]]
    layout, to = Layout(**{**GIVEN, "routes": routes}), np.array([2.0, -1.0])
    moved = layout.turned(0.3, to)
    turn = np.array([(math.cos(0.3), math.sin(0.3)), (-math.sin(0.3), math.cos(0.3))])

    def expected(points):
        return np.reshape(points, (-1, 2)) @ turn + to

    for name in ("walls", "path"):
        at = expected(getattr(layout, name)).reshape(getattr(layout, name).shape)
        np.testing.assert_allclose(getattr(moved, name), at, atol=1e-12)
        assert not getattr(moved, name).flags.writeable
    np.testing.assert_allclose(moved.routes[0], expected(routes[0]), atol=1e-12)
    np.testing.assert_allclose(moved.start, (*expected([(1.0, 1.0)])[0], 0.3), atol=1e-12)
    (door,) = moved.doors
    assert door.hinge == pytest.approx(expected([DOOR.hinge])[0].tolist())
    assert (door.closed, door[2:]) == (pytest.approx(0.3), DOOR[2:])
    again = Layout(moved.walls, moved.doors, moved.start, moved.path, moved.routes)  # all checks
    assert again.plain() == moved.plain()
