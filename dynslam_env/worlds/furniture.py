"""Furniture: random rectangles in rooms, mostly along walls, clear of paths and leaves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dynslam_env.worlds.clearance import clear, clear_of_legs, edges
from dynslam_env.worlds.outline import Rect
from slam.geometry import Array

MIN_PIECE_SIDE, MAX_PIECE_SIDE = 0.4, 1.2  # m, of a piece
ALONG_WALLS_SHARE = 0.75  # of the pieces
WALL_CLEARANCE = 0.03  # m, least distance of a piece from the walls
PIECE_CLEARANCE = 0.1  # m, between pieces, and from the areas that leaves sweep
MAX_PIECE_TRIES = 40  # positions tried for a piece


def furnish(
    room: Rect,
    pieces: int,
    ways: Array,
    free: float,
    sweeps: Sequence[Array],
    rng: np.random.Generator,
) -> list[Array]:
    """Outlines (4, 4), m, of `pieces` in a room; fewer where no more fit.

    ways    (n, 4) segments, m, from which pieces keep a distance of `free` m
    sweeps  outlines of the areas that leaves sweep
    """
    placed: list[Array] = []
    for _ in range(pieces):
        for _ in range(MAX_PIECE_TRIES):
            piece = _piece(room, rng)
            if piece is not None and _stands_free(piece, ways, free, [*sweeps, *placed]):
                placed.append(piece)
                break
    return placed


def _stands_free(piece: Array, ways: Array, free: float, others: list[Array]) -> bool:
    return clear_of_legs(piece, ways, free) and all(
        clear(piece, each, PIECE_CLEARANCE) for each in others
    )


def _piece(room: Rect, rng: np.random.Generator) -> Array | None:
    """A rectangle in the room, along a wall or at a random angle; None if it does not fit."""
    a, b, which, side, turn, u, v = rng.random(7).tolist()
    long, short = (
        MIN_PIECE_SIDE + (MAX_PIECE_SIDE - MIN_PIECE_SIDE) * each for each in (max(a, b), min(a, b))
    )
    along_wall = which < ALONG_WALLS_SHARE
    angle = int(2 * turn) * math.pi / 2 if along_wall else turn * math.pi
    c, s = math.cos(angle), math.sin(angle)
    wide, high = long * abs(c) + short * abs(s), long * abs(s) + short * abs(c)
    spare_x = room.right - room.left - wide - 2 * WALL_CLEARANCE
    spare_y = room.top - room.bottom - high - 2 * WALL_CLEARANCE
    if spare_x < 0 or spare_y < 0:
        return None
    if along_wall:  # its long side along one of two walls
        u, v = (u, round(side)) if turn < 0.5 else (round(side), v)
    x = room.left + WALL_CLEARANCE + wide / 2 + u * spare_x
    y = room.bottom + WALL_CLEARANCE + high / 2 + v * spare_y
    corners = np.array([(long, short), (-long, short), (-long, -short), (long, -short)]) / 2
    return edges(corners @ np.array([(c, s), (-s, c)]) + (x, y))
