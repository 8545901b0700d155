"""The work of `dynslam map`: SLAM on a recording, the files of its map, a summary."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import slam
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Slam
from slam.io.formats import kind_of
from slam.io.tum import read_tum
from slam.metrics.reference import score_reference
from slam.sessions.relocalisation import continued, empty, localiser, relocated
from slam.sessions.session import Session
from slam.trajectory import Trajectory

from ..console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE
from ..console.output import output_directory
from ..console.selection import check_variant, parse_selection
from ..recordings.clocks import parsed_clock
from ..recordings.preparation import compile_first, prepared
from ..recordings.source import stem
from .map_export import OPTIONAL_PARTS, MapExport
from .mapping_run import MAX_SNAPSHOTS, MappingRun, Window

if TYPE_CHECKING:
    from .map import MapCommand

DEFAULT_VARIANT, DEFAULT_CONTINUED_VARIANT = "dynamic-graph", "hmm-ml"
MAX_DOORS_PRINTED = 10


def map_recording(options: MapCommand) -> int:
    """Read, map, write, print; the exit status."""
    variant = _variant(options)
    skip = tuple(parse_selection("part", options.skip, list(OPTIONAL_PARTS), "dynslam map --help")
                 if options.skip else ())  # fmt: skip
    (empty if options.onto else slam.make)(variant)  # raises before any work
    session = Session.load(options.onto) if options.onto else None
    truth = read_reference(options.truth, options.file) if options.truth else None
    window = _window(options)
    clock = parsed_clock(options.clock)
    log = options.read_and_warn()
    out = _out(options)
    episode = prepared(log.episode, clock, options.file)
    robot, start = _robot(options, variant, session, episode)
    compile_first(variant, episode)
    snapshots = 1 if set(skip) == set(OPTIONAL_PARTS) else MAX_SNAPSHOTS  # only those show them
    mapping = MappingRun(robot, episode, variant, window, snapshots)
    status = _run(options, mapping)
    if not mapping.estimates:
        return status
    summary = _summary(options, mapping, variant, start, truth, status) | {
        "warnings": [str(warning) for warning in log.warnings]
    }
    summary = MapExport(mapping, out, session, not options.localise, skip).write(summary)
    _print_summary(summary, out)
    if options.json:
        print(json.dumps(summary))
    return status if "not_written" not in summary else EXIT_MISTAKE


def read_reference(name: str, recording: Path) -> Trajectory:
    """The reference trajectory `name`: a file in the TUM format, else a topic of the recording.

    Raises InputError.
    """
    if Path(name).is_file():
        return read_tum(name)
    if kind_of(recording) != "bag":
        raise InputError(f"{name}: no such file, and {recording} has no topics")
    from slam.io.bags import read_reference as read_topic

    return read_topic(recording, name)


def _variant(options: MapCommand) -> str:
    if options.onto is None and (options.localise or options.start is not None):
        raise InputError("--localise and --start need a map: --onto SESSION.npz")
    if options.start is not None and not all(map(math.isfinite, options.start)):
        raise InputError(f"--start is three finite numbers, got {options.start}")
    if options.slam:
        check_variant(options.slam)
    return options.slam or (DEFAULT_CONTINUED_VARIANT if options.onto else DEFAULT_VARIANT)


def _out(options: MapCommand) -> Path:
    """The folder to write to, which must not hold the map that is continued."""
    out = options.out or Path("out") / stem(options.file)
    if options.onto is not None and out.resolve() == options.onto.resolve().parent:
        raise InputError(
            f"{out}: holds the map of --onto, which needs another folder to write to (--out)"
        )
    return output_directory(out)


def _window(options: MapCommand) -> Window | None:
    if not options.live:
        return None
    from .live import Live

    return Live(f"map {options.file.name}")


def _robot(
    options: MapCommand, variant: str, session: Session | None, episode: Episode
) -> tuple[Slam, Pose2]:
    """The SLAM, and its start pose."""
    if session is None:
        return slam.make(variant, seed=options.seed), Pose2()
    if options.start is not None:
        x, y, degrees = options.start
        start = Pose2(x, y, math.radians(degrees))
    else:
        print("looking for the start pose in the map ...", file=sys.stderr)
        start = relocated(session, episode)
        x, y, degrees = start.x, start.y, math.degrees(start.theta)
        print(f"found: x {x:.2f} m, y {y:.2f} m, {degrees:.1f} degrees", file=sys.stderr)
    make = localiser if options.localise else continued
    return make(session, variant, start, options.seed), start


def _run(options: MapCommand, mapping: MappingRun) -> int:
    """The exit status; Ctrl-C and an InputError of the map end the run early.

    The scans processed by then are kept.
    """
    try:
        mapping.run()
    except KeyboardInterrupt:
        print(f"{options.file}: interrupted, writing what is done", file=sys.stderr)
        return EXIT_INTERRUPTED
    except InputError as error:
        print(f"{options.file}: {error}; writing what is done before it", file=sys.stderr)
        return EXIT_MISTAKE
    return 0


def _summary(
    options: MapCommand,
    mapping: MappingRun,
    variant: str,
    start: Pose2,
    truth: Trajectory | None,
    status: int,
) -> dict[str, Any]:
    run = mapping.result
    summary: dict[str, Any] = {
        "file": options.file.name,
        "slam": variant,
        "scans": len(run.poses),
        "matched": run.matched,
        "seconds": run.seconds,
        "odometry": mapping.episode.meta.get("odometry", "in it"),
        "clock": mapping.episode.meta.get("clock"),
        "start": list(start),
        "interrupted": status != 0,
    }
    if truth is not None:
        found = Trajectory(mapping.episode.times[: len(run.poses)], run.poses)
        try:
            summary |= score_reference(truth, found).as_dict()
        except InputError as error:  # the map is written all the same
            print(f"{options.truth}: warning: not scored, {error}", file=sys.stderr)
    return summary


def _print_summary(summary: dict[str, Any], out: Path) -> None:
    print(
        f"{summary['file']}: {summary['scans']} scans by {summary['slam']} in "
        f"{summary['seconds']:.1f} s; peak memory {summary['peak_memory_mb']:.0f} MB"
    )
    if "doors" in summary:
        print(
            f"seen {summary['seen_m2']:.0f} m2; {summary['stands_m2']:.1f} m2 always occupied, "
            f"{summary['changes_m2']:.1f} m2 changing; doors found: {len(summary['doors'])}"
        )
        for number, door in enumerate(summary["doors"][:MAX_DOORS_PRINTED], 1):
            x, y = door["middle"]
            print(
                f"  {number:>3}  at ({x:.1f}, {y:.1f}), {door['width']:.2f} m wide, open "
                f"{100 * door['open_share']:.0f} % of the time, changes seen: {door['flips']}"
            )
        if len(summary["doors"]) > MAX_DOORS_PRINTED:
            rest = len(summary["doors"]) - MAX_DOORS_PRINTED
            print(f"  and {rest} more, less certain: see doors.geojson")
    if summary.get("ate_aligned") is not None:
        print(
            f"against the reference: ATE {1e3 * summary['ate_aligned']:.0f} mm, heading "
            f"{math.degrees(summary['heading_rms']):.2f} deg, at {summary['stamps']} stamps"
        )
    print(f"written to {out}: {', '.join(summary['files'])}")
