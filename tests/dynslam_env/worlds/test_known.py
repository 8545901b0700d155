"""What worlds draw is not checked when an episode begins: it would pass the checks."""

from __future__ import annotations

import numpy as np
import pytest

from dynslam_env.simulation.config import WorldConfig
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.floor_plan import FloorPlan
from dynslam_env.worlds.layout import Layout
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.wings import Wings
from slam.errors import InputError

NAMED = {
    f"{name}-{level}": WorldConfig.of({"world": name}).place(level)
    for name in ("corridor", "loop", "office", "crowd", "wings")
    for level in ("easy", "medium", "hard")
}
WORLDS = NAMED | {
    "no doors": Corridor(doors_per_side=0),
    "tight": Corridor(length=2 * 1.4, doors_per_side=2, partition=0.25),
    "whole numbers": Corridor(length=14, width=2, door_width=1, room_depth=3, margin=1),
    "laps": Loop(laps=3),
    "one room each": Office(length=6.0, breadth=3.0, doors=0),
    "full": Office(furniture=2, people=1, cut=1.0, doubled=0.5, sliding=0.5, narrowest=0.6),
    "bends": Wings(wings=4),
}


def checked(spaces, doorways, door_thickness, walls=None):
    """A plan that is checked, and finds its walls itself."""
    return FloorPlan(spaces, doorways, door_thickness)


@pytest.mark.parametrize("name", WORLDS)
def test_what_is_drawn_passes_the_checks(name, monkeypatch):
    world = WORLDS[name]
    drawn = [world.layout(np.random.default_rng(seed)) for seed in range(8)]
    monkeypatch.setattr(FloorPlan, "known", staticmethod(checked))
    for seed, layout in enumerate(drawn):
        parts = layout.walls, layout.doors, layout.start, layout.path, layout.routes
        assert Layout(*parts).plain() == layout.plain()
        for array in (layout.walls, layout.path, *layout.routes):
            assert array.dtype == np.float64
            assert not array.flags.writeable
        assert all(type(number) is float for number in layout.start)
        assert world.layout(np.random.default_rng(seed)).plain() == layout.plain()


@pytest.mark.parametrize("kind", [Corridor, Loop, Office])
@pytest.mark.parametrize("size", ["door_width", "wall_thickness", "door_thickness", "cut"])
def test_sizes_of_which_nothing_can_be_drawn_are_refused(kind, size):
    with pytest.raises(InputError, match=size):
        kind(**{size: 1e-17})
