"""The work of `dynslam map`: SLAM on a recording, the files of its map, a summary."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import slam
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Slam
from slam.io.formats import kind_of
from slam.io.tum import read_tum
from slam.layers.doors import SURE
from slam.metrics.reference import score_reference
from slam.sessions.continuation import continued, empty, localiser
from slam.sessions.session import Session, check_order
from slam.trajectory import Trajectory

from ..console.compiling import compiling_told
from ..console.config_file import write_config
from ..console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE
from ..console.output import own_directory
from ..console.selection import check_variant, parse_selection
from ..recordings.clocks import parsed_clock
from ..recordings.preparation import compile_first, prepared
from ..recordings.source import stem
from .alignment import aligned
from .certainty import Certainty
from .drawing import CELL, USUAL, Drawing, missed, parsed_drawing
from .map_export import SKIPPABLE, SNAPSHOTS, MapExport
from .map_size import check_size
from .mapping_run import MappingRun
from .run_clock import RunClock, in_words
from .start import Start, parsed_pose, start_in

if TYPE_CHECKING:
    from .live import Live
    from .map import MapCommand

DEFAULT_VARIANT, DEFAULT_LOCALISER = "dynamic-graph", "hmm-ml"
MAX_DOORS_PRINTED = 10
PICTURES = ".yaml", ".pgm", ".png"
CONFIG_FILE = "config.toml"
REPEAT = "dynslam map --config FILE, with the path of this file, repeats the run"
NEXT = "look at map.png; `dynslam info FILE` tells what is wrong with a recording"
NEXT_LOCALISED = (
    "look at map.png: is the recording of this place? If it is, give its start pose (--start), or "
    "map what has changed since (without --localise)"
)


@compiling_told()
def map_recording(options: MapCommand, begun: float) -> int:
    """Read, map, write, print; the exit status.

    begun  s, when the command began, by time.perf_counter
    """
    watch = RunClock(begun)
    variant = _variant(options)
    skip = _skipped(options)
    (empty if options.onto else slam.make)(variant)  # raises before any work
    clock, given = parsed_clock(options.clock), parsed_pose("--start", options.start)
    drawing = _drawing(options)
    session = Session.load(options.onto) if options.onto else None
    truth = read_reference(options.truth, options.file) if options.truth else None
    window = _window(options)
    lasers, warnings = options.read_limited()
    out = _out(options)
    episode, corrected = prepared(lasers, clock, options.file)
    if session is not None and not options.localise:
        check_order(session, episode)
    if drawing.resolution < CELL:
        check_size(episode.scans, episode.odometry.at(episode.times), drawing.resolution)
    compile_first(variant, episode)
    start = Start(Pose2()) if session is None else start_in(session, episode, given)
    start = aligned(start, options, variant, episode) if options.align else start
    robot = _robot(options, variant, session, start.pose)
    mapping = MappingRun(robot, episode, variant, window, _snapshots(skip))
    status = _run(options, mapping)
    if not mapping.estimates:
        return status
    run = mapping.result
    certainty = Certainty(episode.times[: len(run.lost)], run.lost, run.drift)
    warnings += [*corrected, *start.warnings, *certainty.warnings]
    summary = _summary(options, mapping, variant, start.pose, truth, status)
    summary |= certainty.as_dict() | {"warnings": warnings}
    summary["files"] = _config(options, variant, out)
    export = MapExport(mapping, out, session, not options.localise, skip, drawing)
    summary = export.write(summary, watch)
    _tell_of_mask(drawing, export, options)
    _print_summary(summary, out)
    _tell(certainty, options)
    if options.json:
        print(json.dumps(summary))
    if window is not None:
        window.finish(_found(summary), export.layers.doors if export.layers else ())
    return (status or certainty.status) if "not_written" not in summary else EXIT_MISTAKE


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
    if options.onto is not None and options.onto.suffix in PICTURES:
        raise InputError(
            f"{options.onto}: a picture of a map holds no scans to go on from: give the "
            f"session.npz beside it (--onto); what was painted over in the picture can be a --mask"
        )
    if options.slam:
        check_variant(options.slam)
    return options.slam or (DEFAULT_LOCALISER if options.localise else DEFAULT_VARIANT)


def _drawing(options: MapCommand) -> Drawing:
    drawing = parsed_drawing(options.resolution, options.keep, options.mask, options.robot_radius)
    if options.align and options.onto:
        raise InputError("--align turns a new map; --onto continues one in the frame that it has")
    if options.localise and drawing != USUAL:
        raise InputError("--localise writes no map: leave out --resolution, --keep and --mask")
    return drawing


def _config(options: MapCommand, variant: str, out: Path) -> list[str]:
    """Write the options that were used, so that the run can be repeated."""
    used = replace(options, slam=variant)
    write_config(used, ("out", "live", "json"), REPEAT, out / CONFIG_FILE)
    return [CONFIG_FILE]


def _tell_of_mask(drawing: Drawing, export: MapExport, options: MapCommand) -> None:
    if drawing.mask is not None and missed(drawing.mask, export.run.grid):
        print(
            f"{options.mask}: warning: no black cell of this mask lies where the map was seen",
            file=sys.stderr,
        )


def _out(options: MapCommand) -> Path:
    """The folder to write to. It may be that of the map that is continued, but not of one that the
    robot is localised in, whose files would be those of another run."""
    out = options.out or Path("out") / stem(options.file)
    if options.localise and options.onto and out.resolve() == options.onto.resolve().parent:
        raise InputError(
            f"{out}: holds the map of --onto, which needs another folder to write to (--out)"
        )
    return own_directory(out)


def _skipped(options: MapCommand) -> tuple[str, ...]:
    """The parts that are not written: what is left out, and what is not asked for."""
    known: list[str] = list(SKIPPABLE)
    skip = (
        parse_selection("part", options.skip, known, "dynslam map --help") if options.skip else []
    )
    asked = {"film": options.film, "page": options.page}
    return (*skip, *(part for part, wanted in asked.items() if not wanted))


def _snapshots(skip: tuple[str, ...]) -> int:
    """How many maps of the run are kept: each has to be drawn, and only some of the files show
    them."""
    shown = [SNAPSHOTS[part] for part in SNAPSHOTS if part not in skip]
    return max(shown, default=1)


def _found(summary: dict[str, Any]) -> str:
    """What was found, for the line below a window."""
    words = f"done: {summary['scans']} scans"
    if "doors" in summary:
        sure = sum(door["probability"] >= SURE for door in summary["doors"])
        perhaps = len(summary["doors"]) - sure
        words += f", {summary['seen_m2']:.0f} m2 seen, doors: {sure}, perhaps: {perhaps}"
    lost = summary["lost_share"]
    return f"{words}, lost at {100 * lost:.2g} % of the scans" if lost else words


def _window(options: MapCommand) -> Live | None:
    if not options.live:
        return None
    from .live import Live

    return Live(f"map {options.file.name}")


def _robot(options: MapCommand, variant: str, session: Session | None, start: Pose2) -> Slam:
    """The SLAM, at its start pose."""
    if session is None:
        return slam.make(variant, start, options.seed)
    make = localiser if options.localise else continued
    return make(session, variant, start, options.seed)


def _tell(certainty: Certainty, options: MapCommand) -> None:
    """What the run was not sure of, and what to do next."""
    for warning in certainty.warnings:
        print(f"{options.file}: warning: {warning}", file=sys.stderr)
    if not certainty.sure:
        print(NEXT_LOCALISED if options.localise else NEXT, file=sys.stderr)


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
        f"{summary['seconds']:.1f} s, {in_words(summary)}; peak memory "
        f"{summary['peak_memory_mb']:.0f} MB"
    )
    if "doors" in summary:
        _print_layers(summary)
    if summary.get("ate_aligned") is not None:
        print(
            f"against the reference: ATE {1e3 * summary['ate_aligned']:.0f} mm, heading "
            f"{math.degrees(summary['heading_rms']):.2f} deg, at {summary['stamps']} stamps"
        )
    print(f"written to {out}: {', '.join(summary['files'])}")
    if summary["of_earlier_run"]:
        print(f"of an earlier run, not written again: {', '.join(summary['of_earlier_run'])}")


def _print_layers(summary: dict[str, Any]) -> None:
    """What stands, what was kept and left out and why, and the doors."""
    kept, left_out = summary["kept_m2"], summary["left_out_m2"]
    print(
        f"seen {summary['seen_m2']:.0f} m2; map.yaml: {summary['stands_m2']:.1f} m2 occupied, of "
        f"them {kept['seen_once']:.1f} seen once, {kept['seen_in_part']:.1f} by some beams only, "
        f"{kept['glass']:.1f} glass"
    )
    print(
        f"left out: {left_out['went_away']:.1f} m2 of what was seen to come or go, "
        f"{left_out['door_leaf']:.1f} m2 leaves of doors (layers.png shows both)"
    )
    doors = summary["doors"]
    sure = sum(door["probability"] >= SURE for door in doors)
    moved = sum(door["flips"] > 0 for door in doors)
    print(f"doors: {sure}, and {len(doors) - sure} perhaps; {moved} of them moved in sight")
    for number, door in enumerate(doors[:MAX_DOORS_PRINTED], 1):
        x, y = door["middle"]
        print(
            f"  {number:>3}  {min(round(100 * door['probability']), 99)} %, at ({x:.1f}, {y:.1f}), "
            f"{door['width']:.2f} m wide, {_seen(door)}"
        )
    if len(doors) > MAX_DOORS_PRINTED:
        print(f"  and {len(doors) - MAX_DOORS_PRINTED} more, less probable: see doors.geojson")


def _seen(door: dict[str, Any]) -> str:
    """In which states a door was seen."""
    scans = {"open": door["seen_open_scans"], "closed": door["seen_closed_scans"]}
    if door["flips"]:
        return f"open {100 * door['open_share']:.0f} % of the time, changes seen: {door['flips']}"
    seen = " and ".join(f"{state} by {_scans(n)}" for state, n in scans.items() if n)
    return f"not seen to move: {seen or 'neither open nor closed'}"


def _scans(n: int) -> str:
    return "1 scan" if n == 1 else f"{n} scans"
