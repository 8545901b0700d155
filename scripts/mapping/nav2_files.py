"""The files beside map.yaml that ROS 2's Nav2 reads: masks of costmap filters, and routes."""

from __future__ import annotations

import sys
from pathlib import Path

from slam.errors import InputError
from slam.geometry import Array
from slam.io.ros_map import write_filter_mask
from slam.io.route_graph import write_route_graph
from slam.layers import Layers
from slam.layers.filter_masks import keepout_mask, speed_mask
from slam.layers.route_graph import route_graph

from .drawing import Drawing

ROUTES = "route.geojson"


def write_nav2(made: Layers, drawing: Drawing, poses: Array, folder: Path) -> list[str]:
    """Write keepout.yaml, speed.yaml, their pictures, and route.geojson; returns the names.

    poses  (n, 3) where the robot drove

    Where the robot fits nowhere, there are no routes, which is told on standard error, and no file
    of them.
    """
    write_filter_mask(keepout_mask(made, drawing.keep), made.spec, folder / "keepout.yaml")
    write_filter_mask(speed_mask(made), made.spec, folder / "speed.yaml")
    names = ["keepout.yaml", "keepout.pgm", "speed.yaml", "speed.pgm"]
    try:
        graph = route_graph(drawing.standing(made), made.doors, drawing.robot_radius, poses)
        write_route_graph(graph, made.doors, folder / ROUTES)
    except InputError as error:
        (folder / ROUTES).unlink(missing_ok=True)  # of an earlier run, of another map
        print(f"no {ROUTES}: {error}", file=sys.stderr)
        return names
    return [*names, ROUTES]
