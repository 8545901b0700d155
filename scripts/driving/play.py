"""`dynslam play`: drive the robot by keyboard, and watch the map grow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym

import slam
from dynslam_env import Layout, SlamWrapper
from dynslam_env.drawing.colours import SOLID
from slam.validation import one_of, whole_number

from ..console.window import open_window
from . import overlay
from .cockpit import Cockpit

if TYPE_CHECKING:
    import pygame

WORLD = "dynslam_env.env:DoorWorldEnv"
FPS = 30  # pictures a second
WINDOW = (1440, 640)  # pixels; less on a smaller display


@dataclass
class PlayCommand:
    """Drive the robot by keyboard: arrows or WASD; H shows all keys."""

    env: str = "DoorCorridor-v0"
    """Environment of dynslam; a name that is none is answered with all of them."""
    slam: str = "dynamic-ml"
    """SLAM variant that maps meanwhile; `none` for no SLAM."""
    seed: int = 0
    """Seed of the first episode."""
    world: Path | None = None
    """World file (JSON) to drive in instead of the environment's own worlds."""

    def __call__(self) -> int:
        """Open a window and drive until it is closed."""
        env = self.make()
        screen = window(f"{self.env}, {self.slam}")
        import pygame

        try:
            for _ in frames(env, self.seed, screen):
                pass
        finally:
            pygame.display.quit()
            env.close()
        return 0

    def make(self) -> gym.Env[Any, Any]:
        """The environment with its SLAM. Raises InputError that lists what is known."""
        whole_number("--seed", self.seed, 0)
        one_of("--env", self.env, known_environments())
        one_of("--slam", self.slam, (*slam.variants(), "none"))
        parts: dict[str, Any] = {"world": Layout.load(self.world)} if self.world else {}
        env = gym.make(self.env, max_episode_steps=-1, render_mode="rgb_array", **parts)
        return env if self.slam == "none" else SlamWrapper(env, slam=self.slam, score_every=0)


def known_environments() -> tuple[str, ...]:
    """The worlds that dynslam_env has registered; a patrol is for agents."""
    specs = gym.registry.items()
    return tuple(name for name, spec in specs if spec.entry_point == WORLD)


def window(title: str) -> pygame.Surface:
    """An open window. Raises InputError where there is no display."""
    instead = 'use render_mode="rgb_array" and gymnasium\'s RecordVideo'
    return open_window(f"dynslam play: {title}", WINDOW, "play", instead)


def frames(
    env: gym.Env[Any, Any], seed: int, screen: pygame.Surface, fps: int = FPS
) -> Iterator[Cockpit]:
    """Drive in real time; yields after every picture, and ends when the driver quits."""
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
    """Tell the cockpit of a key, or of the window's end."""
    import pygame

    if event.type == pygame.KEYDOWN:
        cockpit.press(pygame.key.name(event.key))
    elif event.type == pygame.KEYUP:
        cockpit.release(pygame.key.name(event.key))
    elif event.type == pygame.WINDOWFOCUSLOST:
        cockpit.let_go()
    elif event.type == pygame.QUIT:
        cockpit.running = False
