"""Texts on a picture: titles, legend, scale bar. They have one size at any zoom."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from dynslam_env.drawing.colours import BLUE, INK, PAPER, VERMILION, Colour

if TYPE_CHECKING:
    import pygame

TITLE = 30  # pixels, strip above a panel
SIZE = 20  # of the letters
MARGIN = 10  # pixels
BAR = 110  # pixels, a scale bar is as long as that at most


def text(surface: pygame.Surface, words: str, x: int, middle: int, colour: Colour = INK) -> int:
    """Write from `x` on, around the height `middle`; returns where it ends."""
    letters = _letters(words, colour)
    surface.blit(letters, (x, middle - letters.get_height() // 2 + 1))
    return x + letters.get_width()


def width_of(words: str) -> int:
    """Pixels that a text takes."""
    return _letters(words, INK).get_width()


def shortened(words: str, room: int) -> str:
    """The text, cut to `room` pixels."""
    if width_of(words) <= room:
        return words
    while words and width_of(words + " ...") > room:
        words = words[:-1]
    return words + " ..."


def title(strip: pygame.Surface, words: str, taken: int) -> None:
    """A line of text on an empty strip, of which the last `taken` pixels are for something else."""
    strip.fill(PAPER)
    room = strip.get_width() - taken - 2 * MARGIN
    text(strip, shortened(words, room), MARGIN, TITLE // 2)


def scale_bar(strip: pygame.Surface, pixels_per_metre: float) -> None:
    """A round length, at the right end of a strip."""
    import pygame

    metres = bar_length(pixels_per_metre)
    right, y = strip.get_width() - MARGIN - 2, TITLE // 2
    left = right - round(metres * pixels_per_metre)
    pygame.draw.line(strip, INK, (left, y), (right, y), 2)
    for x in (left, right):
        pygame.draw.line(strip, INK, (x, y - 4), (x, y + 5), 2)
    words = f"{metres:g} m"
    text(strip, words, left - width_of(words) - 8, y)


def bar_length(pixels_per_metre: float) -> float:
    """1, 2 or 5 times a power of ten, m: the longest that is not too long."""
    most = BAR / pixels_per_metre
    power = 10.0 ** math.floor(math.log10(most))
    return max(step for step in (power, 2 * power, 5 * power) if step <= most)


def legend(strip: pygame.Surface) -> None:
    """Which robot is which, at the right end of a strip."""
    import pygame

    y, x = TITLE // 2, strip.get_width() - LEGEND
    pygame.draw.aacircle(strip, BLUE, (x, y), 7, 2)
    x = text(strip, "true", x + 12, y) + 22
    pygame.draw.aacircle(strip, VERMILION, (x, y), 7)
    text(strip, "estimated", x + 12, y)


LEGEND = 154  # pixels that it takes


@lru_cache(maxsize=128)  # loading a font costs more than all else that is written
def _letters(words: str, colour: Colour) -> pygame.Surface:
    import pygame

    pygame.font.init()
    return pygame.font.Font(None, SIZE).render(words, True, colour)
