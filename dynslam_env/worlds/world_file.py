"""World files: a `Layout` as JSON, with one wall, door or waypoint per line.

    {
      "format": "dynslam-world-1",
      "walls": [
        [0.0, 0.0, 4.0, 0.0]
      ],
      "doors": [
        {"hinge": [1.0, 2.0], "closed": 0.0, "swing": 1, "width": 0.898, "thickness": 0.04}
      ],
      "start": [0.8, 0.0, 0.0],
      "path": [
        [0.8, 0.0],
        [3.2, 0.0]
      ],
      "routes": []
    }

Units and fields are those of `layout.Layout` and `layout.Door`; "routes", and "slides" (true or
false) of a door, are optional.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from slam.errors import InputError
from slam.io.files import AnyPath, reading, replacing
from slam.io.guard import guarded

FORMAT = "dynslam-world-1"
DOOR_KEYS = ("hinge", "closed", "swing", "width", "thickness")
SLIDES = "slides"


def write(path: AnyPath, world: Mapping[str, Any]) -> None:
    """Write a world (plain data, as `read` returns) through a temporary file.

    Raises InputError if it cannot be written.
    """
    start = json.dumps(world["start"])
    blocks = {key: _block(world[key]) for key in ("walls", "doors", "path", "routes")}
    text = (
        f'{{\n  "format": "{FORMAT}",\n  "walls": {blocks["walls"]},\n'
        f'  "doors": {blocks["doors"]},\n  "start": {start},\n'
        f'  "path": {blocks["path"]},\n  "routes": {blocks["routes"]}\n}}\n'
    )
    with replacing(path) as file:
        file.write(text.encode())


def _block(items: Iterable[Any]) -> str:
    """A list in JSON, one item per line."""
    rows = ",\n".join(f"    {json.dumps(item, allow_nan=False)}" for item in items)
    return f"[\n{rows}\n  ]" if rows else "[]"


def read(path: AnyPath) -> dict[str, Any]:
    """The world in a file as plain data: walls, doors, start, path, routes.

    Raises InputError with the file and the position in it for any other content.
    """
    with guarded(path):
        return _read(path)


def _read(path: AnyPath) -> dict[str, Any]:
    world = _parsed(path)
    _check_keys(f"{path}:", world, ("format", "walls", "doors", "start", "path"), ("routes",))
    if world["format"] != FORMAT:
        raise InputError(f'{path}: "format" must be "{FORMAT}", got {_short(world["format"])}')
    return {
        "walls": _rows(f"{path}: walls", world["walls"], "x1, y1, x2, y2"),
        "doors": [
            _door(f"{path}: doors[{i}]", door)
            for i, door in enumerate(_list(f"{path}: doors", world["doors"]))
        ],
        "start": _numbers(f"{path}: start", world["start"], "x, y, theta"),
        "path": _rows(f"{path}: path", world["path"], "x, y"),
        "routes": [
            _rows(f"{path}: routes[{i}]", route, "x, y")
            for i, route in enumerate(_list(f"{path}: routes", world.get("routes", [])))
        ],
    }


def _parsed(path: AnyPath) -> Any:
    with reading(path) as file:
        raw = file.read()
    try:
        return json.loads(raw.decode("utf-8-sig"), object_pairs_hook=_unique_keys)
    except json.JSONDecodeError as error:
        place = f"{path}:{error.lineno}:{error.colno}"
        raise InputError(f"{place}: expected JSON, but {error.msg}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected JSON in UTF-8, byte {error.start} is not") from None
    except RecursionError:
        raise InputError(f"{path}: expected a world, but lists are nested too deeply") from None
    except ValueError as error:
        raise InputError(f"{path}: expected a world in JSON ({error})") from None


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object as a dict; raises ValueError for a repeated key."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f'the key "{twice}" is given twice, allowed is once')
    return found


def _check_keys(place: str, found: Any, needed: tuple[str, ...], optional: tuple[str, ...]) -> None:
    """Check that `found` is an object with all keys `needed`, and no others but `optional`."""
    allowed = ", ".join((*needed, *optional))
    if not isinstance(found, dict):
        raise InputError(f"{place} must be an object with the keys {allowed}, got {_short(found)}")
    for key in needed:
        if key not in found:
            raise InputError(f'{place} the key "{key}" is missing; needed are {", ".join(needed)}')
    for key in found:
        if key not in (*needed, *optional):
            raise InputError(f'{place} there is no key "{key}"; allowed are {allowed}')


def _door(place: str, door: Any) -> dict[str, Any]:
    _check_keys(f"{place}:", door, DOOR_KEYS, (SLIDES,))
    swing = door["swing"]
    if isinstance(swing, bool) or swing not in (1, -1):
        raise InputError(f"{place}.swing must be 1 or -1, got {_short(swing)}")
    sizes = {key: _number(f"{place}.{key}", door[key]) for key in ("closed", "width", "thickness")}
    hinge = _numbers(f"{place}.hinge", door["hinge"], "x, y")
    slides = door.get(SLIDES, False)
    if not isinstance(slides, bool):
        raise InputError(f"{place}.{SLIDES} must be true or false, got {_short(slides)}")
    return {"hinge": hinge, "swing": int(swing), **sizes, SLIDES: slides}


def _rows(place: str, rows: Any, names: str) -> list[list[float]]:
    return [_numbers(f"{place}[{i}]", row, names) for i, row in enumerate(_list(place, rows))]


def _list(place: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{place} must be a list, got {_short(value)}")
    return value


def _numbers(place: str, values: Any, names: str) -> list[float]:
    """A list of finite numbers, one for each of the `names`."""
    if not isinstance(values, list) or len(values) != len(names.split(", ")):
        raise InputError(f"{place} must be a list of the numbers {names}, got {_short(values)}")
    return [_number(f"{place}[{i}]", value) for i, value in enumerate(values)]


def _number(place: str, value: Any) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            if math.isfinite(value):
                return float(value)
        except OverflowError:  # an integer too large for a float
            pass
    raise InputError(f"{place} must be a finite number, got {_short(value)}")


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
