"""The files of a mapping run, most important first."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.io.kitti import write_kitti
from slam.io.layers import picture
from slam.io.ros_map import write_ros_map
from slam.io.tum import write_tum
from slam.layers import Layers
from slam.layers.classification import DOOR_LEAF, GLASS, SEEN_IN_PART, SEEN_ONCE, WENT_AWAY
from slam.sessions.pruning import grown
from slam.sessions.session import Session, session_of
from slam.trajectory import Trajectory

from ..console.output import write_json, write_png
from ..console.process_memory import peak_mb
from ..console.progress import progress_bar
from ..figures.film import suffix
from ..figures.lost_course import LostCourse
from ..figures.map_figure import map_figure
from ..figures.map_film import write_map_film
from ..map_page.write import write_page
from .drawing import USUAL, Drawing
from .lasers import Lasers
from .layer_files import write_layer_files
from .lost_file import write_lost
from .mapping_run import MappingRun
from .nav2_files import write_nav2
from .run_clock import RunClock

SKIPPABLE = ("mcap", "rrd")  # parts that can be left out
SNAPSHOTS = {"film": 150, "mcap": 4, "rrd": 4}  # maps of the run that a part shows, at most


class MapExport:
    """Writes a run into a folder.

    mapping   the run
    out       an existing folder
    before    the session that the run continued, if any
    mapped    False if the run only localised in an existing map
    skip      parts to be left out: some of `SKIPPABLE`, film, page
    drawing   how maps are drawn
    """

    def __init__(
        self,
        mapping: MappingRun,
        out: Path,
        before: Session | None = None,
        mapped: bool = True,
        skip: tuple[str, ...] = (),
        drawing: Drawing = USUAL,
    ):
        self.run, self.episode = mapping.result, mapping.episode
        self.out = out
        self.mapped = mapped
        self.drawing, self.variant = drawing, mapping.name
        self.title = f"{self.episode.meta.get('source', 'recording')}, {mapping.name}"
        self.trajectory = Trajectory(self.episode.times[: len(self.run.poses)], self.run.poses)
        self.lost = LostCourse(self.trajectory.times, self.run.lost)
        self.snapshots = mapping.snapshots()
        self.estimates = mapping.estimates
        self.session = grown(before, session_of(self.episode, self.run.poses))
        self.layers: Layers | None = None
        self._writers: dict[str, Callable[[], list[str]]] = {
            "session": self._session,
            "trajectory": self._trajectory,
            "map": self._map,
            "layers": self._layers,
            "nav2": self._nav2,
            "picture": self._picture,
            "mcap": self._mcap,
            "rrd": self._rrd,
            "film": self._film,
            "page": self._page,
        }
        self._parts = [part for part in self._writers if part not in skip]
        if not mapped:
            needed = "session", "layers", "nav2"
            self._parts = [part for part in self._parts if part not in needed]

    def write(self, summary: dict[str, Any], clock: RunClock) -> dict[str, Any]:
        """Write all parts, then the summary with the names of the files and the peak of memory.

        A part that cannot be written is reported on standard error and in the summary's
        `not_written`; the others are written all the same. `files` of the summary are those that
        were written before.
        """
        files: list[str] = list(summary.get("files", ()))
        failed: list[str] = []
        with progress_bar() as bar:
            for part in bar.track(self._parts, description="writing"):
                try:
                    files += self._writers[part]()
                except InputError as error:
                    print(f"{part} not written: {error}", file=sys.stderr)
                    failed.append(part)
        if self.layers is not None:
            summary = {**summary, **_layer_summary(self.layers, self.drawing)}
        summary = {
            **summary,
            **clock.as_dict(),
            "peak_memory_mb": peak_mb(),
            "files": [*files, "summary.json"],
        }
        if failed:
            summary["not_written"] = failed
        summary["of_earlier_run"] = self._left(summary["files"])
        write_json(summary, self.out / "summary.json")
        return summary

    def _left(self, written: list[str]) -> list[str]:
        """The files of earlier runs in the folder that were not written again."""
        try:
            before = json.loads((self.out / "summary.json").read_text())
            named = [*before["files"], *before.get("of_earlier_run", ())]
        except (OSError, ValueError, LookupError, TypeError):
            return []  # none, or not of a run
        left = sorted({str(name) for name in named} - set(written))
        return [name for name in left if (self.out / name).is_file()]

    def _session(self) -> list[str]:
        self.session.save(self.out / "session.npz")
        return ["session.npz"]

    def _trajectory(self) -> list[str]:
        write_tum(self.trajectory, self.out / "trajectory.tum")
        times = write_kitti(self.trajectory, self.out / "trajectory.kitti")
        names = ["trajectory.tum", "trajectory.kitti", times.name]
        return [*names, *write_lost(self.lost, self.out)]

    def _map(self) -> list[str]:
        if self.mapped:
            self.run = self.drawing.believed(self.run, self.session, self.variant)
        write_ros_map(self.drawing.cleared(self.run.grid), self.out / "belief.yaml")
        return ["belief.yaml", "belief.pgm"]

    def _layers(self) -> list[str]:
        lasers = Lasers.of_episode(self.episode)
        made = self.drawing.layers(self.session, self.run.grid, lasers, self.variant)
        self.session, self.layers, names = write_layer_files(
            made, self.session, self.drawing, self.title, self.out
        )
        return names

    def _nav2(self) -> list[str]:
        if self.layers is None:
            raise InputError("it is made of the layers, which could not be written")
        return write_nav2(self.layers, self.drawing, self.session.poses, self.out)

    def _picture(self) -> list[str]:
        grid = self.run.grid if self.layers is None else self.drawing.standing(self.layers)
        figure = map_figure(grid, self.run.poses, title=self.title, lost=self.lost)
        write_png(figure, self.out / "map.png")
        return ["map.png"]

    def _mcap(self) -> list[str]:
        from slam.io.bags.result import write_result

        write_result(self.out / "map.mcap", self.episode, self.run.online, self.snapshots)
        return ["map.mcap"]

    def _rrd(self) -> list[str]:
        if not find_spec("rerun"):
            return []
        from ..figures.rerun_file import Picture, write_rrd

        pictures = {}
        if self.layers is not None:
            pictures["layers"] = Picture(self.layers.spec, picture(self.layers))
        write_rrd(self.out / "map.rrd", self.episode, self.estimates, self.snapshots, pictures)
        return ["map.rrd"]

    def _film(self) -> list[str]:
        names = ["film.gif"] if suffix() == ".gif" else ["film.gif", "film.mp4"]
        for name in names:
            write_map_film(self.out / name, self.episode, self.snapshots, self.title, self.run.lost)
        return names

    def _page(self) -> list[str]:
        path, keep = self.out / "map.html", self.drawing.keep
        write_page(path, self.title, self.episode, self.run, self.layers, keep)
        return ["map.html"]


def _layer_summary(made: Layers, drawing: Drawing) -> dict[str, Any]:
    """Areas (m2), why cells were kept or left out (m2), and doors of the layers."""

    def area(cells: np.ndarray) -> float:
        return float(cells.sum() * made.spec.resolution**2)

    return {
        "seen_m2": area(~made.unknown),
        "stands_m2": area(drawing.standing(made).solid),
        "changes_m2": area(made.changing),
        "kept_m2": {
            "seen_once": area(made.reason == SEEN_ONCE),
            "seen_in_part": area(made.reason == SEEN_IN_PART),
            "glass": area(made.reason == GLASS),
        },
        "left_out_m2": {
            "went_away": area(made.reason == WENT_AWAY),
            "door_leaf": area(made.reason == DOOR_LEAF),
        },
        "doors": [
            {
                "middle": np.round(door.ends.mean(axis=0), 2).tolist(),
                "probability": round(door.probability, 2),
                "width": round(door.width, 2),
                "open_share": round(door.open_share, 2),
                "flips": door.flips,
                "seen_open_scans": door.seen_open,
                "seen_closed_scans": door.seen_closed,
            }
            for door in made.doors
        ],
    }
