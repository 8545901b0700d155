"""The work of `dynslam merge`: two sessions as one, and the map of both."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slam.io.ros_map import write_ros_map
from slam.sessions.continuation import empty
from slam.sessions.merging import Merger, merged
from slam.sessions.redrawing import redrawn
from slam.sessions.session import Session

from ..console.compiling import compiling_told
from ..console.output import own_directory, write_json, write_png
from ..console.selection import check_variant
from ..figures.map_figure import map_figure
from .drawing import CELL, USUAL
from .lasers import Lasers
from .layer_files import write_layer_files
from .nav2_files import write_nav2
from .start import parsed_pose

if TYPE_CHECKING:
    from .merge import MergeCommand


@compiling_told()
def merge_maps(options: MergeCommand) -> int:
    """Read, merge, write, print; the exit status."""
    check_variant(options.slam)
    empty(options.slam)  # raises before any work
    at = parsed_pose("--at", options.at)
    first, other = Session.load(options.session), Session.load(options.other)
    out = own_directory(options.out)
    if at is None:
        print("looking for the other map in the first one ...", file=sys.stderr)
    result = merged(first, other, at)
    summary = _summary(options, result)
    print(_told(options, result))
    title = f"{options.session} and {options.other}"
    summary["files"] = [*_write(result.session, options.slam, title, out), "summary.json"]
    write_json(summary, out / "summary.json")
    print(f"written to {out}: {', '.join(summary['files'])}")
    if options.json:
        print(json.dumps(summary))
    return 0


def _write(session: Session, variant: str, title: str, out: Path) -> list[str]:
    """Write the files of a session's map, the session first; returns their names."""
    session.save(out / "session.npz")
    grid = redrawn(session, variant, CELL)
    write_ros_map(grid, out / "belief.yaml")
    made = USUAL.layers(session, grid, Lasers(()), variant)
    session, made, names = write_layer_files(made, session, USUAL, title, out)
    write_png(map_figure(USUAL.standing(made), title=title), out / "map.png")
    files = "session.npz", "belief.yaml", "belief.pgm", "map.png"
    return [*files, *names, *write_nav2(made, USUAL, session.poses, out)]


def _told(options: MergeCommand, result: Merger) -> str:
    """What was found, and how sure it is."""
    x, y, theta = result.place
    place = f"({x:.2f}, {y:.2f}), {math.degrees(theta):.1f} degrees"
    sure = f"of {result.stretches} stretches of its path, {result.shown} agree with the first map"
    rival = "" if options.at else f", and at any other place at most {result.rival}"
    return (
        f"the origin of {options.other} lies at {place} in {options.session}: {sure}{rival}; bent "
        f"by at most {result.bent:.2f} m"
    )


def _summary(options: MergeCommand, result: Merger) -> dict[str, Any]:
    return {
        "session": str(options.session),
        "other": str(options.other),
        "at": list(result.place),
        "stretches": result.stretches,
        "agree": result.shown,
        "agree_elsewhere": result.rival,
        "tied": result.tied,
        "bent_m": result.bent,
        "scans": len(result.session.scans),
    }
