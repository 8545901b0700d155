"""What is written over a drive: a line below, the keys, a word in the middle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dynslam_env.drawing import captions, colours
from dynslam_env.drawing.colours import Colour

from .keys import HELP, LINE

if TYPE_CHECKING:
    import pygame

STRIP = 30  # pixels, the line below
ROW = 26  # pixels, of the keys
VEIL = (24, 28, 34, 225)
SNOW: Colour = (245, 246, 248)


def bottom_line(surface: pygame.Surface, status: str, warning: bool) -> None:
    """Keys on the left, status on the right."""
    width, height = surface.get_size()
    middle = height - STRIP // 2
    surface.fill(colours.PAPER, (0, height - STRIP, width, STRIP))
    right = width - captions.width_of(status) - captions.TEXT_MARGIN
    colour = colours.VERMILION if warning else colours.INK
    captions.text(surface, status, right, middle, colour)
    keys = captions.shortened(LINE, right - 3 * captions.TEXT_MARGIN)
    captions.text(surface, keys, captions.TEXT_MARGIN, middle, colours.GREY)


def help_panel(surface: pygame.Surface) -> None:
    """All keys, in the middle."""
    first = max(captions.width_of(key) for key, _ in HELP)
    second = max(captions.width_of(what) for _, what in HELP)
    width, height = first + second + 90, ROW * len(HELP) + 70
    top = max((surface.get_height() - STRIP - height) // 2, 0)
    left = _veil(surface, width, height, top)
    captions.text(surface, "Drive the robot, and watch the map grow", left + 30, top + 28, SNOW)
    for i, (key, what) in enumerate(HELP):
        y = top + 66 + i * ROW
        captions.text(surface, key, left + 30, y, colours.SKY)
        captions.text(surface, what, left + 60 + first, y, SNOW)


def notice(surface: pygame.Surface, words: str) -> None:
    """A word at the top, in the middle."""
    width, top = captions.width_of(words) + 60, 50
    left = _veil(surface, width, 50, top)
    captions.text(surface, words, left + 30, top + 25, SNOW)


def _veil(surface: pygame.Surface, width: int, height: int, top: int) -> int:
    """Darken a rectangle half way across; where that begins."""
    import pygame

    veil = pygame.Surface((width, height), pygame.SRCALPHA)
    pygame.draw.rect(veil, VEIL, veil.get_rect(), border_radius=10)
    left = (surface.get_width() - width) // 2
    surface.blit(veil, (left, top))
    return left
