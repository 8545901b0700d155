"""WorldConfig: the parts of an environment, checked, and the keywords that name them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from inspect import Parameter, signature
from typing import Any, TypedDict, TypeVar, get_type_hints

import numpy as np
from gymnasium import spaces

from dynslam_env.faults.episode_faults import check_faults
from dynslam_env.faults.fault import Fault
from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.laser_presets import LASERS
from dynslam_env.sensors.odometry import MAX_DISPLACEMENT, Odometry, OdometryModel
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.laws import Law
from dynslam_env.simulation.people import People
from dynslam_env.simulation.registry import NAMED_LAWS, NAMED_WORLDS
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.robot_presets import ROBOTS, equipped
from dynslam_env.simulation.task import Task
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Generator
from dynslam_env.worlds.varied import at_difficulty
from slam.validation import instance

Config = TypeVar("Config")


class PlaceKeywords(TypedDict, total=False):
    """Keywords of every environment; None stands for the default."""

    world: str | Generator | None
    difficulty: str | None
    doors: str | Law | Doors | None
    robot: str | Robot | None
    laser: str | Laser | None
    odometry: OdometryModel | None
    people: People | None
    faults: Sequence[Fault] | None


class WorldKeywords(PlaceKeywords, total=False):
    """Keywords of the environments of one robot without a SLAM."""

    task: Task | None


def check_keywords(env: type, keywords: type, given: Mapping[str, Any]) -> None:
    """Raise TypeError for a keyword that an environment does not take; it names the allowed ones.

    keywords  the TypedDict of the parameters that `env` collects by `**`
    """
    allowed = keywords.__annotations__
    for name in given:
        if name not in allowed:
            named = signature(env).parameters.values()
            listed = [p.name for p in named if p.kind is not Parameter.VAR_KEYWORD] + list(allowed)
            raise TypeError(
                f"{env.__name__}() got an unexpected keyword argument {name!r}; "
                f"allowed are {', '.join(listed)}"
            )


def split_keywords(
    config: Callable[..., Config], keywords: Mapping[str, Any]
) -> tuple[Config, dict[str, Any]]:
    """A `config` (a dataclass) from those keywords that are its fields, and the other keywords."""
    others = dict(keywords)
    own = {name: others.pop(name) for name in signature(config).parameters if name in others}
    return config(**own), others


@dataclass(frozen=True)
class WorldConfig:
    """The parts of an environment, as its keywords name them.

    world     draws the layout of each episode
    doors     how doors move
    robot     body, speeds, accelerations
    laser     beams, field of view, range, noise, mount
    odometry  what the wheels report: with errors, or by ticks
    people    how people walk
    task      reward terms and ends
    faults    what goes wrong; by default nothing
    """

    world: Generator = field(default_factory=Corridor)
    doors: Doors = field(default_factory=Doors)
    robot: Robot = field(default_factory=Robot)
    laser: Laser = field(default_factory=Laser)
    odometry: OdometryModel = field(default_factory=Odometry)
    people: People = field(default_factory=People)
    task: Task = field(default_factory=Task)
    faults: tuple[Fault, ...] = ()

    @staticmethod
    def of(keywords: Mapping[str, Any]) -> WorldConfig:
        """From `WorldKeywords`: a string is a registered name or a preset, a law stands for doors
        that obey it.

        Raises InputError that says what was wrong and what is allowed.
        """
        given = {name: part for name, part in keywords.items() if part is not None}
        if isinstance(given.get("world"), str):
            given["world"] = NAMED_WORLDS.get(given["world"])
        difficulty = given.pop("difficulty", None)
        doors = given.get("doors")
        if isinstance(doors, str):
            doors = NAMED_LAWS.get(doors)
        if isinstance(doors, Law) and not isinstance(doors, type):
            given["doors"] = Doors(law=doors)
        given |= equipped(given.get("robot"), given.get("laser"))
        faults = check_faults(given.pop("faults", ()))
        for name, part in given.items():
            instance(name, part, PART_TYPES[name], ALLOWED_VALUES.get(name))
        config = WorldConfig(**given, faults=faults)
        return replace(config, world=config.place(difficulty))

    def place(self, difficulty: str | None) -> Generator:
        """What draws the layouts of this difficulty; None: the world as it is configured."""
        return self.world if difficulty is None else at_difficulty(self.world, difficulty)

    def plain(self) -> dict[str, Any]:
        """All parameters, as plain data for JSON."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}

    def action_space(self) -> spaces.Space[Any]:
        """Forward and turning velocity, normalised."""
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def observation_space(self) -> spaces.Dict:
        """Scan, odometry, velocity."""
        laser, robot = self.laser, self.robot
        step = np.array(MAX_DISPLACEMENT, dtype=np.float32)
        speed = np.array([robot.max_speed, robot.max_turn], dtype=np.float32)
        return spaces.Dict(
            {
                "scan": spaces.Box(0.0, laser.max_range, (laser.beams,), np.float32),
                "odometry": spaces.Box(-step, step, dtype=np.float32),
                "velocity": spaces.Box(-speed, speed, dtype=np.float32),
            }
        )


PART_TYPES = get_type_hints(WorldConfig)

ALLOWED_VALUES = {
    "robot": f"a Robot, or one of {', '.join(ROBOTS)}",
    "laser": f"a Laser, or one of {', '.join(LASERS)}",
    "doors": '"moving", "static", a law such as Uniform(5, 20), or a Doors',
    "odometry": "an Odometry or WheelEncoders",
    "world": '"corridor", "loop", "office", "crowd", "wings", a Corridor, Loop, Office, Wings or '
    "Layout, or "
    "anything else with layout(rng) -> Layout",
}


def _plain(part: Any) -> Any:
    """JSON of a part: objects by their type's name and their fields."""
    if is_dataclass(part) and not isinstance(part, type):
        named = {f.name: _plain(getattr(part, f.name)) for f in fields(part)}
        return {"type": type(part).__name__} | named
    if isinstance(part, Mapping):
        return {name: _plain(value) for name, value in part.items()}
    if isinstance(part, tuple | list):
        return [_plain(value) for value in part]
    if isinstance(part, np.ndarray):
        return part.tolist()
    if type(part).__repr__ is object.__repr__:  # it names an address, not the content
        named = {name: _plain(value) for name, value in getattr(part, "__dict__", {}).items()}
        return {"type": type(part).__name__} | named
    return part if isinstance(part, bool | int | float | str | None) else repr(part)
