"""A TOML file with the options of a command: read (`--config FILE`), and written beside results.

Its entries are the options by their names without the dashes before them; the recording is `file`.
An option on the command line goes before the same one of the file. Paths in a file are relative to
its folder.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from types import UnionType
from typing import Any, NamedTuple, Union, get_args, get_origin, get_type_hints

from slam.errors import InputError
from slam.io.files import replacing
from slam.io.guard import guarded
from slam.io.one_line import one_line
from slam.io.small_text import parse_text
from slam.validation import unknown_name

CONFIG = "config"  # the option that names the file, and the entry that no file has
POSITIONAL = "file"


class Option(NamedTuple):
    """An option of a command.

    name   on the command line, without the dashes
    field  of the command's dataclass
    words  number of words of its value; 0 for a flag
    many   whether it may be given several times
    path   whether it is a path
    """

    name: str
    field: str
    words: int
    many: bool
    path: bool


def options_of(kind: type[Any]) -> dict[str, Option]:
    """The options of a command's dataclass by name."""
    hints = get_type_hints(kind, include_extras=True)
    found = (_option(field.name, hints[field.name]) for field in fields(kind))
    return {option.name: option for option in found}


def with_config(kind: type[Any], arguments: Sequence[str]) -> list[str]:
    """The arguments of a command, with the options of the file that `--config` names before them.

    Raises InputError for a file that cannot be read, an unknown entry, and a value of the wrong
    kind.
    """
    options = options_of(kind)
    given = _given(arguments, options)
    if CONFIG not in options or CONFIG not in given:
        return list(arguments)
    path = Path(given[CONFIG][-1])
    with guarded(path):
        words = [
            word
            for option, value in _entries(path, options)
            if option.name not in given
            for word in _words(option, value, path)
        ]
    return [*words, *arguments]


def write_config(command: Any, without: Sequence[str], head: str, path: Path) -> None:
    """Write the options of a command as a file that `with_config` reads, but those `without`.

    Paths are written in full; options that are not set are named in a comment.
    """
    lines, unset = [f"# {head}"], []
    for option in options_of(type(command)).values():
        value = getattr(command, option.field)
        if option.name in (CONFIG, *without):
            continue
        if value is None or value == ():
            unset.append(option.name)
        else:
            lines.append(f"{option.name} = {json.dumps(_plain(value), ensure_ascii=False)}")
    if unset:
        lines.append(f"# not set: {', '.join(unset)}")
    with replacing(path) as file:
        file.write(("\n".join(lines) + "\n").encode())


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value.resolve())
    return list(value) if isinstance(value, tuple) else value


def _option(field: str, hint: Any) -> Option:
    marks = getattr(hint, "__metadata__", ())
    name = next((mark.name for mark in marks if getattr(mark, "name", None)), None)
    bare = get_args(hint)[0] if marks else hint
    kinds = [one for one in _alternatives(bare) if one is not type(None)]
    kind = kinds[0]
    parts = get_args(kind) if get_origin(kind) is tuple else ()
    many = len(parts) == 2 and parts[1] is Ellipsis
    words = 0 if kind is bool else 1 if many or not parts else len(parts)
    return Option(name or field.replace("_", "-"), field, words, many, Path in kinds)


def _alternatives(kind: Any) -> tuple[Any, ...]:
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _given(arguments: Sequence[str], options: dict[str, Option]) -> dict[str, list[str]]:
    """The names of the options among the arguments, with their values; `file` for a word that
    belongs to none."""
    given: dict[str, list[str]] = {}
    words = iter(arguments)
    for word in words:
        name, equals, value = word.removeprefix("--").partition("=")
        name = name.replace("_", "-")
        if not word.startswith("--"):
            given.setdefault(POSITIONAL, []).append(word)
        elif name in options:
            more = 0 if equals else options[name].words
            values = [value] if equals else []
            given.setdefault(name, []).extend([*values, *(next(words, "") for _ in range(more))])
    return given


def _entries(path: Path, options: dict[str, Option]) -> list[tuple[Option, Any]]:
    table = parse_text(path, "a TOML file", tomllib.loads)
    known = [name for name in options if name != CONFIG]
    found = []
    for entry, value in table.items():
        name = entry.replace("_", "-")
        if name not in known:
            raise InputError(unknown_name("entry", entry, known))
        found.append((options[name], value))
    return found


def _words(option: Option, value: Any, path: Path) -> list[str]:
    """The words of an entry as they would be on the command line. Raises InputError."""
    if option.words == 0:
        if not isinstance(value, bool):
            raise InputError(f"{option.name} must be true or false, got {value!r}")
        return [f"--{option.name}"] if value else []
    values = value if isinstance(value, list) else [value]
    plain = all(isinstance(one, str | int | float) and not isinstance(one, bool) for one in values)
    fitting = option.many or len(values) == option.words
    if not plain or not fitting:
        what = f"a list of {option.words} numbers" if option.words > 1 else "a number or a text"
        raise InputError(f"{option.name} must be {what}, got {one_line(repr(value), 60)}")
    texts = [str(path.parent / one) if option.path else str(one) for one in values]
    if option.name == POSITIONAL:
        return texts
    if option.words > 1:
        return [f"--{option.name}", *texts]
    return [f"--{option.name}={text}" for text in texts]
