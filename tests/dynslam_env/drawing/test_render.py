import gymnasium as gym
import imageio_ffmpeg
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo

import dynslam_env
from dynslam_env import DoorWorldEnv, SlamWrapper
from dynslam_env.drawing.colours import BLUE, ORANGE, PAPER, PURPLE, SOLID, UNKNOWN, VERMILION
from dynslam_env.drawing.view import View

AHEAD = np.array([0.5, 0.0], dtype=np.float32)


def pixels(frame, colour):
    return int((frame == colour).all(axis=2).sum())


def frame_after(env, steps):
    for _ in range(steps):
        env.step(AHEAD)
    frame = env.render()
    assert isinstance(frame, np.ndarray)
    assert frame.dtype == np.uint8
    return frame


def test_a_frame_shows_floor_solid_robot_and_doors():
    env = DoorWorldEnv(render_mode="rgb_array")
    env.reset(seed=0)
    frame = frame_after(env, 5)
    for colour, least in ((PAPER, 50_000), (SOLID, 20_000), (BLUE, 200), (ORANGE, 200)):
        assert pixels(frame, colour) > least


@pytest.mark.parametrize("name", list(dynslam_env.WORLDS))
def test_every_world_has_a_picture_of_constant_even_size(name):
    env = gym.make(name, render_mode="rgb_array")
    shapes = set()
    for seed in range(2):
        env.reset(seed=seed)
        frame = frame_after(env, 2)
        shapes.add(frame.shape)
        assert pixels(frame, PAPER) > 50_000
        assert pixels(frame, BLUE) > (50 if name == "DoorWings-v0" else 100)  # drawn smaller
        assert pixels(frame, PURPLE) > 100 or "Crowd" not in name
    assert len(shapes) == 1
    height, width, _ = shapes.pop()
    assert height % 2 == width % 2 == 0
    assert width <= 1100
    assert height <= 730


def test_the_robot_is_drawn_where_it_is():
    env = DoorWorldEnv(render_mode="rgb_array")
    env.reset(seed=0)
    before, after = frame_after(env, 1), frame_after(env, 60)
    assert (before != after).any()
    middles = [np.argwhere((frame == BLUE).all(axis=2)).mean(axis=0) for frame in (before, after)]
    assert middles[1][1] > middles[0][1] + 30  # driven to the right


def test_the_view_can_be_set():
    env = DoorWorldEnv(render_mode="rgb_array")
    env.reset(seed=0)
    whole = frame_after(env, 1)
    env.view = View(pixels_per_metre=150, follow=True, size=(640, 480))
    near = frame_after(env, 0)
    assert near.shape == (510, 640, 3)
    assert pixels(near, BLUE) > 4 * pixels(whole, BLUE)


def test_wrapped_the_map_is_beside_the_world():
    alone = gym.make("DoorCorridor-v0", render_mode="rgb_array")
    alone.reset(seed=0)
    wrapped = SlamWrapper(gym.make("DoorCorridor-v0", render_mode="rgb_array"), slam="odometry")
    wrapped.reset(seed=0)
    single, double = frame_after(alone, 5), frame_after(wrapped, 5)
    assert double.shape == (single.shape[0], 2 * single.shape[1], 3)
    panel = double[:, single.shape[1] :]
    assert pixels(panel, VERMILION) > 200
    assert pixels(panel, UNKNOWN) > 1000


def test_human_draws_in_a_window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(DoorWorldEnv.metadata, "render_fps", 1000)
    env = DoorWorldEnv(render_mode="human")
    env.reset(seed=0)
    env.step(AHEAD)
    import pygame

    surface = pygame.display.get_surface()
    assert surface is not None
    assert pygame.surfarray.array3d(surface).std() > 10
    env.close()
    assert not pygame.display.get_init()


def test_without_a_mode_there_is_a_warning_and_no_frame():
    env = DoorWorldEnv()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_a_video_can_be_recorded_and_read(tmp_path):
    plain = gym.make("DoorCorridor-v0", render_mode="rgb_array")
    env = RecordVideo(SlamWrapper(plain, slam="odometry"), str(tmp_path / "films"))
    env.reset(seed=0)
    shape = frame_after(env, 12).shape
    env.close()
    (path,) = tmp_path.glob("films/*.mp4")
    reader = imageio_ffmpeg.read_frames(str(path))
    assert next(reader)["size"] == (shape[1], shape[0])
    frames = [np.frombuffer(data, dtype=np.uint8).reshape(shape) for data in reader]
    assert len(frames) >= 12
    assert (np.abs(frames[5].astype(int) - PAPER).sum(axis=2) < 20).mean() > 0.2
