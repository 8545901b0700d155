# pyright: reportMissingImports=false
import json

import gymnasium as gym
import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.driving import overlay
from dynslam_cli.driving.cockpit import DT, Cockpit
from dynslam_cli.driving.game import frames, make_environment, window
from dynslam_cli.driving.keys import HELP, KEY_COMMANDS, TURN_RATE, DriveCommand, drive
from dynslam_cli.driving.lens import Lens
from dynslam_cli.driving.play import PlayCommand

from dynslam_env import Corridor, Robot
from dynslam_env.drawing.colours import BLUE, UNKNOWN, VERMILION
from dynslam_env.drawing.render import pixels
from dynslam_env.registration import world_ids

ROBOT = Robot()
SIZE = (900, 500)


@pytest.fixture
def headless(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    import pygame

    pygame.display.quit()


def cockpit(slam="dynamic-ml", seed=0) -> Cockpit:
    return Cockpit(make_environment(PlayCommand(slam=slam)), seed)


def driven(cockpit: Cockpit, seconds: float) -> np.ndarray:
    """The picture after so long, in thirtieths of a second."""
    for _ in range(round(seconds * 30)):
        cockpit.advance(1 / 30)
    return pixels(cockpit.picture(SIZE))


def place(cockpit: Cockpit):
    return cockpit._world.pose


# -- keys --------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["up", "w"])
def test_ahead_is_full_speed_wanted_and_what_was_reached_is_kept(key):
    pressed = drive({key}, DriveCommand(), 0.4, ROBOT)
    assert pressed.action(ROBOT) == (1.0, 0.0)
    released = drive(set(), pressed, 0.45, ROBOT)
    assert released.speed == pytest.approx(0.4)
    assert drive(set(), released, 0.3, ROBOT) == released


def test_back_left_right_and_stop():
    assert drive({"down"}, DriveCommand(), 0.0, ROBOT).action(ROBOT) == (-1.0, 0.0)
    assert drive({"left"}, DriveCommand(), 0.0, ROBOT).turn == TURN_RATE
    assert drive({"d"}, DriveCommand(), 0.0, ROBOT).turn == -TURN_RATE
    assert drive({"left", "right", "up", "down"}, DriveCommand(), 0.0, ROBOT) == DriveCommand()
    assert drive({"space", "up"}, DriveCommand(0.5, 0.0, 0.5), 0.5, ROBOT) == DriveCommand()


def test_every_command_has_a_method_and_every_key_a_line_of_help():
    told = " ".join(key for key, _ in HELP).lower()
    assert all(key in told for key in ("f1", "esc", *"wasdfmrphq+-"))
    player = cockpit("none")
    assert set(KEY_COMMANDS.values()) == set(player._commands)


# -- lens --------------------------------------------------------------------------------------


def test_closer_goes_to_the_robot_and_farther_back_to_the_whole_world():
    lens = Lens().closer().closer()
    assert lens.follow
    assert lens.zoom > 1.5
    assert lens.farther().farther() == Lens()
    assert Lens().farther() == Lens()


def test_no_longer_followed_the_view_stays_where_it_was():
    lens = Lens(4.0, follow=True).toggled((3.0, 2.0))
    assert lens == Lens(4.0, False, (3.0, 2.0))
    assert lens.closer().centre == (3.0, 2.0)
    assert lens.toggled((9.0, 9.0)) == Lens(4.0, True)


@pytest.mark.parametrize("room", [(1440, 610), (900, 500), (500, 900), (2500, 500), (20, 20)])
def test_panels_fit_the_window(room):
    walls = Corridor().layout(np.random.default_rng(0)).walls
    view = Lens().view(walls, room, 2)
    width, height = view.panel(walls)
    across, down = (1, 2) if view.below((width, height)) else (2, 1)
    if room[0] > 100:
        assert width * across <= room[0]
        assert (height + 30) * down <= room[1]


# -- cockpit -----------------------------------------------------------------------------------


def test_a_held_key_drives_and_the_map_grows():
    player = cockpit()
    start, first = place(player), driven(player, 0.2)
    player.press("up")
    last = driven(player, 3.0)
    assert place(player).x > start.x + 0.8
    unknown = [(frame[:, SIZE[0] // 2 :] == UNKNOWN).all(axis=2).sum() for frame in (first, last)]
    assert unknown[1] < 0.98 * unknown[0]
    assert (last == VERMILION).all(axis=2).sum() > 100


def test_released_it_rolls_on_and_space_stops_it():
    player = cockpit("none")
    player.press("up")
    driven(player, 2.0)
    player.release("up")
    driven(player, 0.5)
    rolling = player._speed
    assert rolling > 0.3
    driven(player, 1.0)
    assert player._speed == pytest.approx(rolling, abs=0.02)
    player.press("space")
    player.release("space")
    driven(player, 0.1)
    player.press("space")
    driven(player, 3.0)
    assert abs(player._speed) < 0.01


def test_zoom_map_help_and_pause_change_the_picture():
    player = cockpit("odometry")
    seen = [driven(player, 0.3)]
    for key in ("+", "+", "-", "f", "m", "h", "h", "p"):
        player.press(key)
        seen.append(pixels(player.picture(SIZE)))
        same = (seen[-1] == seen[-2]).all()
        assert not same or key == "f"
    assert (seen[1] == BLUE).all(axis=2).sum() > 1.3 * (seen[0] == BLUE).all(axis=2).sum()
    assert (seen[6] != seen[5]).any(axis=2).mean() > 0.05  # help
    np.testing.assert_array_equal(seen[7], seen[5])


def test_paused_nothing_moves():
    player = cockpit("none")
    player.press("up")
    player.press("p")
    start = place(player)
    driven(player, 1.0)
    assert place(player) == start
    player.press("p")
    driven(player, 1.0)
    assert place(player) != start


def test_a_new_episode_begins_elsewhere_in_the_same_sequence():
    episodes = []
    for _ in range(2):
        player = cockpit("none", seed=3)
        walls = [player._world.layout.walls]
        player.press("r")
        walls.append(player._world.layout.walls)
        episodes.append(walls)
    assert not np.array_equal(*episodes[0])
    np.testing.assert_array_equal(episodes[0][1], episodes[1][1])


def test_time_keeps_step_and_tells_when_it_cannot():
    player = cockpit("none")
    driven(player, 1.0)
    assert player._world.scene().scan.time == pytest.approx(1.0 - DT, abs=2 * DT)
    assert player._status() == ("0.00 m/s", False)
    for _ in range(4):
        player.advance(0.6)  # more than is made good at once
    words, warning = player._status()
    assert warning
    assert "too slow: 0.5 x" in words


def test_motion_is_smooth_between_steps():
    player = cockpit("none")
    player.press("up")
    driven(player, 2.0)
    seen = []
    for _ in range(6):
        player.advance(DT / 4)
        seen.append(player._shown()[0].pose.x)
    steps = np.diff(seen)
    assert (steps > 0).all()
    assert steps.max() < 2 * steps.min()


@pytest.mark.parametrize("size", [(300, 120), (64, 64)])
def test_a_small_window_is_no_mistake(size):
    player = cockpit("odometry")
    player.press("h")
    assert player.picture(size).get_size() == size


def test_the_line_below_stays_readable():
    import pygame

    surface = pygame.Surface((1440, 100))
    overlay.bottom_line(surface, "0.45 m/s", False)
    strip = pixels(surface)[-overlay.STATUS_HEIGHT :]
    written = np.flatnonzero((strip < 200).any(axis=(0, 2)))
    assert written.max() < 1440 - 5
    assert (np.diff(written) > 200).any()  # keys left, status right


# -- the command -------------------------------------------------------------------------------


def test_in_a_window_keys_drive_it_and_q_ends_it(headless):
    import pygame

    def post(kind, key):
        pygame.event.post(pygame.event.Event(kind, key=key))

    env = make_environment(PlayCommand(slam="none"))
    screen = window("test")
    played = frames(env, 0, screen, fps=60)
    player = next(played)
    start, before = place(player), pixels(screen)
    post(pygame.KEYDOWN, pygame.K_UP)
    for _ in range(60):
        next(played)
    assert place(player).x > start.x + 0.05
    post(pygame.KEYUP, pygame.K_UP)
    post(pygame.KEYDOWN, pygame.K_PLUS)
    next(played)
    assert not player._held - {"+"}
    assert (pixels(screen) != before).any(axis=2).mean() > 0.2
    post(pygame.KEYDOWN, pygame.K_q)
    assert list(played) == []


def test_closing_the_window_ends_the_command(headless):
    import pygame

    pygame.display.init()
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert main.status(["play", "--slam", "none"]) == 0
    assert not pygame.display.get_init()


def test_interrupted_it_leaves_cleanly(headless, monkeypatch, capsys):
    import pygame

    def interrupted(self, seconds):
        raise KeyboardInterrupt

    monkeypatch.setattr(Cockpit, "advance", interrupted)
    assert main.status(["play", "--slam", "none"]) == 130
    assert capsys.readouterr().err == "dynslam: interrupted\n"
    assert not pygame.display.get_init()


def test_without_a_display_there_is_one_line(monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert main.status(["play"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "needs a display" in line


@pytest.mark.parametrize(
    ("arguments", "known"),
    [
        (["--env", "CartPole-v1"], "DoorCorridor-v0"),
        (["--slam", "dinamic-ml"], "did you mean dynamic-ml"),
        (["--slam", "nonsense"], "none"),
        (["--world", "missing.json"], "missing.json"),
    ],
)
def test_what_is_unknown_is_answered_with_what_is_known(capsys, arguments, known):
    assert main.status(["play", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert known in line


def test_all_environments_of_dynslam_can_be_driven():
    assert "DoorCorridor-v0" in world_ids()
    assert not any("CartPole" in name for name in world_ids())
    for name in world_ids():
        player = Cockpit(make_environment(PlayCommand(env=name, slam="none")), 0)
        assert driven(player, 0.2).std() > 10


def test_a_world_of_another_package_can_be_driven_in(own_ids):
    player = Cockpit(make_environment(PlayCommand(env="own_ids:OwnWorld-v0", slam="none")), 0)
    assert driven(player, 0.2).std() > 10


def test_a_world_file_can_be_driven_in(tmp_path):
    layout = Corridor(length=5.0, doors_per_side=1).layout(np.random.default_rng(0))
    layout.save(tmp_path / "world.json")
    assert json.loads((tmp_path / "world.json").read_text())["doors"]
    env = make_environment(PlayCommand(world=tmp_path / "world.json", slam="none"))
    assert isinstance(env, gym.Env)
    player = Cockpit(env)
    np.testing.assert_allclose(player._world.layout.walls, layout.walls)


def test_it_never_ends_by_itself():
    assert make_environment(PlayCommand(slam="none")).spec.max_episode_steps in (None, -1)
