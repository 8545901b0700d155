"""Furniture: rectangles that stand in rooms, mostly along walls, out of everybody's way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dynslam_env.worlds.clearance import clear, clear_of_legs, edges
from dynslam_env.worlds.outline import Rect
from slam.geometry import Array

SIDES = 0.4, 1.2  # m, shortest and longest side of a piece
ALONG_WALLS = 0.75  # share of the pieces
OFF_WALL = 0.03  # m, from a wall at least
APART = 0.1  # m, between pieces, and from wherever a leaf may swing
TRIES = 40


def furnish(
    room: Rect,
    pieces: int,
    ways: Array,
    free: float,
    sweeps: Sequence[Array],
    rng: np.random.Generator,
) -> list[Array]:
    """Outlines (4, 4), m, of `pieces` in a room; fewer where no more were found to fit.

    ways    (n, 4) segments, m, that stay free to `free` m on either side
    sweeps  outlines of where leaves may swing
    """
    placed: list[Array] = []
    for _ in range(pieces):
        for _ in range(TRIES):
            piece = _piece(room, rng)
            if piece is not None and _stands_free(piece, ways, free, [*sweeps, *placed]):
                placed.append(piece)
                break
    return placed


def _stands_free(piece: Array, ways: Array, free: float, others: list[Array]) -> bool:
    return clear_of_legs(piece, ways, free) and all(clear(piece, each, APART) for each in others)


def _piece(room: Rect, rng: np.random.Generator) -> Array | None:
    """A rectangle in the room: along a wall, or turned anyhow; None if it sticks out."""
    a, b, which, side, turn, u, v = rng.random(7).tolist()
    long, short = (SIDES[0] + (SIDES[1] - SIDES[0]) * each for each in (max(a, b), min(a, b)))
    along_wall = which < ALONG_WALLS
    angle = int(2 * turn) * math.pi / 2 if along_wall else turn * math.pi
    c, s = math.cos(angle), math.sin(angle)
    wide, high = long * abs(c) + short * abs(s), long * abs(s) + short * abs(c)
    spare_x = room.right - room.left - wide - 2 * OFF_WALL
    spare_y = room.top - room.bottom - high - 2 * OFF_WALL
    if spare_x < 0 or spare_y < 0:
        return None
    if along_wall:  # its long side at one of two walls
        u, v = (u, round(side)) if turn < 0.5 else (round(side), v)
    x = room.left + OFF_WALL + wide / 2 + u * spare_x
    y = room.bottom + OFF_WALL + high / 2 + v * spare_y
    corners = np.array([(long, short), (-long, short), (-long, -short), (long, -short)]) / 2
    return edges(corners @ np.array([(c, s), (-s, c)]) + (x, y))
