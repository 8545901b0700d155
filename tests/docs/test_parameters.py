"""docs/parameters.md has every parameter of every part, and is that of the code."""

import inspect
import pkgutil
from collections.abc import Callable, Iterator
from enum import EnumType
from importlib import import_module

import pytest

from docs.making import parameters
from docs.making.docstring_rows import rows
from docs.making.option_table import UNITS_AND_RANGES, option_table

PACKAGES = ("maps", "sensor_models", "motion", "search", "graph", "recovery", "algorithms",
            "preprocessing")  # fmt: skip
LISTED = {name for names in parameters.GROUPS.values() for name in names}


def parts() -> Iterator[str]:
    """The classes and makers of the packages that have a parameter with a default."""
    for package in PACKAGES:
        path = import_module(f"slam.{package}").__path__
        for info in pkgutil.iter_modules(path, f"slam.{package}."):
            for name, part in vars(import_module(info.name)).items():
                own = getattr(part, "__module__", "") == info.name and name[0].isupper()
                if own and callable(part) and _has_defaults(part):
                    yield f"{info.name}.{name}"


def _has_defaults(part: Callable[..., object]) -> bool:
    if isinstance(part, EnumType):
        return False
    try:
        given = inspect.signature(part).parameters.values()
    except ValueError:
        return False
    return any(one.default is not inspect.Parameter.empty for one in given)


def test_the_page_is_that_of_the_code() -> None:
    assert parameters.PAGE.read_text(encoding="utf-8") == parameters.page(), "run: make docs"


def test_every_part_is_on_the_page_or_is_said_to_be_no_choice() -> None:
    there = set(parts())
    assert len(there) > 25
    assert there - LISTED - set(parameters.INTERNAL) == set()
    assert set(parameters.INTERNAL) <= there
    assert not set(parameters.INTERNAL) & LISTED


@pytest.mark.parametrize("name", sorted(LISTED))
def test_every_parameter_has_an_effect(name: str) -> None:
    found = list(parameters.parameters(name))
    assert [one.name for one in found] == list(inspect.signature(parameters.found(name)).parameters)
    assert all(one.effect and one.default for one in found)


def test_units_and_ranges_are_those_of_the_code() -> None:
    known = {one.name: one for one in parameters.parameters("slam.maps.rays.Rays")}
    assert (known["reach"].unit, known["reach"].accepted) == ("m", "> 0, finite")
    assert known["no_echo_reach"].accepted == ">= 0, finite"
    search = {one.name: one for one in parameters.parameters("slam.search.correlative.Correlative")}
    assert (search["step"].unit, search["turn"].unit) == ("m", "rad")
    assert search["turn"].default == "`0.0174533` (1 degrees)"
    graph = {one.name: one for one in parameters.parameters("slam.algorithms.graph_slam.GraphSlam")}
    assert graph["visits"].accepted == "whole, >= 1"
    prior = {one.name: one for one in parameters.parameters("slam.maps.log_odds.Evidence")}
    assert prior["prior"].accepted == "> 0, < 1"
    assert prior["free"].accepted == "< 0"


def test_every_option_is_in_its_table() -> None:
    from dynslam_cli.console.config_file import options_of  # pyright: ignore[reportMissingImports]
    from dynslam_cli.mapping.map import MapCommand  # pyright: ignore[reportMissingImports]

    names = [name for name in options_of(MapCommand) if name != "file"]
    table = option_table()
    assert all(f"| `--{name}` |" in table for name in names)
    assert set(UNITS_AND_RANGES) <= set(names)


def test_rows_of_a_docstring_are_found() -> None:
    text = "Of it.\n\nstep, turn  m and rad between\nwide  which goes\n      on\n\nAll  told."
    found = {"step": "m between", "turn": "rad between", "wide": "which goes on"}
    assert dict(rows(text)) == found
    assert dict(rows("`one`: a thing, of\nsome kind.")) == {"one": "a thing, of some kind."}
