"""`dynslam info FILE`: what is in a recording."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np

from slam.episode import Episode
from slam.io.formats import kind_of
from slam.io.loaded_recording import LoadedRecording

from .source import RecordingSource

KINDS = {
    "bag": "ROS recording", "episode": "episode saved by dynslam", "npz": "arrays of scans",
    "csv": "table of scans", "carmen": "CARMEN log",
}  # fmt: skip
MANY = 40  # topics that are listed


@dataclass(kw_only=True)
class InfoCommand(RecordingSource):
    """Tell what is in a recording: topics, laser, odometry, how long and how far, what is wrong."""

    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> int:
        """Read, tell."""
        kind = kind_of(self.file)
        told: dict[str, Any] = {"file": self.file.name, "format": KINDS[kind]}
        if kind == "bag":
            from slam.io.bags.contents import contents_of

            told |= contents_of(self.file)
            if not self.json:
                _tell_topics(told)
        log = self.read()
        told |= summary(log)
        if self.json:
            print(json.dumps(told))
            return 0
        if kind != "bag":
            print(f"{self.file}: {told['format']}")
        _tell(told)
        for warning in told["warnings"]:
            print(f"warning: {warning}", file=sys.stderr)
        return 0


def summary(log: LoadedRecording) -> dict[str, Any]:
    """What a log holds, as plain numbers and words."""
    episode = log.episode
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
        "odometry": (episode.meta.get("odometry") or "in it") if episode.has_odometry else None,
        **_way(episode),
        "truth": episode.truth is not None,
        "warnings": [str(warning) for warning in log.warnings],
    }


def _way(episode: Episode) -> dict[str, Any]:
    if not episode.has_odometry:
        return {"metres": None, "turns": None}
    poses = episode.odometry.at(episode.times)
    steps = np.diff(poses, axis=0)
    turned = np.abs(np.unwrap(poses[:, 2])[1:] - np.unwrap(poses[:, 2])[:-1]).sum()
    metres = np.hypot(steps[:, 0], steps[:, 1]).sum()
    return {"metres": float(metres), "turns": float(turned / math.tau)}


def _tell_topics(told: dict[str, Any]) -> None:
    print(f"{told['file']}: {told['format']}, {told['ros']}, {told['recorded_s']:.1f} s")
    rows = told["topics"]
    width = max((len(row["topic"]) for row in rows), default=0)
    for row in rows[:MANY]:
        print(f"  {row['topic']:<{width}}  {row['messages']:>7}  {row['type']}")
    if len(rows) > MANY:
        print(f"  and {len(rows) - MANY} more")


def _tell(told: dict[str, Any]) -> None:
    low, high = told["range_m"]
    x, y, degrees = told["mount"]
    beams = " to ".join(map(str, told["beams"]))
    rate = f", {told['scans_per_s']:.1f} a second" if told["scans_per_s"] else ""
    lines = {
        "scans": f"{told['scans']} in {told['seconds']:.1f} s{rate}",
        "laser": (
            f"{told['laser'] + ', ' if told['laser'] else ''}{beams} beams over "
            f"{told['field_of_view_deg']:.0f} degrees, {low:g} to {high:g} m, "
            f"{100 * told['echoes']:.0f} % with an echo"
        ),
        "mounted": f"{x:g} m ahead, {y:g} m to the left, turned by {degrees:g} degrees",
        "odometry": (
            f"{told['odometry']}: {told['metres']:.1f} m, {told['turns']:.1f} turns"
            if told["odometry"]
            else "none: the laser alone tells how the robot moved"
        ),
    }
    if told["longest_gap_s"] and told["longest_gap_s"] > 5.0:
        lines["gap"] = f"{told['longest_gap_s']:.1f} s without a scan"
    if told["truth"]:
        lines["truth"] = "poses, walls and doors"
    for name, text in lines.items():
        print(f"{name:>9}  {text}")
