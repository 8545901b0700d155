"""A description of a recording: its topics, lasers and odometry."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable
from typing import Any

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.io.formats import kind_of
from slam.io.loaded_recording import LoadedRecording
from slam.preprocessing.clock import estimated_clock
from slam.recovery.pace import jumps

from .clocks import plain_clock
from .info import InfoCommand

KINDS = {
    "bag": "ROS recording", "episode": "episode saved by dynslam", "npz": "arrays of scans",
    "csv": "table of scans", "carmen": "CARMEN log",
}  # fmt: skip
MAX_TOPICS = 40  # maximum number listed
LONG_GAP = 5.0  # s without a scan, from which on it is mentioned
SAME_RATE = 0.1  # share by which the mean rate of the scans may differ from the usual one
LISTED_JUMPS = 3  # of the odometry, the first ones


def describe(command: InfoCommand) -> int:
    """Read a recording and print what is in it."""
    kind = kind_of(command.file)
    found: dict[str, Any] = {"file": command.file.name, "format": KINDS.get(kind, kind)}
    topics: list[str] = []
    if kind == "bag":
        from slam.io.bags.contents import contents_of, laser_topics

        found |= contents_of(command.file)
        topics = laser_topics(found)
        if not command.json:
            _print_topics(found)
    found |= summary(recordings(command, topics))
    if command.json:
        print(json.dumps(found))
        return 0
    if kind != "bag":
        print(f"{command.file}: {found['format']}")
    _print_summary(found)
    for warning in found["warnings"]:
        print(f"warning: {warning}", file=sys.stderr)
    return 0


def recordings(command: InfoCommand, topics: list[str]) -> list[LoadedRecording]:
    """The recording as each of its lasers saw it, or the chosen ones. Raises InputError where
    no laser can be read."""
    if command.laser:
        return [command.read(topic) for topic in dict.fromkeys(command.laser)]
    if len(topics) < 2:
        return [command.read()]
    found, errors = [], []
    for topic in topics:
        try:
            found.append(command.read(topic))
        except InputError as error:
            errors.append(error)
    for error in errors if found else ():
        print(f"warning: {error}", file=sys.stderr)
    if not found:
        raise errors[0]
    return found


def summary(logs: list[LoadedRecording]) -> dict[str, Any]:
    """Summary of a recording in plain numbers and words: `lasers` describes each of its lasers, all
    other entries are of the first."""
    first = logs[0].episode
    lasers = [_laser(log.episode) for log in logs]
    warnings = (str(warning) for log in logs for warning in log.warnings)
    return {
        **lasers[0],
        "lasers": lasers,
        "odometry": (first.meta.get("odometry") or "in it") if first.has_odometry else None,
        **_way(first),
        "truth": first.truth is not None,
        "warnings": list(dict.fromkeys(warnings)),
    }


def _laser(episode: Episode) -> dict[str, Any]:
    """One laser: its scans, its beams, its mounting."""
    scans, times = episode.scans, episode.times
    steps = np.diff(times)
    beams = sorted({len(scan.ranges) for scan in scans})
    first = scans[0]
    hits = np.array([scan.hit.mean() if len(scan.hit) else 0.0 for scan in scans])
    return {
        "scans": len(scans),
        "seconds": float(times[-1] - times[0]),
        "scans_per_s": float(1 / np.median(steps)) if len(steps) else None,
        "longest_gap_s": float(steps.max()) if len(steps) else None,
        "laser": episode.meta.get("laser"),
        "beams": beams if len(beams) <= 3 else [beams[0], beams[-1]],
        "field_of_view_deg": math.degrees(float(np.ptp(first.angles))) if beams[-1] else None,
        "range_m": [first.min_range, first.max_range],
        "echoes": float(hits.mean()),
        "mount": [first.mount.x, first.mount.y, math.degrees(first.mount.theta)],
        "clock": plain_clock(estimated_clock(episode)),
    }


def _way(episode: Episode) -> dict[str, Any]:
    if not episode.has_odometry:
        return {"metres": None, "turns": None, "jumps": []}
    poses = episode.odometry.at(episode.times)
    steps = np.diff(poses, axis=0)
    turned = np.abs(np.unwrap(poses[:, 2])[1:] - np.unwrap(poses[:, 2])[:-1]).sum()
    metres = np.hypot(steps[:, 0], steps[:, 1]).sum()
    begin = episode.scans[0].time
    found = [
        {"s": one.time - begin, "metres": one.distance, "degrees": math.degrees(one.turn)}
        for one in jumps(episode)
    ]
    return {"metres": float(metres), "turns": float(turned / math.tau), "jumps": found}


def _print_topics(found: dict[str, Any]) -> None:
    print(f"{found['file']}: {found['format']}, {found['ros']}, {found['recorded_s']:.1f} s")
    rows = found["topics"]
    width = max((len(row["topic"]) for row in rows), default=0)
    for row in rows[:MAX_TOPICS]:
        print(f"  {row['topic']:<{width}}  {row['messages']:>7}  {row['type']}")
    if len(rows) > MAX_TOPICS:
        print(f"  and {len(rows) - MAX_TOPICS} more")


def _print_summary(found: dict[str, Any]) -> None:
    for laser in found["lasers"]:
        _print_lines(_laser_lines(laser))
        if len(found["lasers"]) > 1:
            print()
    odometry = "none: the laser alone tells how the robot moved"
    if found["odometry"]:
        odometry = f"{found['odometry']}: {found['metres']:.1f} m, {found['turns']:.1f} turns"
    _print_lines([("odometry", odometry)])
    if found["jumps"]:
        _print_lines([("", _jumps_in_words(found["jumps"]))])
    if found["truth"]:
        _print_lines([("truth", "poses, walls and doors")])


def _jumps_in_words(found: list[dict[str, float]]) -> str:
    times = "once" if len(found) == 1 else f"{len(found)} times"
    listed = [
        f"after {one['s']:.1f} s by {one['metres']:.2f} m and {abs(one['degrees']):.0f} degrees"
        for one in found[:LISTED_JUMPS]
    ]
    more = ["..."] * (len(found) > LISTED_JUMPS)
    return f"jumps, or scans are missing, {times}: {'; '.join(listed + more)}"


def _rate(laser: dict[str, Any]) -> str:
    """How many scans there are a second, on average, and mostly if that differs."""
    mostly, seconds = laser["scans_per_s"], laser["seconds"]
    if not mostly or seconds <= 0.0:
        return ""
    mean = (laser["scans"] - 1) / seconds
    if abs(mean - mostly) <= SAME_RATE * mostly:
        return f", {mostly:.1f} a second"
    return f", {mean:.1f} a second, mostly {mostly:.1f}"


def _laser_lines(laser: dict[str, Any]) -> Iterable[tuple[str, str]]:
    yield "scans", f"{laser['scans']} in {laser['seconds']:.1f} s{_rate(laser)}"
    low, high = laser["range_m"]
    beams = " to ".join(map(str, laser["beams"]))
    yield (
        "laser",
        f"{laser['laser'] + ', ' if laser['laser'] else ''}{beams} beams over "
        f"{laser['field_of_view_deg']:.0f} degrees, {low:g} to {high:g} m, "
        f"{100 * laser['echoes']:.0f} % with an echo",
    )
    x, y, degrees = laser["mount"]
    yield "mounted", f"{x:g} m ahead, {y:g} m to the left, turned by {degrees:g} degrees"
    yield "clock", laser["clock"]["in_words"]
    if laser["longest_gap_s"] and laser["longest_gap_s"] > LONG_GAP:
        yield "gap", f"{laser['longest_gap_s']:.1f} s without a scan"


def _print_lines(lines: Iterable[tuple[str, str]]) -> None:
    for name, text in lines:
        print(f"{name:>9}  {text}")
