import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import DoorCorridorEnv, SlamWrapper
from dynslam_env.canvas import BLUE, ORANGE, PAPER, SOLID, VERMILION


def pixels(frame, colour):
    return int((frame == colour).all(axis=2).sum())


def frame_after(env, steps):
    for _ in range(steps):
        env.step(np.array([0.5, 0.0], dtype=np.float32))
    frame = env.render()
    assert isinstance(frame, np.ndarray)
    assert frame.dtype == np.uint8
    return frame


def test_a_frame_shows_floor_solid_robot_and_doors():
    env = DoorCorridorEnv(render_mode="rgb_array")
    env.reset(seed=0)
    frame = frame_after(env, 5)
    for colour, least in ((PAPER, 50_000), (SOLID, 20_000), (BLUE, 200), (ORANGE, 200)):
        assert pixels(frame, colour) > least


def test_the_robot_is_drawn_where_it_is():
    env = DoorCorridorEnv(render_mode="rgb_array")
    env.reset(seed=0)
    before, after = frame_after(env, 1), frame_after(env, 60)
    assert (before != after).any()
    middles = [np.argwhere((frame == BLUE).all(axis=2)).mean(axis=0) for frame in (before, after)]
    assert middles[1][1] > middles[0][1] + 30  # driven to the right


def test_wrapped_the_map_is_beside_the_world():
    alone = gym.make("DoorCorridor-v0", render_mode="rgb_array")
    alone.reset(seed=0)
    wrapped = SlamWrapper(gym.make("DoorCorridor-v0", render_mode="rgb_array"), slam="odometry")
    wrapped.reset(seed=0)
    single, double = frame_after(alone, 5), frame_after(wrapped, 5)
    assert double.shape == (single.shape[0], 2 * single.shape[1], 3)
    panel = double[:, single.shape[1] :]
    assert pixels(panel, VERMILION) > 200
    assert pixels(panel, SOLID) > 1000


def test_human_draws_in_a_window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(DoorCorridorEnv.metadata, "render_fps", 1000)
    env = DoorCorridorEnv(render_mode="human")
    env.reset(seed=0)
    env.step(np.array([0.5, 0.0], dtype=np.float32))
    import pygame

    surface = pygame.display.get_surface()
    assert surface is not None
    assert pygame.surfarray.array3d(surface).std() > 10
    env.close()
    assert not pygame.display.get_init()


def test_without_a_mode_there_is_a_warning_and_no_frame():
    env = DoorCorridorEnv()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None
