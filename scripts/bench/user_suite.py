"""A suite of the user's own, from a TOML file."""

from __future__ import annotations

import hashlib
import inspect
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dynslam_env import (
    WORLDS,
    CarriedAway,
    Doors,
    Effect,
    Fault,
    Gap,
    Lag,
    Laser,
    MissingBeams,
    Odometry,
    OdometryScale,
    Slip,
    Task,
    WrongBeams,
)
from dynslam_env.sensors.effects import KINDS
from dynslam_env.sensors.laser_presets import laser_named
from dynslam_env.simulation.laws import Exponential, Fixed, Periodic, Uniform
from dynslam_env.simulation.people import People
from dynslam_env.simulation.registry import NAMED_LAWS, NAMED_WORLDS
from dynslam_env.simulation.robot import Robot
from slam.errors import InputError
from slam.io.guard import guarded
from slam.io.small_text import parse_text
from slam.validation import instance, one_of, whole_number

from ..trials.sources import LogFile, SimulatedDrive, Source
from .suites import Suite, SuiteCase

SUITE_ENTRIES = ("name", "variants", "seeds", "case")
CASE_ENTRIES = ("name", "env", "log", "every", "max_episode_steps", "world", "doors", "robot",
                "laser", "odometry", "people", "task", "faults")  # fmt: skip
PARTS = {"robot": Robot, "odometry": Odometry, "people": People, "task": Task}
FAULT_KINDS = {
    fault.__name__: fault
    for fault in (Slip, OdometryScale, Lag, Gap, WrongBeams, MissingBeams, CarriedAway)
}
EFFECTS = {effect.__name__: effect for effect in KINDS}
LAWS = {law.__name__: law for law in (Uniform, Exponential, Periodic, Fixed)}


def read_suite(path: Path) -> Suite:
    """The suite in a TOML file; see docs/benchmark.md.

    Raises InputError that names the wrong entry and what is allowed.
    """
    given = parse_text(path, "a TOML file", tomllib.loads)
    with guarded(path):
        return _suite(given, path)


def _suite(given: dict[str, Any], path: Path) -> Suite:
    _only("entry", given, SUITE_ENTRIES)
    name = given.get("name", path.stem)
    instance("name", name, str)
    if not re.fullmatch(r"[\w. -]+", name):  # the name of the folder of results
        raise InputError(f"name must be of letters, digits, spaces, dots, - and _, got {name!r}")
    variants, cases = given.get("variants", []), given.get("case", [])
    if not (isinstance(variants, list) and all(isinstance(v, str) for v in variants) and variants):
        raise InputError('variants must be a list of names, such as ["static-ml", "dynamic-ml"]')
    files = [one for one in ",".join(variants).split(",") if one.strip().endswith(".toml")]
    if files:
        raise InputError(
            f"variants: {files[0].strip()!r} runs the commands in that file, which a suite may not "
            f"ask for; name it yourself: --variants"
        )
    if not (isinstance(cases, list) and cases):
        raise InputError("there must be at least one [[case]]")
    seeds = given.get("seeds", 10)
    whole_number("seeds", seeds, 1)
    made = []
    for number, case in enumerate(cases, 1):
        try:
            made.append(_case(case, number, path.parent))
        except InputError as error:
            raise InputError(f"case {number}: {error}") from None
    names = [case.condition["case"] for case in made]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"two cases are named {twice[0]!r}")
    return Suite(name, made, variants, seeds)


def _case(given: dict[str, Any], number: int, folder: Path) -> SuiteCase:
    _only("entry", given, CASE_ENTRIES)
    name = given.get("name", given.get("env", given.get("log", f"case {number}")))
    instance("name", name, str)
    if "log" in given:
        _only("entry of a case with a log", given, ("name", "log"))
        instance("log", given["log"], str)
        path = (folder / given["log"]).resolve()
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        return SuiteCase({"case": name}, partial(LogFile, path))
    env = given.get("env", "DoorCorridor-v0")
    one_of("env", env, tuple(WORLDS))
    every = given.get("every", 1)
    whole_number("every", every, 1)
    parameters = _parameters(given, env)
    code = _code_of([parameters[part] for part in ("world", "doors") if part in parameters])
    case = SuiteCase({"case": name}, partial(_drive, env, every, parameters, code))
    case.source(0).plain()  # the environment checks its parameters now
    return case


def _drive(env: str, every: int, parameters: Mapping[str, Any], code: str, seed: int) -> Source:
    return SimulatedDrive(env, seed, parameters, every, code)


def _code_of(parts: Sequence[object]) -> str:
    """A digest of the files that define registered parts; empty for dynslam's own. An episode of
    code that has changed is another one, and so is one of code without a file."""
    found = hashlib.sha256()
    own = [type(part) for part in parts if not type(part).__module__.startswith("dynslam_env.")]
    for kind in own:
        try:
            found.update(Path(inspect.getfile(kind)).read_bytes())
        except (OSError, TypeError):
            found.update(os.urandom(16))
    return found.hexdigest()[:16] if own else ""


def _parameters(given: Mapping[str, Any], env: str) -> dict[str, Any]:
    """Keywords of the environment."""
    made: dict[str, Any] = {}
    if "max_episode_steps" in given:
        whole_number("max_episode_steps", given["max_episode_steps"], 1)
        made["max_episode_steps"] = given["max_episode_steps"]
    if "world" in given:
        made["world"] = _world(given["world"], WORLDS[env][1].get("world", "corridor"))
    if "doors" in given:
        made["doors"] = _doors(given["doors"])
    if "faults" in given:
        made["faults"] = _faults(given["faults"])
    if "laser" in given:
        made["laser"] = _laser(given["laser"])
    if isinstance(given.get("robot"), str):
        made["robot"] = given["robot"]
    for name in (PARTS.keys() & given.keys()) - made.keys():
        made[name] = _changed(name, PARTS[name](), given[name])
    return made


def _world(given: Any, usual: str) -> Any:
    """A world by name, or the environment's own (or that of `kind`) with some fields replaced."""
    if isinstance(given, str):
        return NAMED_WORLDS.get(given)
    instance("world", given, dict, "a name or a table")
    kind = given.get("kind", usual)
    one_of("world.kind", kind, NAMED_WORLDS.names())
    fields_given = {name: value for name, value in given.items() if name != "kind"}
    return _changed("world", NAMED_WORLDS.get(kind), fields_given)


def _doors(given: Any) -> Any:
    """One of NAMED_LAWS, or `Doors` from a table of its fields; the law is a table with `kind`."""
    if isinstance(given, str):
        return NAMED_LAWS.get(given)
    instance("doors", given, dict, "a name or a table")
    law = given.get("law")
    others = _changed("doors", Doors(), {k: v for k, v in given.items() if k != "law"})
    if law is None:
        return others
    instance("doors.law", law, dict, "a table with its kind")
    one_of("doors.law.kind", law.get("kind"), tuple(LAWS))
    made = _changed("doors.law", LAWS[law["kind"]](), {k: v for k, v in law.items() if k != "kind"})
    return replace(others, law=made)


def _laser(given: Any) -> Laser:
    """A laser by name, or the usual one (or that of `kind`) with some fields replaced."""
    if isinstance(given, str):
        return laser_named(given)
    instance("laser", given, dict, "a name or a table")
    usual = laser_named(given["kind"]) if "kind" in given else Laser()
    others = {name: value for name, value in given.items() if name not in ("kind", "effects")}
    made = _changed("laser", usual, others)
    if "effects" not in given:
        return made
    effects: tuple[Effect, ...] = _of_kinds("effect", given["effects"], EFFECTS)
    return replace(made, effects=effects)


def _faults(given: Any) -> tuple[Fault, ...]:
    """Faults from tables of their fields; `at` is a number or a pair."""
    return _of_kinds("fault", given, FAULT_KINDS)


def _of_kinds(what: str, given: Any, kinds: Mapping[str, type]) -> tuple[Any, ...]:
    """Objects from tables of their fields, each with its `kind`; a list becomes a tuple."""
    instance(f"{what}s", given, list, "a list of tables")
    one = f"an {what}" if what[0] in "aeiou" else f"a {what}"
    made = []
    for table in given:
        instance(one, table, dict, "a table with its kind")
        one_of(f"the kind of {one}", table.get("kind"), tuple(kinds))
        plain = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items() if k != "kind"}
        made.append(_changed(f"the {what} {table['kind']}", kinds[table["kind"]](), plain))
    return tuple(made)


def _changed(name: str, part: Any, given: Any) -> Any:
    """A dataclass with some of its fields replaced."""
    instance(name, given, dict, "a table")
    if not is_dataclass(part):
        raise InputError(f"{name}: {type(part).__name__} has no fields, it is no dataclass")
    assert not isinstance(part, type)
    _only(f"field of {name}", given, tuple(f.name for f in fields(part)))
    for field, value in given.items():
        kind = np.ndarray if isinstance(getattr(part, field), np.ndarray) else None
        if kind is not None or isinstance(value, dict | list):
            raise InputError(f"{name}.{field} cannot be given in a file")
    return replace(part, **given)


def _only(what: str, given: Mapping[str, Any], allowed: tuple[str, ...]) -> None:
    instance(what, given, dict, "a table")
    for name in given:
        one_of(f"an {what}" if what.startswith("entry") else f"a {what}", name, allowed)
