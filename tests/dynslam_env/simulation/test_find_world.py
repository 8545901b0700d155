"""A world by its registered name, by a world file, and out of a user's file."""

import numpy as np
import pytest

from dynslam_env import Corridor, Layout
from dynslam_env.simulation.find_world import find_world
from slam import InputError

OWN = """
from dynslam_env import Corridor

class Wide:
    def layout(self, rng):
        return Corridor().layout(rng)

INSTANCE = Wide()

def build():
    return Wide()

def broken():
    raise OSError("no such place")

NUMBER = 3
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own_world.py"
    path.write_text(OWN)
    return path


@pytest.mark.parametrize("name", ["Wide", "INSTANCE", "build"])
def test_a_generator_of_a_file(own, name):
    layout = find_world(f"{own}:{name}").layout(np.random.default_rng(0))
    assert layout.plain() == Corridor().layout(np.random.default_rng(0)).plain()


def test_a_world_file(tmp_path):
    layout = Corridor().layout(np.random.default_rng(0))
    layout.save(tmp_path / "mine.json")
    found = find_world(str(tmp_path / "mine.json"))
    assert isinstance(found, Layout)
    assert found.plain() == layout.plain()


def test_a_registered_name():
    assert find_world("corridor") == Corridor()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("corridr", r"unknown world 'corridr'; did you mean corridor\?; or a world file"),
        ("none.json", "none.json"),
        ("none.py:Wide", "expected a Python file"),
        ("{own}:broken", "no such place"),
        ("{own}:NUMBER", "no generator of a world"),
        ("{own}:Corridors", "'Corridors' cannot be loaded"),
    ],
)
def test_what_is_no_world_is_refused(own, text, told):
    with pytest.raises(InputError, match=told):
        find_world(text.format(own=own))
