"""Registries of worlds and door laws by name, as in `world="office"` and `doors="moving"`.

Users add theirs with `register_world` and `register_law`. A package that declares an entry point of
the group `dynslam.worlds` (its object a `Generator`) or `dynslam.laws` (a `Law`) makes it known to
every command without an import.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic, TypeVar

from dynslam_env.simulation.laws import Fixed, Law, Uniform
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Generator
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.wings import Wings
from slam.errors import InputError
from slam.plugins import load_entry_points
from slam.validation import instance, one_of

Part = TypeVar("Part")


class Registry(Generic[Part]):
    """Parts of an environment by name.

    keyword   the environments' keyword that takes the names
    protocol  protocol that each part implements
    group     of the entry points by which installed packages add theirs
    own       built-in parts, whose names are reserved
    """

    def __init__(self, keyword: str, protocol: type, group: str, own: Mapping[str, Part]):
        self._keyword, self._protocol, self._group = keyword, protocol, group
        self._own, self._parts, self._discovered = frozenset(own), dict(own), False

    def register(self, name: str, part: Part) -> None:
        """Make `part` known as `name` in this process."""
        if not name or any(c.isspace() or c == "," for c in name):
            raise InputError(f"a name for {self._keyword}= has no spaces or commas, got {name!r}")
        if name in self._own:
            raise InputError(f"{self._keyword}={name!r} is dynslam's own; choose another name")
        instance(f"{self._keyword}={name!r}", part, self._protocol)
        self._parts[name] = part

    def names(self) -> tuple[str, ...]:
        """All registered names, in the order of their registration."""
        self._discover()
        return tuple(self._parts)

    def get(self, name: str) -> Part:
        """The part that is registered as `name`; raises InputError for an unknown name."""
        if name not in self._parts:
            one_of(self._keyword, name, self.names())
        return self._parts[name]

    def _discover(self) -> None:
        """Register the entry points of all installed packages, once; registered names are kept."""
        if not self._discovered:
            self._discovered = True
            load_entry_points(self._group, self._parts.__contains__, self.register)


NAMED_WORLDS: Registry[Generator] = Registry(
    "world", Generator, "dynslam.worlds",
    {"corridor": Corridor(), "loop": Loop(), "office": Office(), "crowd": Corridor(people=6),
     "wings": Wings()},
)  # fmt: skip
NAMED_LAWS: Registry[Law] = Registry(
    "doors", Law, "dynslam.laws", {"moving": Uniform(), "static": Fixed()}
)


def register_world(name: str, generator: Generator) -> None:
    """Make `generator` known as `world=name` to all environments and commands of this process.

    Raises InputError for a name with spaces or commas, for one of dynslam's own, and for an object
    without `layout(rng)`.
    """
    NAMED_WORLDS.register(name, generator)


def register_law(name: str, law: Law) -> None:
    """Make `law` known as `doors=name` to all environments and commands of this process.

    Raises InputError for a name with spaces or commas, for one of dynslam's own, and for an object
    without `initial_states(is_open, rng)` and `clock(count, rng)`.
    """
    NAMED_LAWS.register(name, law)
