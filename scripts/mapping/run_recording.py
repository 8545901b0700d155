"""The work of `dynslam run`: a variant on a recording, its files and its metrics."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import slam
from slam.benchmark.configuration import configuration
from slam.benchmark.results import versions
from slam.benchmark.run import Playback, Run
from slam.episode import Episode
from slam.errors import InputError
from slam.interface import Slam
from slam.io.relations import read_relations
from slam.io.ros_map import write_ros_map
from slam.io.tum import write_tum
from slam.metrics.relations import score_relations, within
from slam.trajectory import Trajectory

from ..console.compiling import compiling_told
from ..console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE
from ..console.interrupts import deferred_interrupt
from ..console.output import own_directory, write_json, write_png
from ..console.process_memory import peak_mb
from ..console.progress import progress_bar
from ..console.selection import check_variant
from ..figures.cost_figure import cost_figure
from ..figures.lost_course import LostCourse
from ..figures.map_figure import map_figure
from ..recordings.clocks import parsed_clock
from ..recordings.preparation import compile_first, prepared
from ..recordings.source import stem
from .certainty import Certainty
from .lost_file import write_lost

if TYPE_CHECKING:
    from .run import RunCommand

FILES = "map.pgm", "map.yaml", "map.png", "cost.png", "metrics.json"


@compiling_told()
def run_recording(options: RunCommand) -> int:
    """Read, run, write, print; the exit status."""
    check_variant(options.slam)
    robot = slam.make(options.slam, seed=options.seed)  # raises before any work
    relations = read_relations(options.relations) if options.relations else None
    clock = parsed_clock(options.clock)
    lasers, warnings = options.read_limited()
    if relations is not None and not within(lasers[0].odometry, relations.first).any():
        raise InputError(f"{options.relations}: its stamps all lie outside those of {options.file}")
    out = own_directory(options.out or _default_out(options))
    episode, corrected = prepared(lasers, clock, options.file)
    run, status = _run(options, robot, episode)
    if not len(run.poses):
        return status
    done = Trajectory(episode.times[: len(run.poses)], run.poses)
    certainty = Certainty(done.times, run.lost, run.drift)
    online = Trajectory(done.times, run.online)
    revised = not np.array_equal(run.online, run.poses)
    metrics: dict[str, Any] = {}
    if relations is not None:
        odometry = _odometry_until(done, episode)
        metrics |= score_relations(relations, done, odometry).as_dict()
        if revised:
            metrics |= score_relations(relations, online, odometry).as_dict("_online")
    if revised:
        write_tum(online, out / "trajectory-online.tum")
    write_tum(done, out / "trajectory.tum")
    lost = LostCourse(done.times, run.lost)
    lost_files = write_lost(lost, out)
    write_ros_map(run.grid, out / "map.yaml")
    title = f"{options.file.name}, {options.slam}"
    write_png(map_figure(run.grid, run.poses, title=title, lost=lost), out / "map.png")
    write_png(cost_figure(run.poses, run.spent, title=title), out / "cost.png")
    metrics = _measured(options, run) | {  # last: the peak of memory includes the pictures
        "configuration": configuration(robot),
        "clock": episode.meta.get("clock"),
        "interrupted": status != 0,
        "warnings": [*warnings, *corrected, *certainty.warnings],
    } | certainty.as_dict() | metrics  # fmt: skip
    write_json(metrics, out / "metrics.json")
    _print_metrics(options, metrics, out, lost_files)
    for warning in certainty.warnings:
        print(f"{options.file}: warning: {warning}", file=sys.stderr)
    return status or certainty.status


def _default_out(options: RunCommand) -> Path:
    return Path("out") / f"{stem(options.file)}-{options.slam.replace('/', '-')}"


def _run(options: RunCommand, robot: Slam, episode: Episode) -> tuple[Run, int]:
    """The run and the exit status; Ctrl-C and an InputError of the map end it early.

    The scans processed by then are kept.
    """
    playback = Playback(robot, episode)
    try:
        compile_first(options.slam, episode)
        with progress_bar() as progress, deferred_interrupt() as between_steps:
            for _ in progress.track(playback, len(episode.scans), description=options.slam):
                between_steps()
    except KeyboardInterrupt:
        print(f"{options.file}: interrupted, writing what is done", file=sys.stderr)
        return playback.result(), EXIT_INTERRUPTED
    except InputError as error:
        print(f"{options.file}: {error}; writing what is done before it", file=sys.stderr)
        return playback.result(), EXIT_MISTAKE
    return playback.result(), 0


def _measured(options: RunCommand, run: Run) -> dict[str, Any]:
    return {
        "log": options.file.name,
        "slam": options.slam,
        "seed": options.seed,
        "scans": len(run.poses),
        "matched": run.matched,
        "seconds": run.seconds,
        "ms_per_matched_scan": run.ms_per_matched_scan,
        "peak_memory_mb": peak_mb(),
        "versions": versions(),
    }


def _print_metrics(
    options: RunCommand, metrics: dict[str, Any], out: Path, lost_files: list[str]
) -> None:
    print(
        f"{metrics['scans']} scans, {metrics['matched']} matched, in "
        f"{metrics['seconds']:.1f} s: {metrics['ms_per_matched_scan']:.2f} ms per matched scan; "
        f"peak memory {metrics['peak_memory_mb']:.0f} MB"
    )
    if metrics.get("left_out"):
        print(
            f"{options.relations}: warning: {metrics['left_out']} relations left out, their "
            f"stamps lie outside what was mapped of {options.file}",
            file=sys.stderr,
        )
    if metrics.get("relations"):
        print(
            f"error of {metrics['relations']} relations: "
            f"{metrics['translation_mean']:.4f} +- {metrics['translation_std']:.4f} m, "
            f"{metrics['rotation_mean_deg']:.2f} +- {metrics['rotation_std_deg']:.2f} deg"
        )
        print(_clear_told(metrics))
    if metrics.get("translation_mean_online") is not None:
        print(
            f"error of the online poses: {metrics['translation_mean_online']:.4f} m, "
            f"{metrics['rotation_mean_deg_online']:.2f} deg"
        )
    names = ["trajectory.tum", *lost_files, *FILES]
    print(f"written to {out}: {', '.join(names)}")
    if options.json:
        print(json.dumps(metrics))


def _clear_told(metrics: dict[str, Any]) -> str:
    """The error of the relations whose stamps are clear, or that there are none."""
    clear, mean = metrics["clear"], metrics["clear_translation_mean"]
    if not clear:
        return "none of them has clear stamps: each fits several lines of the odometry"
    return f"error of the {clear} whose stamps fit one line of the odometry only: {mean:.4f} m"


def _odometry_until(done: Trajectory, episode: Episode) -> Trajectory:
    """The odometry up to the last pose of a run that may have been interrupted."""
    if len(done) == len(episode.scans):
        return episode.odometry
    known = episode.odometry.times <= done.times[-1]
    return Trajectory(episode.odometry.times[known], episode.odometry.poses[known])
