"""The table of the options of `dynslam map`."""

from __future__ import annotations

import ast
import inspect
from dataclasses import MISSING, fields
from typing import Any

from dynslam_cli.console.config_file import options_of  # pyright: ignore[reportMissingImports]
from dynslam_cli.mapping.map import MapCommand  # pyright: ignore[reportMissingImports]

UNITS_AND_RANGES = {  # what a docstring does not put in a column
    "mount": ("m, m, degrees", "finite"),
    "clock": ("s", "-10 to 10, auto, none"),
    "from": ("s", "any"),
    "to": ("s", "any"),
    "min-range": ("m", ">= 0, < max-range"),
    "max-range": ("m", "> min-range"),
    "start": ("m, m, degrees", "finite"),
    "resolution": ("m", "0.005 to 1"),
    "keep": ("", "once, part, gone, leaf, all, none"),
    "skip": ("", "mcap, rrd, film, all"),
    "robot-radius": ("m", "> 0"),
    "seed": ("", "whole, >= 0"),
}


def option_table() -> str:
    """Option, unit, default, range and effect."""
    lines = ["| option | unit | default | range | effect |", "|---|---|---|---|---|"]
    effects = _effects(MapCommand)
    defaults = {one.name: one.default for one in fields(MapCommand)}
    for option in options_of(MapCommand).values():
        unit, span = UNITS_AND_RANGES.get(option.name, ("", ""))
        name = "FILE" if option.name == "file" else f"`--{option.name}`"
        effect = effects[option.field]
        lines.append(
            f"| {name} | {unit} | {_default(defaults[option.field])} | {span} | {effect} |"
        )
    return "\n".join(lines) + "\n"


def _default(value: Any) -> str:
    if value is MISSING:
        return "to be given"
    if value is None or value == () or value == "":
        return "not set"
    return "no" if value is False else f"`{value}`"


def _effects(kind: type[Any]) -> dict[str, str]:
    """The text below each field of a dataclass and its bases, in one line."""
    found: dict[str, str] = {}
    for one in kind.__mro__[:-1]:
        body = ast.parse(inspect.cleandoc(inspect.getsource(one))).body[0]
        assert isinstance(body, ast.ClassDef)
        for field, below in zip(body.body, body.body[1:], strict=False):
            text = getattr(getattr(below, "value", None), "value", None)
            if isinstance(field, ast.AnnAssign) and isinstance(text, str):
                assert isinstance(field.target, ast.Name)
                found.setdefault(field.target.id, " ".join(text.split()))
    return found
