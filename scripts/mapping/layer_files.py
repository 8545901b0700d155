"""The files of a map's layers: what stands, what changes, and the doors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from slam.io.files import replacing
from slam.io.layers import write_doors, write_layers
from slam.io.ros_map import write_ros_map
from slam.layers import Layers
from slam.sessions.door_memory import remembered, with_remembered
from slam.sessions.session import Session

from ..console.output import write_png
from ..figures.doors_figure import doors_picture
from ..figures.layers_figure import layers_figure
from .drawing import Drawing
from .weeks_picture import write_weeks


def write_layer_files(
    made: Layers, session: Session, drawing: Drawing, title: str, out: Path
) -> tuple[Session, Layers, list[str]]:
    """Write the layers of a session into a folder, and the session again if it remembers doors;
    returns both with the doors that are remembered, and the names of the files."""
    doors = remembered(session, made.doors)
    made, weeks = with_remembered(made, doors)
    if doors or session.doors:  # else it is saved as it is
        session = replace(session, doors=doors)
        session.save(out / "session.npz")
    write_ros_map(drawing.standing(made), out / "map.yaml")
    write_png(layers_figure(made, title), out / "layers.png")
    write_layers(made, out / "layers.npz")
    write_doors(made, out / "doors.geojson", weeks)
    names = ["map.yaml", "map.pgm", "layers.png", "layers.npz", "doors.geojson"]
    return session, made, [*names, *_doors(made, out), *write_weeks(made.doors, weeks, out)]


def _doors(made: Layers, out: Path) -> list[str]:
    """A picture of each door; none of an earlier run is left where there are no doors."""
    (out / "doors.png").unlink(missing_ok=True)
    if not made.doors:
        return []
    with replacing(out / "doors.png") as file:
        doors_picture(made).save(file, "PNG")
    return ["doors.png"]
