"""All that makes an environment: its parts, checked, and the spaces that follow from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.odometry import MAX_STEP, Odometry
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.laws import Fixed, Law
from dynslam_env.simulation.people import People
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.task import Task
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Generator
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from slam.validation import instance, one_of

NAMED_DOORS = {"moving": Doors(), "static": Doors(law=Fixed())}
NAMED_WORLDS = {"corridor": Corridor(), "loop": Loop(), "office": Office(),
                "crowd": Corridor(people=6)}  # fmt: skip


@dataclass(frozen=True)
class Setup:
    """The parts of an environment, as its keywords name them."""

    world: Generator = field(default_factory=Corridor)
    doors: Doors = field(default_factory=Doors)
    robot: Robot = field(default_factory=Robot)
    laser: Laser = field(default_factory=Laser)
    odometry: Odometry = field(default_factory=Odometry)
    people: People = field(default_factory=People)
    task: Task = field(default_factory=Task)

    @staticmethod
    def of(parts: dict[str, Any]) -> Setup:
        """From keywords: None is a default, a string one of NAMED_DOORS or NAMED_WORLDS.

        Raises InputError that says what was wrong and what is allowed.
        """
        given = {name: part for name, part in parts.items() if part is not None}
        for name, named in (("doors", NAMED_DOORS), ("world", NAMED_WORLDS)):
            if isinstance(given.get(name), str):
                one_of(name, given[name], tuple(named))
                given[name] = named[given[name]]
        doors = given.get("doors")
        if isinstance(doors, Law) and not isinstance(doors, type):
            given["doors"] = Doors(law=doors)
        for name, part in given.items():
            instance(name, part, KINDS[name], ALLOWED.get(name))
        return Setup(**given)

    def plain(self) -> dict[str, Any]:
        """All parameters, as plain data for JSON."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}

    def action_space(self) -> spaces.Space[Any]:
        """Forward and turning velocity, normalised."""
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def observation_space(self) -> spaces.Dict:
        """Scan, odometry, velocity."""
        laser, robot = self.laser, self.robot
        step = np.array(MAX_STEP, dtype=np.float32)
        speed = np.array([robot.max_speed, robot.max_turn], dtype=np.float32)
        return spaces.Dict(
            {
                "scan": spaces.Box(0.0, laser.max_range, (laser.beams,), np.float32),
                "odometry": spaces.Box(-step, step, dtype=np.float32),
                "velocity": spaces.Box(-speed, speed, dtype=np.float32),
            }
        )


KINDS = {"world": Generator, "doors": Doors, "robot": Robot, "laser": Laser,
         "odometry": Odometry, "people": People, "task": Task}  # fmt: skip

ALLOWED = {
    "doors": '"moving", "static", a law such as Uniform(5, 20), or a Doors',
    "world": '"corridor", "loop", "office", "crowd", a Corridor, Loop, Office or Layout, or '
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
    return part if isinstance(part, bool | int | float | str | None) else repr(part)
