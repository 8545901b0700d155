"""Routes as a graph for Nav2's route server, in its GeoJSON.

The schema is that of its `GeoJsonGraphFileLoader`: nodes are Points with `id` and `frame`, edges
MultiLineStrings with `id`, `startid`, `endid`, `cost` and `metadata`. An edge leads one way, so
each way is two of them. A route may block ids of nodes and edges alike: no id is used twice. Its
scorers and operations read metadata as 32-bit floats, and fail on a number without a point.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.io.files import AnyPath, replacing
from slam.io.layers import FRAME
from slam.layers.doors import MappedDoor
from slam.layers.filter_masks import DOOR_LIMIT
from slam.layers.route_graph import NO_DOOR, RouteGraph

CLOSED_COST = 20.0  # m of a way round that are driven for where a door is found closed


def write_route_graph(graph: RouteGraph, doors: Sequence[MappedDoor], path: AnyPath) -> None:
    """Write the routes as a FeatureCollection, for the parameter `graph_filepath`.

    `cost` of an edge is its length, m, and where it passes a door CLOSED_COST times the probability
    that the door is closed. The metadata of an edge through a door are `class` "door", its number
    in doors.geojson (`door`), the probability that it is one (`door_probability`), that it is open
    (`open_probability`: `MappedDoor.open_probability`), the second part of the cost (`penalty`),
    and `speed_limit`, percent. Those of other edges are `class` "free" and `penalty` 0. Raises
    InputError for a graph without edges, which the server takes for malformed.
    """
    if not len(graph.edges):
        raise InputError(f"{path}: no routes: there is one point at most where the robot can drive")
    nodes = [_node(number, point) for number, point in enumerate(graph.points.tolist())]
    ways = zip(graph.edges.tolist(), graph.lengths.tolist(), graph.doors.tolist(), strict=True)
    edges = []
    for (a, b), length, number in ways:
        door = None if number == NO_DOOR else doors[number]
        for begin, end in ((a, b), (b, a)):
            line = graph.points[[begin, end]]
            about = {"id": len(nodes) + len(edges), "startid": begin, "endid": end}
            edges.append(_edge(line, {**about, **_cost(length, number, door)}))
    features = ",\n".join(json.dumps(one, allow_nan=False) for one in (*nodes, *edges))
    head = f'{{"type": "FeatureCollection", "frame": {json.dumps(FRAME)}, "features": [\n'
    with replacing(path) as file:
        file.write(f"{head}{features}\n]}}\n".encode())


def _node(number: int, point: list[float]) -> dict[str, Any]:
    geometry = {"type": "Point", "coordinates": [round(value, 3) for value in point]}
    properties = {"id": number, "frame": "map"}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _edge(line: np.ndarray, properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": "MultiLineString", "coordinates": [np.round(line, 3).tolist()]}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _cost(length: float, number: int, door: MappedDoor | None) -> dict[str, Any]:
    """`cost`, `overridable` and `metadata` of an edge."""
    penalty = 0.0 if door is None else round(CLOSED_COST * (1.0 - float(door.open_probability)), 3)
    metadata: dict[str, Any] = {"class": "free", "penalty": penalty}
    if door is not None:
        metadata |= {
            "class": "door",
            "door": number + 1,
            "door_probability": round(float(door.probability), 3),
            "open_probability": round(float(door.open_probability), 3),
            "speed_limit": float(DOOR_LIMIT),
        }
    return {"cost": round(length + penalty, 3), "overridable": True, "metadata": metadata}
