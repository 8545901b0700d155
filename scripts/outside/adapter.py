"""The adapter of an outside SLAM system: a TOML file that says how to run its program."""

from __future__ import annotations

import os
import shlex
import sys
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from slam.errors import InputError
from slam.io.guard import guarded
from slam.io.small_text import parse_text
from slam.validation import instance, number, one_of, positive_number, unknown_name, whole_number

from .result_file import PLAIN, STAMPS, check_columns

PREFIX = "outside:"
FOLDERS_VARIABLE = "DYNSLAM_OUTSIDE"
ENTRY_POINTS = "dynslam.outside"
READY = Path(__file__).parent / "ready"
LOG_FORMATS = ("carmen", "csv", "npz", "mcap")
PLACES = ("log", "out", "folder", "python", "seed")  # in a command, in braces


@dataclass(frozen=True)
class Adapter:
    """How to run an outside SLAM system.

    name        after `outside:`
    folder      of the TOML file: `{folder}` in a command
    commands    run one after the other, in an empty folder; words are separated as by a shell
    prepare     commands that run before these and are not measured, such as a conversion
    log         format of the recording that it reads
    max_beams   of a scan: of more, each k-th is kept, with the least k that suffices
    trajectory  file that it writes; `{out}` in a command
    columns     `tum`, or the names of the columns of that file in their order
    stamps      what the first column counts: see `result_file.STAMPS`
    offset      s, added to the stamps
    memory_mb   of the program and those that it starts; a larger one counts as failed
    programs    placeholders of one's own, such as {YAG_PYTHON = "python3"}; a variable of the
                environment of that name goes before
    version     command that prints a version
    about       of the system, in a line
    """

    name: str
    folder: Path
    commands: tuple[str, ...]
    prepare: tuple[str, ...] = ()
    log: str = "carmen"
    max_beams: int = 1000
    trajectory: str = "trajectory.tum"
    columns: str = PLAIN
    stamps: str = "recording"
    offset: float = 0.0
    memory_mb: float = 4000.0
    programs: Mapping[str, str] = field(default_factory=dict)
    version: str = ""
    about: str = ""

    def __post_init__(self) -> None:
        for name in ("log", "trajectory", "columns", "stamps", "version", "about"):
            instance(name, getattr(self, name), str, "a text")
        if not self.commands:
            raise InputError("commands must be a list of texts, got []")
        one_of("log", self.log, LOG_FORMATS)
        one_of("stamps", self.stamps, STAMPS)
        whole_number("max_beams", self.max_beams, 2)
        number("offset", self.offset)
        positive_number("memory_mb", self.memory_mb)
        check_columns(self.columns)
        instance("programs", self.programs, dict, "a table")
        for one in (*self.prepare, *self.commands, self.version):
            self.words(one, dict.fromkeys(PLACES, "-"))

    def words(self, command: str, places: Mapping[str, object]) -> list[str]:
        """The words of a command, its placeholders replaced. Raises InputError for an unknown one,
        and for quotes that are not closed."""
        known = {**self._programs, **places}
        try:
            return [word.format_map(known) for word in shlex.split(command)]
        except KeyError as error:
            names = ", ".join(f"{{{name}}}" for name in known)
            raise InputError(f"{{{error.args[0]}}} in {command!r}; known: {names}") from None
        except (ValueError, IndexError) as error:
            raise InputError(f"{command!r}: {error}") from None

    @property
    def _programs(self) -> dict[str, str]:
        return {
            name: os.environ.get(name) or str(usual).replace("{python}", sys.executable)
            for name, usual in self.programs.items()
        }

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Its entries as JSON, but the folder; kept beside every result."""
        kept = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "folder"}
        return kept | {
            "commands": list(self.commands),
            "prepare": list(self.prepare),
            "programs": dict(self.programs),
        }


def known_outside() -> list[str]:
    """The names of the adapters found, each with its prefix."""
    return [f"{PREFIX}{name}" for name in _files()]


def find_adapter(variant: str) -> Adapter:
    """The adapter that `outside:NAME` names: a known name, or the path of a TOML file.

    Raises InputError for an unknown name, and for a file that is no adapter.
    """
    name = variant.removeprefix(PREFIX)
    path = Path(name) if name.endswith(".toml") else _files().get(name)
    if path is None:
        raise InputError(unknown_name("variant", variant, known_outside()))
    return read_adapter(path)


def read_adapter(path: Path) -> Adapter:
    """The adapter in a TOML file. Raises InputError that names what is wrong in it."""
    given = parse_text(path, "a TOML file", tomllib.loads)
    with guarded(path):
        allowed = tuple(one.name for one in fields(Adapter) if one.name not in ("name", "folder"))
        for entry in given:
            one_of("an entry", entry, allowed)
        lists = {name: _texts(name, given.pop(name, [])) for name in ("commands", "prepare")}
        return Adapter(path.stem, path.resolve().parent, **lists, **given)


def _texts(name: str, given: object) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(isinstance(one, str) for one in given):
        raise InputError(f"{name} must be a list of texts, got {given!r}")
    return tuple(given)


def _files() -> dict[str, Path]:
    """Adapters by name: those of $DYNSLAM_OUTSIDE, then of installed packages, then ours."""
    found: dict[str, Path] = {}
    for path in _candidates():
        found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def _candidates() -> Iterator[Path]:
    for folder in filter(None, os.environ.get(FOLDERS_VARIABLE, "").split(os.pathsep)):
        yield from sorted(Path(folder).glob("*.toml"))
    for entry in entry_points(group=ENTRY_POINTS):
        yield from sorted(Path(entry.load()).glob("*.toml"))
    yield from sorted(READY.glob("*.toml"))
