"""Varied: a world whose size, rooms, doors, furniture and people are drawn anew in each episode."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Generator, Layout
from dynslam_env.worlds.levels import CLUTTER, DOOR_WIDTHS, PEOPLE, SIZES, WING_COUNTS
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.wings import Wings
from slam.errors import InputError
from slam.validation import one_of

MAX_DRAWS = 50  # of the parameters of a world, until they fit together
KINDS = {Corridor: "corridor", Loop: "loop", Office: "office", Wings: "wings"}


@dataclass(frozen=True)
class Varied:
    """A world of corridors or rooms whose parameters are drawn anew in each episode.

    The difficulty gives the range of each parameter: footprint, number of rooms and doors, widths
    of doors, furniture, oblique corners, people. A medium or hard world is also turned by a random
    angle, so that its walls are not along the axes. Parameters that no difficulty names (`laps`,
    `clearance`, ...) are those of `world`, and its people are there in addition.

    world       a Corridor, Loop, Office or Wings; of these, people are in each corridor
    difficulty  "easy", "medium" or "hard"
    """

    world: Corridor | Loop | Office | Wings
    difficulty: str

    def __post_init__(self) -> None:
        one_of("difficulty", self.difficulty, DIFFICULTIES)
        if not isinstance(self.world, Corridor | Loop | Office | Wings):
            raise InputError(
                f"difficulty varies a Corridor, a Loop, an Office or Wings, got {self.world}"
            )

    def layout(self, rng: np.random.Generator) -> Layout:
        """A layout; parameters that do not fit together are drawn again."""
        reason = ""
        for _ in range(MAX_DRAWS):
            try:
                drawn = self._drawn(rng).layout(rng)
            except InputError as error:
                reason = str(error)
                continue
            turned = self.difficulty != "easy"
            return drawn.turned(rng.uniform(-math.pi, math.pi)) if turned else drawn
        raise InputError(f"{MAX_DRAWS} draws of {self} gave no world; the last one: {reason}")

    def _drawn(self, rng: np.random.Generator) -> Generator:
        """The world with parameters from the ranges of the difficulty."""
        if not isinstance(self.world, Wings):
            return replace(self.world, **self._parameters(self.world.people, rng))
        corridor = self.world.corridor
        corridor = replace(corridor, **self._parameters(corridor.people, rng))
        count = int(WING_COUNTS[self.difficulty].draw(rng))
        return replace(self.world, wings=count, corridor=corridor)

    def _parameters(self, people: int, rng: np.random.Generator) -> dict[str, Any]:
        level, sizes = self.difficulty, SIZES[KINDS[type(self.world)]]
        ranges = {"door_width": DOOR_WIDTHS[level], **sizes[level], **CLUTTER[level]}
        drawn = {name: each.draw(rng) for name, each in ranges.items()}
        return drawn | {"people": people + int(PEOPLE[level].draw(rng))}


def at_difficulty(world: Generator, difficulty: str) -> Varied:
    """The world at this difficulty; raises InputError for a world that has no difficulties."""
    return Varied(world.world if isinstance(world, Varied) else world, difficulty)  # type: ignore[arg-type]
