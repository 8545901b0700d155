"""Titles, legend and scale bar of a picture, of the same size at any zoom."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from dynslam_env.drawing.colours import BLUE, INK, PAPER, VERMILION, Colour

if TYPE_CHECKING:
    import pygame

TITLE_HEIGHT = 30  # pixels, of the strip above a panel
FONT_SIZE = 20  # of pygame's default font
TEXT_MARGIN = 10  # pixels
MAX_SCALE_BAR = 110  # pixels, longest scale bar


def text(surface: pygame.Surface, words: str, x: int, middle: int, colour: Colour = INK) -> int:
    """Write from `x` to the right, vertically centred at `middle`; returns the x of its end."""
    letters = _letters(words, colour)
    surface.blit(letters, (x, middle - letters.get_height() // 2 + 1))
    return x + letters.get_width()


def width_of(words: str) -> int:
    """Width of a text, pixels."""
    return _letters(words, INK).get_width()


def shortened(words: str, room: int) -> str:
    """The text, truncated to `room` pixels."""
    if width_of(words) <= room:
        return words
    while words and width_of(words + " ...") > room:
        words = words[:-1]
    return words + " ..."


def title(strip: pygame.Surface, words: str, taken: int) -> None:
    """Write a title on an empty strip, except on its last `taken` pixels."""
    strip.fill(PAPER)
    room = strip.get_width() - taken - 2 * TEXT_MARGIN
    text(strip, shortened(words, room), TEXT_MARGIN, TITLE_HEIGHT // 2)


def scale_bar(strip: pygame.Surface, pixels_per_metre: float) -> None:
    """Draw a scale bar of a round length at the right end of a strip."""
    import pygame

    metres = bar_length(pixels_per_metre)
    right, y = strip.get_width() - TEXT_MARGIN - 2, TITLE_HEIGHT // 2
    left = right - round(metres * pixels_per_metre)
    pygame.draw.line(strip, INK, (left, y), (right, y), 2)
    for x in (left, right):
        pygame.draw.line(strip, INK, (x, y - 4), (x, y + 5), 2)
    words = f"{metres:g} m"
    text(strip, words, left - width_of(words) - 8, y)


def bar_length(pixels_per_metre: float) -> float:
    """Length of the scale bar, m: the largest 1, 2 or 5 times a power of ten that fits."""
    most = MAX_SCALE_BAR / pixels_per_metre
    power = 10.0 ** math.floor(math.log10(most))
    return max(step for step in (power, 2 * power, 5 * power) if step <= most)


def legend(strip: pygame.Surface) -> None:
    """Draw the legend, true and estimated robot, at the right end of a strip."""
    import pygame

    y, x = TITLE_HEIGHT // 2, strip.get_width() - LEGEND_WIDTH
    pygame.draw.aacircle(strip, BLUE, (x, y), 7, 2)
    x = text(strip, "true", x + 12, y) + 22
    pygame.draw.aacircle(strip, VERMILION, (x, y), 7)
    text(strip, "estimated", x + 12, y)


LEGEND_WIDTH = 154  # pixels


@lru_cache(maxsize=128)  # loading a font costs more than writing all texts
def _letters(words: str, colour: Colour) -> pygame.Surface:
    import pygame

    pygame.font.init()
    return pygame.font.Font(None, FONT_SIZE).render(words, True, colour)
