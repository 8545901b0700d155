"""`dynslam map FILE`: the map out of a recording, and all that one takes away."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import slam
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Slam
from slam.metrics.reference import score_reference
from slam.sessions.relocalisation import continued, empty, localiser, relocated
from slam.sessions.session import Session
from slam.trajectory import Trajectory

from ..console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE
from ..console.output import output_directory
from ..console.selection import parse_selection
from ..recordings.source import RecordingSource, compile_first, prepared, stem
from .export import LEFT_OUT, MapExport
from .mapping_run import STAGES, MappingRun, Window
from .reference import reference

RECOMMENDED, ONTO = "dynamic-graph", "hmm-ml"
LISTED = 10  # doors that are told


@dataclass(kw_only=True)
class MapCommand(RecordingSource):
    """Make a map of a recording, without ghosts of doors and people, and write all of it to a
    folder: map.yaml for ROS 2, layers, doors found, trajectory, MCAP, film, session.npz.
    """

    slam: str | None = None
    """SLAM variant; if not given, dynamic-graph, which closes loops, or with --onto, hmm-ml."""
    out: Path | None = None
    """Folder to write to; if not given, out/FILE."""
    onto: Path | None = None
    """session.npz of a map made before, to go on with. Where in it this begins is found."""
    start: tuple[float, float, float] | None = None
    """Where it begins in that map, if that is known: x, y in m, degrees."""
    localise: bool = False
    """With --onto: only find the way in that map, which stays as it is."""
    truth: str | None = None
    """Reference to score the trajectory with: a file in the TUM format, or a topic of the bag."""
    live: bool = False
    """Show the map in a window as it grows."""
    skip: str = ""
    """What is not wanted, with commas between: mcap, rrd, film; or all of these."""
    seed: int = 0
    """Seed of the variants that draw random numbers."""
    json: bool = False
    """Print the summary as one JSON object, the last line of standard output."""

    def __call__(self) -> int:
        """Read, map, write, print."""
        variant = self._variant()
        skip = tuple(parse_selection("part", self.skip, list(LEFT_OUT))) if self.skip else ()
        (empty if self.onto else slam.make)(variant)  # a mistake is told before all work
        session = Session.load(self.onto) if self.onto else None
        truth = reference(self.truth, self.file) if self.truth else None
        window = self._window()
        log = self.told()
        out = self._out()
        episode = prepared(log.episode)
        robot, start = self._robot(variant, session, episode)
        compile_first(variant, episode)
        stages = 1 if set(skip) == set(LEFT_OUT) else STAGES  # nobody looks at more
        mapping = MappingRun(robot, episode, variant, window, stages)
        status = self._run(mapping)
        if not mapping.estimates:
            return status
        summary = self._summary(mapping, variant, start, truth, status) | {
            "warnings": [str(warning) for warning in log.warnings]
        }
        summary = MapExport(mapping, out, session, not self.localise, skip).write(summary)
        _tell(summary, out)
        if self.json:
            print(json.dumps(summary))
        return status if "not_written" not in summary else EXIT_MISTAKE

    def _variant(self) -> str:
        if self.onto is None and (self.localise or self.start is not None):
            raise InputError("--localise and --start need a map: --onto SESSION.npz")
        if self.start is not None and not all(map(math.isfinite, self.start)):
            raise InputError(f"--start is three finite numbers, got {self.start}")
        return self.slam or (ONTO if self.onto else RECOMMENDED)

    def _out(self) -> Path:
        """The folder to write to, which must not hold the map that this goes on with."""
        out = self.out or Path("out") / stem(self.file)
        if self.onto is not None and out.resolve() == self.onto.resolve().parent:
            raise InputError(
                f"{out}: --onto needs another folder to write to (--out), its map is there"
            )
        return output_directory(out)

    def _window(self) -> Window | None:
        if not self.live:
            return None
        from .live import Live

        return Live(f"map {self.file.name}")

    def _robot(self, variant: str, session: Session | None, episode: Episode) -> tuple[Slam, Pose2]:
        """The SLAM, and where it begins."""
        if session is None:
            return slam.make(variant, seed=self.seed), Pose2()
        if self.start is not None:
            x, y, degrees = self.start
            start = Pose2(x, y, math.radians(degrees))
        else:
            print("looking for where it begins in the map ...", file=sys.stderr)
            start = relocated(session, episode)
            x, y, degrees = start.x, start.y, math.degrees(start.theta)
            print(f"found: x {x:.2f} m, y {y:.2f} m, {degrees:.1f} degrees", file=sys.stderr)
        make = localiser if self.localise else continued
        return make(session, variant, start, self.seed), start

    def _run(self, mapping: MappingRun) -> int:
        """The exit status: Ctrl-C and a scan that no map can hold end it early, and what was done
        by then is kept."""
        try:
            mapping.run()
        except KeyboardInterrupt:
            print(f"{self.file}: interrupted, writing what is done", file=sys.stderr)
            return EXIT_INTERRUPTED
        except InputError as error:
            print(f"{self.file}: {error}; writing what is done before it", file=sys.stderr)
            return EXIT_MISTAKE
        return 0

    def _summary(
        self, mapping: MappingRun, variant: str, start: Pose2, truth: Trajectory | None, status: int
    ) -> dict[str, Any]:
        run = mapping.result
        summary: dict[str, Any] = {
            "file": self.file.name,
            "slam": variant,
            "scans": len(run.poses),
            "matched": run.matched,
            "seconds": run.seconds,
            "odometry": mapping.episode.meta.get("odometry", "in it"),
            "start": list(start),
            "interrupted": status != 0,
        }
        if truth is not None:
            found = Trajectory(mapping.episode.times[: len(run.poses)], run.poses)
            try:
                summary |= score_reference(truth, found).as_dict()
            except InputError as error:  # the map is not lost for it
                print(f"{self.truth}: warning: not scored, {error}", file=sys.stderr)
        return summary


def _tell(summary: dict[str, Any], out: Path) -> None:
    print(
        f"{summary['file']}: {summary['scans']} scans by {summary['slam']} in "
        f"{summary['seconds']:.1f} s"
    )
    if "doors" in summary:
        print(
            f"seen {summary['seen_m2']:.0f} m2; {summary['stands_m2']:.1f} m2 always stand, "
            f"{summary['changes_m2']:.1f} m2 change; doors found: {len(summary['doors'])}"
        )
        for number, door in enumerate(summary["doors"][:LISTED], 1):
            x, y = door["middle"]
            print(
                f"  {number:>3}  at ({x:.1f}, {y:.1f}), {door['width']:.2f} m wide, open "
                f"{100 * door['open_share']:.0f} % of the time, changes seen: {door['flips']}"
            )
        if len(summary["doors"]) > LISTED:
            print(f"  and {len(summary['doors']) - LISTED} more, less sure: doors.geojson")
    if summary.get("ate_aligned") is not None:
        print(
            f"against the reference: ATE {1e3 * summary['ate_aligned']:.0f} mm, heading "
            f"{math.degrees(summary['heading_rms']):.2f} deg, at {summary['stamps']} stamps"
        )
    print(f"written to {out}: {', '.join(summary['files'])}")
