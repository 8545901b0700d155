"""Routes as Nav2's route server takes them.

`loaded` follows `GeoJsonGraphFileLoader` of navigation2 (nav2_route, 2025): what it requires, what
it makes of metadata, and where it fails. The server itself is in no package of pip or Debian.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slam.errors import InputError
from slam.io.route_graph import CLOSED_COST, write_route_graph
from slam.layers.doors import MappedDoor
from slam.layers.route_graph import NO_DOOR, RouteGraph

POINTS = np.array([(0.0, 0.0), (3.0, 4.0), (3.0, 8.0)])
DOOR = MappedDoor(np.array([(2.6, 6.0), (3.4, 6.0)]), 0.25, 3, 9.0, 0.0, 9.0, 5, 5, 0.95)
GRAPH = RouteGraph(POINTS, np.array([(0, 1), (1, 2)]), np.array([NO_DOOR, 0]))


class Edge(dict[str, Any]):
    """The properties of an edge that was loaded."""

    def number(self, name: str, default: float) -> float:
        """As `Metadata::getValue<float>`: another type than a float cannot be cast."""
        value = self["metadata"].get(name, default)
        if not isinstance(value, float):
            raise TypeError(f"bad any_cast of {name}: {value!r}")
        return value


def loaded(path: Path) -> tuple[dict[int, tuple[float, float]], list[Edge]]:
    """Nodes by id, and edges."""
    nodes, edges = {}, []
    for feature in json.loads(path.read_text())["features"]:
        properties, geometry = feature["properties"], feature["geometry"]
        if geometry["type"] == "Point":
            assert properties["frame"] == "map"
            x, y = geometry["coordinates"]
            nodes[properties["id"]] = float(x), float(y)
        elif geometry["type"] in ("MultiLineString", "LineString"):
            edges.append(Edge(properties))
            plain(properties["metadata"])
    if not nodes or not edges:
        raise ValueError("The graph is malformed. Is does not contain nodes or edges.")
    for edge in edges:
        assert all(isinstance(edge[key], int) and edge[key] >= 0 for key in ("id", "startid"))
        assert edge["startid"] in nodes, "Start id does not exist"
        assert edge["endid"] in nodes, "End id does not exist"
        assert edge["cost"] > 0, "doesn't contain and cannot compute a valid edge cost"
        assert isinstance(edge["overridable"], bool)
    return nodes, edges


def plain(metadata: dict[str, Any]) -> None:
    """Numbers, booleans, texts, and objects of them; null is 'Failed to convert'."""
    for value in metadata.values():
        if isinstance(value, dict):
            plain(value)
        else:
            assert isinstance(value, bool | int | float | str)


@pytest.fixture
def written(tmp_path: Path) -> Path:
    write_route_graph(GRAPH, [DOOR], tmp_path / "route.geojson")
    return tmp_path / "route.geojson"


def test_the_server_loads_it_with_each_way_of_each_edge(written: Path) -> None:
    nodes, edges = loaded(written)
    assert list(nodes.values()) == [tuple(point) for point in POINTS.tolist()]
    ways = [(edge["startid"], edge["endid"]) for edge in edges]
    assert ways == [(0, 1), (1, 0), (1, 2), (2, 1)]


def test_no_id_is_used_twice_for_blocking_does_not_tell_nodes_from_edges(written: Path) -> None:
    nodes, edges = loaded(written)
    ids = [*nodes, *(edge["id"] for edge in edges)]
    assert len(set(ids)) == len(ids) == 7


def test_an_edge_through_a_door_carries_it_and_costs_more(written: Path) -> None:
    _, edges = loaded(written)
    free, door = edges[0], edges[2]
    assert free["cost"] == pytest.approx(5.0)
    assert free["metadata"]["class"] == "free"
    assert free.number("penalty", 0.0) == 0.0
    assert free.number("speed_limit", 100.0) == 100.0
    assert door["metadata"]["class"] == "door"
    assert door["metadata"]["door"] == 1  # its id in doors.geojson
    assert door.number("open_probability", 1.0) == pytest.approx(1 / 3, abs=1e-3)
    assert door.number("door_probability", 1.0) == pytest.approx(0.95)
    assert door.number("penalty", 0.0) == pytest.approx(2 / 3 * CLOSED_COST, abs=1e-3)
    assert door.number("speed_limit", 100.0) == 50.0
    assert door["cost"] == pytest.approx(4.0 + 2 / 3 * CLOSED_COST, abs=1e-3)


def test_it_is_geojson_in_lines_along_the_edges(written: Path) -> None:
    found = json.loads(written.read_text())
    assert found["type"] == "FeatureCollection"
    assert all(feature["type"] == "Feature" for feature in found["features"])
    line = found["features"][5]["geometry"]["coordinates"]
    assert line == [[[3.0, 4.0], [3.0, 8.0]]]


def test_a_graph_without_edges_is_not_written(tmp_path: Path) -> None:
    alone = RouteGraph(POINTS[:1], np.zeros((0, 2), int), np.zeros(0, int))
    with pytest.raises(InputError, match="no routes"):
        write_route_graph(alone, [], tmp_path / "route.geojson")
    assert not list(tmp_path.iterdir())
