"""The work of `dynslam play`: the window, its events, real time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import gymnasium as gym

from dynslam_env import Layout, SlamWrapper
from dynslam_env.drawing.colours import SOLID
from dynslam_env.registration import imported_id, world_ids
from slam.errors import InputError
from slam.validation import unknown_name, whole_number

from ..console.selection import check_variant
from ..console.window import open_window
from . import overlay
from .cockpit import Cockpit

if TYPE_CHECKING:
    import pygame

    from .play import PlayCommand

FPS = 30  # pictures per second
WINDOW_SIZE = (1440, 640)  # pixels; less on a smaller display


def play(options: PlayCommand) -> int:
    """Open a window and drive until it is closed; the exit status."""
    env = make_environment(options)
    screen = window(f"{options.env}, {options.slam}")
    import pygame

    try:
        for _ in frames(env, options.seed, screen):
            pass
    finally:
        pygame.display.quit()
        env.close()
    return 0


def make_environment(options: PlayCommand) -> gym.Env[Any, Any]:
    """The environment with its SLAM. Raises InputError with the nearest known names."""
    whole_number("--seed", options.seed, 0)
    name = imported_id(options.env)
    if name not in world_ids():
        raise InputError(unknown_name("environment", name, world_ids()))
    check_variant(options.slam, ["none"])
    parts: dict[str, Any] = {"world": Layout.load(options.world)} if options.world else {}
    env = gym.make(name, max_episode_steps=-1, render_mode="rgb_array", **parts)
    return env if options.slam == "none" else SlamWrapper(env, slam=options.slam, score_every=0)


def window(title: str) -> pygame.Surface:
    """An open window. Raises InputError if there is no display."""
    instead = 'use render_mode="rgb_array" and gymnasium\'s RecordVideo'
    return open_window(f"dynslam play: {title}", WINDOW_SIZE, "play", instead)


def frames(
    env: gym.Env[Any, Any], seed: int, screen: pygame.Surface, fps: int = FPS
) -> Iterator[Cockpit]:
    """Drive in real time; yields the cockpit after every picture, until the driver quits."""
    import pygame

    screen.fill(SOLID)
    overlay.notice(screen, "preparing ...")
    pygame.display.flip()
    cockpit, clock = Cockpit(env, seed), pygame.time.Clock()
    clock.tick()
    while True:
        for event in pygame.event.get():
            handle(cockpit, event)
        if not cockpit.running:
            return
        cockpit.advance(clock.tick(fps) / 1000)
        screen = pygame.display.get_surface() or screen
        screen.blit(cockpit.picture(screen.get_size()), (0, 0))
        pygame.display.flip()
        yield cockpit


def handle(cockpit: Cockpit, event: pygame.event.Event) -> None:
    """Pass a key, or the closing of the window, to the cockpit."""
    import pygame

    if event.type == pygame.KEYDOWN:
        cockpit.press(pygame.key.name(event.key))
    elif event.type == pygame.KEYUP:
        cockpit.release(pygame.key.name(event.key))
    elif event.type == pygame.WINDOWFOCUSLOST:
        cockpit.let_go()
    elif event.type == pygame.QUIT:
        cockpit.running = False
