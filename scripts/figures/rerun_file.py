"""A run as a file for the Rerun viewer: map, path, scans and pose covariance over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec
from slam.interface import Estimate
from slam.io.files import AnyPath, placing
from slam.maps.snapshot import MapSnapshot

from .canvas import ROBOT_RADIUS
from .ellipse import ellipses
from .map_film import ECHOES
from .map_panel import MapPanel
from .style import ESTIMATE, TRUTH

if TYPE_CHECKING:
    import rerun

RVIZ, VIRIDIS = 10, 6  # colour maps of rerun
ELLIPSOID_HALF_HEIGHT = 0.01  # m
HEIGHTS = {"grid": 0.0, "layers": 0.01, "path": 0.02, "scan": 0.03, "covariance": 0.04}  # m
MAX_PATH_POSES = 300  # of a snapshot but the last: with all, the file would grow quadratically


class Picture(NamedTuple):
    """A layer of the map.

    spec   its cells
    cells  (rows, cols) numbers, coloured from the least to the largest, or (rows, cols, 3) uint8
    """

    spec: GridSpec
    cells: np.ndarray


def write_rrd(
    path: AnyPath,
    episode: Episode,
    estimates: Sequence[Estimate],
    snapshots: Sequence[MapSnapshot],
    layers: Mapping[str, Picture] | None = None,
) -> None:
    """Write .rrd, which `rerun FILE` opens (extra `viz`).

    estimates  one per scan
    snapshots  maps and trajectories as estimated during the run
    layers     name -> layer of the final map

    Time lines `time` (the scans' stamps) and `scan` (their numbers). Entities, in m:

    map/grid            a snapshot's map, in the colours of rviz
    map/layers/NAME     at the last snapshot, hidden at first
    map/path            a snapshot's trajectory, thinned to MAX_PATH_POSES but for the last
    map/robot           its pose; below it, map/robot/scan: the echoes
    map/covariance      the ellipse that holds the position with 95 %

    Raises InputError without rerun, without a scan, and where `path` cannot be written.
    """
    if not find_spec("rerun"):
        raise InputError(f"{path}: .rrd files need rerun: pip install 'dynslam[viz]'")
    if not (estimates and snapshots):
        raise InputError(f"{path}: nothing to write, no scan was processed")
    import rerun as rr

    with placing(path) as made, rr.RecordingStream("dynslam") as out:
        out.set_log_time_enabled(False)  # the time of writing is of no interest
        out.save(made, default_blueprint=_view(rr, snapshots[-1]))
        out.log("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        _put_robot(rr, out, episode, estimates)
        for snapshot in snapshots:
            _put_snapshot(rr, out, episode, snapshot, whole=snapshot is snapshots[-1])
        for name, picture in (layers or {}).items():
            out.log(f"map/layers/{name}", _layer(rr, picture))
        out.disconnect()


def _put_robot(
    rr: Any, out: rerun.RecordingStream, episode: Episode, estimates: Sequence[Estimate]
) -> None:
    """Pose, echoes and covariance of every scan."""
    scans = episode.scans[: len(estimates)]
    when = _when(rr, episode, range(len(scans)))
    poses = np.array([estimate.pose for estimate in estimates])
    out.send_columns("map/robot", when, rr.Transform3D.columns(
        translation=_lifted(poses[:, :2], 0.0), quaternion=_turned(poses[:, 2])
    ))  # fmt: skip
    body = rr.Arrows3D(
        vectors=[[2 * ROBOT_RADIUS, 0.0, 0.0]], radii=ROBOT_RADIUS / 4, colors=_rgb(ESTIMATE)
    )
    out.log("map/robot", body, static=True)
    points = [scan.points for scan in scans]
    columns = rr.Points3D.columns(positions=_lifted(np.concatenate(points), HEIGHTS["scan"]))
    look = rr.Points3D.from_fields(colors=_rgb(ECHOES), radii=-2.0)  # below 0: in pixels
    out.log("map/robot/scan", look, static=True)
    out.send_columns("map/robot/scan", when, columns.partition([len(one) for one in points]))
    axes, turn = ellipses(np.array([estimate.covariance for estimate in estimates]))
    out.send_columns("map/covariance", when, rr.Ellipsoids3D.columns(
        centers=_lifted(poses[:, :2], HEIGHTS["covariance"]),
        half_sizes=_lifted(axes, ELLIPSOID_HALF_HEIGHT), quaternions=_turned(turn),
    ))  # fmt: skip
    out.log("map/covariance", rr.Ellipsoids3D.from_fields(colors=_rgb(TRUTH)), static=True)


def _put_snapshot(
    rr: Any, out: rerun.RecordingStream, episode: Episode, snapshot: MapSnapshot, whole: bool
) -> None:
    out.set_time("time", timestamp=episode.scans[snapshot.scan].time)
    out.set_time("scan", sequence=snapshot.scan)
    cells = snapshot.percent.view(np.uint8)
    out.log("map/grid", _grid_map(rr, snapshot.spec, cells, RVIZ, HEIGHTS["grid"]))
    most = len(snapshot.poses) if whole else MAX_PATH_POSES
    chosen = np.unique(np.linspace(0, snapshot.scan, most).round().astype(int))
    path = _lifted(snapshot.poses[chosen, :2], HEIGHTS["path"])
    out.log("map/path", rr.LineStrips3D([path], colors=_rgb(ESTIMATE), radii=-1.0))


def _layer(rr: Any, picture: Picture) -> Any:
    cells = picture.cells
    if cells.ndim == 2:
        low, high = float(np.nanmin(cells)), float(np.nanmax(cells))
        share = (np.nan_to_num(cells, nan=low) - low) / ((high - low) or 1.0)
        cells = np.round(255 * share).astype(np.uint8)
    return _grid_map(rr, picture.spec, cells, VIRIDIS, HEIGHTS["layers"])


def _grid_map(rr: Any, spec: GridSpec, cells: np.ndarray, colours: int, height: float) -> Any:
    """Cells (rows, cols) or (rows, cols, 3) uint8; rerun wants the top row first."""
    plain = cells.ndim == 2
    return rr.GridMap(
        data=np.ascontiguousarray(cells[::-1]).tobytes(),
        format=rr.components.ImageFormat(
            width=spec.cols, height=spec.rows, color_model="L" if plain else "RGB",
            channel_datatype="U8",
        ),
        cell_size=spec.resolution, translation=[*spec.origin, height],
        colormap=rr.components.Colormap(colours) if plain else None,
    )  # fmt: skip


def _view(rr: Any, last: MapSnapshot) -> Any:
    """View of the last map from above; its layers are hidden until the user shows them."""
    import rerun.blueprint as rrb

    box = MapPanel("", last.grid, last.poses).box
    x, y = (box.left + box.right) / 2, (box.bottom + box.top) / 2
    height = 1.2 * max(box.width, box.height)
    eye = rrb.EyeControls3D(
        position=[x, y - 1e-3 * height, height], look_target=[x, y, 0.0], eye_up=[0.0, 1.0, 0.0]
    )
    hidden: Any = {"map/layers": rrb.EntityBehavior(visible=False)}  # they would cover the map
    view = rrb.Spatial3DView(origin="map", name="map", eye_controls=eye, overrides=hidden)
    return rrb.Blueprint(view, rrb.TimePanel(timeline="time"), collapse_panels=True)


def _when(rr: Any, episode: Episode, numbers: range) -> list[Any]:
    times = episode.times[: len(numbers)]
    return [rr.TimeColumn("time", timestamp=times), rr.TimeColumn("scan", sequence=numbers)]


def _lifted(points: Array, z: float) -> Array:
    return np.column_stack([points, np.full(len(points), z)])


def _turned(theta: Array) -> Array:
    """(n, 4) quaternions x, y, z, w of headings (n,), rad."""
    zero = np.zeros(len(theta))
    return np.column_stack([zero, zero, np.sin(theta / 2), np.cos(theta / 2)])


def _rgb(colour: str) -> int:
    """A colour as rerun's 0xRRGGBBAA."""
    return int(colour[1:], 16) << 8 | 0xFF
