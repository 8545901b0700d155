"""`dynslam merge SESSION OTHER`: one map out of two that overlap."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(kw_only=True)
class MergeCommand:
    """Merge two saved maps of parts of a place that overlap.

    Where the other map lies in the first is found, or given by --at. If it may lie at several
    places, the command ends with status 2 and names them. The first map stays as it is; the other
    one is bent to fit it. Writes session.npz, which can be continued, map.yaml, layers, doors and
    map.png.

    Exit status: 0 done; 2 a mistake, maps that do not overlap enough to be sure, or not all could
    be written.
    """

    session: Annotated[Path, tyro.conf.Positional]
    """session.npz of the first map."""
    other: Annotated[Path, tyro.conf.Positional]
    """session.npz of the other map."""
    at: tuple[float, float, float] | None = None
    """Where the other map's origin lies in the first one, if known: x and y in m, heading in
    degrees."""
    slam: str = "dynamic-graph"
    """SLAM variant whose map model draws the map."""
    out: Path = Path("out/merged")
    """Folder to write to."""
    json: bool = False
    """Print the summary as one JSON object, the last line of standard output."""

    def __call__(self) -> int:
        """Read, merge, write, print."""
        from .merge_maps import merge_maps

        return merge_maps(self)
