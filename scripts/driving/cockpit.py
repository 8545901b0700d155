"""A drive by keyboard in real time: takes keys, returns pictures, and opens no window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from dynslam_env import DoorWorldEnv
from dynslam_env.drawing.colours import SOLID
from dynslam_env.drawing.picture import Painter
from dynslam_env.drawing.render import WINDOW_SUPERSAMPLING
from dynslam_env.drawing.scene import Belief, Scene, belief_between, scene_between

from . import overlay
from .keys import KEY_COMMANDS, DriveCommand, drive
from .lens import Lens

if TYPE_CHECKING:
    import pygame

DT = 0.1  # s, one step of the environment
MAX_STEPS = 3  # at once; if more are due, time is skipped
MIN_PACE = 0.9  # of real time; a warning is shown below it
PACE_TIME = 1.0  # s over which the pace is averaged


class Cockpit:
    """A drive.

    env   of dynslam_env, wrapped or not, made with a render_mode; without a limit of steps
    seed  of the first episode
    """

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None):
        world = env.unwrapped
        assert isinstance(world, DoorWorldEnv)
        self._env, self._world = env, world
        self._painter = Painter(WINDOW_SUPERSAMPLING)
        self._lens = Lens()
        self.running, self.paused = True, False
        self._help, self._map = False, True
        self._commands = {
            "closer": self._closer, "farther": self._farther, "follow": self._follow,
            "map": self._toggle_map, "new": self.begin, "pause": self._pause,
            "help": self._toggle_help, "quit": self._quit,
        }  # fmt: skip
        self.begin(seed)

    def begin(self, seed: int | None = None) -> None:
        """A new episode."""
        _, info = self._env.reset(seed=seed)
        self._held: set[str] = set()
        self._drive = DriveCommand()
        self._due, self._pace, self._fresh = 0.0, 1.0, True
        self._took(info, arrived=False)
        self._before = self._now

    # -- keys ----------------------------------------------------------------------------------

    def press(self, key: str) -> None:
        """Handle a key press; `key` is pygame's name of it."""
        if key in KEY_COMMANDS:
            self._commands[KEY_COMMANDS[key]]()
        else:
            self._held.add(key)

    def release(self, key: str) -> None:
        """Handle the release of a key."""
        self._held.discard(key)

    def let_go(self) -> None:
        """Release all keys: the window has lost the keyboard focus."""
        self._held.clear()

    # -- time ----------------------------------------------------------------------------------

    def advance(self, seconds: float) -> None:
        """Simulate `seconds` of real time, as far as the machine is fast enough."""
        if self.paused or self._fresh:  # the time that the start took does not count
            self._fresh = False
            return
        self._due += seconds
        steps = min(int(self._due / DT + 1e-9), MAX_STEPS)
        for _ in range(steps):
            self._step()
        self._due -= steps * DT
        lost = max(0.0, self._due - DT)
        self._due -= lost
        share = min(seconds / PACE_TIME, 1.0)
        if seconds > 0:
            self._pace += share * (1.0 - lost / seconds - self._pace)

    def _step(self) -> None:
        self._drive = drive(self._held, self._drive, self._speed, self._world.robot)
        action = np.array(self._drive.action(self._world.robot), dtype=np.float32)
        _, _, terminated, _, info = self._env.step(action)
        self._before = self._now
        self._took(info, self._arrived or terminated)

    def _took(self, info: dict[str, Any], arrived: bool) -> None:
        self._speed = self._world.velocity[0]
        self._bumped, self._arrived = bool(info["collision"]), arrived
        belief = self._world.belief
        self._now: tuple[Scene, Belief | None] = self._world.scene(), belief() if belief else None

    # -- picture -------------------------------------------------------------------------------

    def picture(self, size: tuple[int, int]) -> pygame.Surface:
        """The picture for a window of `size` pixels."""
        import pygame

        surface = pygame.Surface(size)
        surface.fill(SOLID)
        scene, belief = self._shown()
        room = size[0], size[1] - overlay.STATUS_HEIGHT
        view = self._lens.view(scene.walls, room, 1 if belief is None else 2)
        surface.blit(self._painter.picture(scene, belief, view), (0, 0))
        overlay.bottom_line(surface, *self._status())
        if self._help:
            overlay.help_panel(surface)
        elif self.paused:
            overlay.notice(surface, "paused: P goes on")
        return surface

    def _shown(self) -> tuple[Scene, Belief | None]:
        """Scene and belief interpolated between the last two steps, for smooth motion."""
        (old, old_belief), (new, new_belief) = self._before, self._now
        share = min(self._due / DT, 1.0)
        scene = scene_between(old, new, share)
        if not self._map or old_belief is None or new_belief is None:
            return scene, None
        return scene, belief_between(old_belief, new_belief, share)

    def _status(self) -> tuple[str, bool]:
        """The status line, and whether it is a warning."""
        if self._pace < MIN_PACE:
            return f"this machine is too slow: {self._pace:.1f} x real time", True
        if self._bumped:
            return "bumped into something", True
        arrived = "arrived: R for another   " if self._arrived else ""
        return f"{arrived}{self._speed:.2f} m/s", False

    # -- commands ------------------------------------------------------------------------------

    def _closer(self) -> None:
        self._lens = self._lens.closer()

    def _farther(self) -> None:
        self._lens = self._lens.farther()

    def _follow(self) -> None:
        pose = self._world.pose
        self._lens = self._lens.toggled((pose.x, pose.y))

    def _toggle_map(self) -> None:
        self._map = not self._map

    def _pause(self) -> None:
        self.paused = not self.paused

    def _toggle_help(self) -> None:
        self._help = not self._help

    def _quit(self) -> None:
        self.running = False
