"""A window on the display; without a display, an error that says what to do instead."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from slam.errors import InputError

if TYPE_CHECKING:
    import pygame

MAX_DISPLAY_SHARE = 0.92  # of the display's width and height
DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")  # on Linux


def open_window(title: str, size: tuple[int, int], who: str, instead: str) -> pygame.Surface:
    """Open a window of `size` pixels, smaller on a smaller display.

    Raises InputError without a display; it says `who` needs one and what to do `instead`.
    """
    import pygame

    if sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAY_VARIABLES):
        raise _no_display(who, f"none of {', '.join(DISPLAY_VARIABLES)} is set", instead)
    try:
        pygame.display.init()
        width, height = (
            int(MAX_DISPLAY_SHARE * side) for side in pygame.display.get_desktop_sizes()[0]
        )
        size = min(size[0], width), min(size[1], height)
        screen = pygame.display.set_mode(size, pygame.RESIZABLE)
        if pygame.display.get_driver() == "offscreen":
            raise _no_display(who, "the named display does not answer", instead)
    except pygame.error as error:
        raise _no_display(who, str(error), instead) from None
    pygame.display.set_caption(title)
    return screen


def _no_display(who: str, why: str, instead: str) -> InputError:
    return InputError(
        f"{who} needs a display to open its window on, and found none ({why}); without one, "
        f"{instead}"
    )
