"""A window on the display, if there is one."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from slam.errors import InputError

if TYPE_CHECKING:
    import pygame

PART = 0.92  # of the display at most
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")  # what Linux tells of a display


def open_window(title: str, size: tuple[int, int], who: str, instead: str) -> pygame.Surface:
    """A window of `size` pixels, less on a smaller display. Raises InputError where there is none,
    which says `who` needs it and what to do `instead`."""
    import pygame

    if sys.platform == "linux" and not any(os.environ.get(name) for name in SCREENS):
        raise _no_display(who, f"none of {', '.join(SCREENS)} is set", instead)
    try:
        pygame.display.init()
        width, height = (int(PART * side) for side in pygame.display.get_desktop_sizes()[0])
        size = min(size[0], width), min(size[1], height)
        screen = pygame.display.set_mode(size, pygame.RESIZABLE)
        if pygame.display.get_driver() == "offscreen":
            raise _no_display(who, "the one that is named does not answer", instead)
    except pygame.error as error:
        raise _no_display(who, str(error), instead) from None
    pygame.display.set_caption(title)
    return screen


def _no_display(who: str, why: str, instead: str) -> InputError:
    return InputError(
        f"{who} needs a display to open its window on, and found none ({why}); without one, "
        f"{instead}"
    )
