"""`dynslam map FILE`: a map out of a recording, and all files made from it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from ..recordings.source import MappedSource


@dataclass(kw_only=True)
class MapCommand(MappedSource):
    """Make a map of a recording without traces of moving doors and people.

    Writes to a folder: map.yaml for ROS 2, layers, doors found, trajectory, files for Foxglove and
    rerun, and session.npz, from which a later recording can continue; on demand a film (--film)
    and a page to look at the map in a browser and to correct it (--page).

    Exit status: 0 done; 2 a mistake, or not all could be written; 3 all is written, but the robot
    was lost at the end, or at more than a fifth of the scans; 130 interrupted, written up to there.
    """

    slam: str | None = None
    """SLAM variant. Default: dynamic-graph, which closes loops; with --localise, hmm-ml."""
    out: Path | None = None
    """Folder to write to. Default: out/FILE."""
    onto: Path | None = None
    """session.npz of an earlier map to continue, any number of times. Where the recording begins in
    it is found; if it may be several places, the command ends with status 2 and names them."""
    start: tuple[float, float, float] | None = None
    """Start pose in the map of --onto, if known: x and y in m, heading in degrees. It is compared
    with the other places of the map, and corrected where it is certainly wrong."""
    localise: bool = False
    """With --onto: localise in that map without changing it. For MAP-graph, MAP-ml localises."""
    truth: str | None = None
    """Reference to score the trajectory with: a file in the TUM format, or a topic of the bag."""
    live: bool = False
    """Show the map in a window as it grows, and at the end what was found: until a key is pressed,
    or for a minute."""
    skip: str = ""
    """Outputs to leave out, separated by commas: mcap, rrd; or all of these."""
    film: bool = False
    """Write a film of the map as it grew, too; it takes longer than all other files together."""
    page: bool = False
    """Write map.html, too: one file to pan, zoom, play the drive, draw keep-out zones and correct
    doors."""
    resolution: float = 0.05
    """Side of a cell of the maps that are written, m. Scans are matched, and doors looked for, in
    cells of 0.05 m, whatever it is."""
    keep: str = "once,part,glass"
    """What counts as standing beside what always stood, separated by commas: once (seen by one scan
    only), part (hit by some beams, passed by others: a mesh, thin legs), glass (hit at a right
    angle, passed at any other), gone (seen to go away), leaf (open leaves of doors); or all, or
    none of these."""
    mask: Path | None = None
    """Map (.yaml with its picture) whose black cells are areas to clear: what was measured there is
    left out of the maps and doors that are written, and the cells that were seen are free."""
    align: bool = False
    """Turn the map so that its walls are parallel to its axes. Maps the recording twice."""
    robot_radius: float = 0.3
    """Radius of the robot, m: the routes in route.geojson keep so far away from what stands."""
    seed: int = 0
    """Seed of variants that draw random numbers."""
    config: Path | None = None
    """TOML file with these options by name, such as resolution = 0.02 (and file, the recording);
    options on the command line go before. What was used is written to config.toml."""
    json: bool = False
    """Print the summary as one JSON object, the last line of standard output."""

    def __call__(self) -> int:
        """Read, map, write, print."""
        begun = time.perf_counter()  # before modules are imported, which takes a second or two
        from .map_recording import map_recording

        return map_recording(self, begun)
