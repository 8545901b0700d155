"""A world by the text that names it on a command line."""

from __future__ import annotations

from dynslam_env.simulation.registry import NAMED_WORLDS
from dynslam_env.worlds.from_map import FromMap
from dynslam_env.worlds.layout import Generator, Layout
from slam.errors import InputError
from slam.io.python_file import load_object, names_object
from slam.validation import instance, unknown_name

FORMS = "or a world file (.json), or a ROS map (.yaml), or FILE.py:NAME"


def find_world(text: str) -> Generator:
    """The generator that `text` names.

    text  a registered name; a world file (.json); a ROS map (.yaml); or FILE.py:NAME, where NAME
          is a generator, or a class or function without arguments that returns one

    Raises InputError for an unknown name, a wrong file, and an object without `layout(rng)`.
    """
    if text in NAMED_WORLDS.names():
        return NAMED_WORLDS.get(text)
    if names_object(text):
        return _loaded(text)
    if text.endswith((".yaml", ".yml")):
        return FromMap(text)
    if text.endswith(".json"):
        return Layout.load(text)
    known = unknown_name("world", text, NAMED_WORLDS.names())
    raise InputError(f"{known}; {FORMS}")


def _loaded(text: str) -> Generator:
    found = load_object(text)
    if isinstance(found, type) or not isinstance(found, Generator):
        try:
            found = found()
        except Exception as error:  # a user's function may raise anything
            raise InputError(f"{text}: no generator of a world ({error!r})") from None
    instance(text, found, Generator, "a generator, with layout(rng)")
    return found
