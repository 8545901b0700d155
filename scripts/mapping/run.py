"""`dynslam run LOG`: a map and a trajectory out of a recorded log."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import slam
from slam.benchmark.configuration import configuration
from slam.benchmark.results import versions
from slam.benchmark.run import Playback, Run
from slam.episode import Episode
from slam.errors import InputError
from slam.io.relations import read_relations
from slam.io.ros_map import write_ros_map
from slam.io.tum import write_tum
from slam.metrics.relations import score_relations, within
from slam.trajectory import Trajectory

from ..console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE
from ..console.interrupts import deferred_interrupt
from ..console.output import output_directory, write_json, write_png
from ..console.process_memory import peak_mb
from ..console.progress import progress_bar
from ..figures.cost_figure import cost_figure
from ..figures.map_figure import map_figure
from ..recordings.source import RecordingSource, compile_first, prepared, stem


@dataclass(kw_only=True)
class RunCommand(RecordingSource):
    """Run a SLAM variant on a recording and measure it: writes trajectory.tum, map.pgm + map.yaml,
    map.png, cost.png, metrics.json. (`dynslam map` is for the map itself.)

    A particle filter or a graph, which revises the past, also writes trajectory-online.tum: the
    poses as believed on the way.
    """

    slam: str = "dynamic-ml"
    """SLAM variant, such as odometry, static-ml, dynamic-ml; an unknown name lists them all."""
    relations: Path | None = None
    """Known relations between poses (Kuemmerle et al. 2009) to score the trajectory with."""
    out: Path | None = None
    """Directory to write to; if none is given, out/LOG-VARIANT."""
    seed: int = 0
    """Seed of the variants that draw random numbers."""
    json: bool = False
    """Print the metrics as one JSON object, the last line of standard output."""

    def __call__(self) -> int:
        """Read, run, write, print."""
        robot = slam.make(self.slam, seed=self.seed)  # a mistake here is told before all work
        relations = read_relations(self.relations) if self.relations else None
        episode, warnings = self.told()
        if relations is not None and not within(episode.odometry, relations.first).any():
            raise InputError(f"{self.relations}: its stamps all lie outside those of {self.file}")
        out = output_directory(self.out or self._default_out())
        episode = prepared(episode)
        run, status = self._run(robot, episode)
        if not len(run.poses):
            return status
        done = Trajectory(episode.times[: len(run.poses)], run.poses)
        metrics = self._metrics(run) | {
            "configuration": configuration(robot),
            "interrupted": status != 0,
            "warnings": [str(warning) for warning in warnings],
        }
        if relations is not None:
            metrics |= score_relations(relations, done, _until(done, episode)).as_dict()
        online = Trajectory(done.times, run.online)
        revised = not np.array_equal(run.online, run.poses)
        if revised:
            write_tum(online, out / "trajectory-online.tum")
            if relations is not None:
                metrics |= score_relations(relations, online, _until(done, episode)).as_dict(
                    "_online"
                )
        write_tum(done, out / "trajectory.tum")
        write_ros_map(run.grid, out / "map.yaml")
        write_json(metrics, out / "metrics.json")
        figure = map_figure(run.grid, run.poses, title=f"{self.file.name}, {self.slam}")
        write_png(figure, out / "map.png")
        cost = cost_figure(run.poses, run.spent, title=f"{self.file.name}, {self.slam}")
        write_png(cost, out / "cost.png")
        self._tell(metrics, out)
        return status

    def _default_out(self) -> Path:
        return Path("out") / f"{stem(self.file)}-{self.slam.replace('/', '-')}"

    def _run(self, robot: slam.Slam, episode: Episode) -> tuple[Run, int]:
        """The run and the exit status: Ctrl-C and a scan that no map can hold end it early.

        What was done by then is kept.
        """
        playback = Playback(robot, episode)
        try:
            compile_first(self.slam, episode)
            with progress_bar() as progress, deferred_interrupt() as between_steps:
                for _ in progress.track(playback, len(episode.scans), description=self.slam):
                    between_steps()
        except KeyboardInterrupt:
            print(f"{self.file}: interrupted, writing what is done", file=sys.stderr)
            return playback.result(), EXIT_INTERRUPTED
        except InputError as error:
            print(f"{self.file}: {error}; writing what is done before it", file=sys.stderr)
            return playback.result(), EXIT_MISTAKE
        return playback.result(), 0

    def _metrics(self, run: Run) -> dict[str, Any]:
        return {
            "log": self.file.name,
            "slam": self.slam,
            "seed": self.seed,
            "scans": len(run.poses),
            "matched": run.matched,
            "seconds": run.seconds,
            "ms_per_matched_scan": run.ms_per_matched_scan,
            "peak_memory_mb": peak_mb(),
            "versions": versions(),
        }

    def _tell(self, metrics: dict[str, Any], out: Path) -> None:
        print(
            f"{metrics['scans']} scans, {metrics['matched']} matched, in "
            f"{metrics['seconds']:.1f} s: {metrics['ms_per_matched_scan']:.2f} ms a matched scan, "
            f"{metrics['peak_memory_mb']:.0f} MB at most"
        )
        if metrics.get("left_out"):
            print(
                f"{self.relations}: warning: {metrics['left_out']} relations left out, their "
                f"stamps lie outside what was mapped of {self.file}",
                file=sys.stderr,
            )
        if metrics.get("relations"):
            print(
                f"error on {metrics['relations']} relations: "
                f"{metrics['translation_mean']:.4f} +- {metrics['translation_std']:.4f} m, "
                f"{metrics['rotation_mean_deg']:.2f} +- {metrics['rotation_std_deg']:.2f} deg"
            )
        if metrics.get("translation_mean_online") is not None:
            print(
                f"as believed on the way: {metrics['translation_mean_online']:.4f} m, "
                f"{metrics['rotation_mean_deg_online']:.2f} deg"
            )
        print(
            f"written to {out}: trajectory.tum, map.pgm, map.yaml, map.png, cost.png, metrics.json"
        )
        if self.json:
            print(json.dumps(metrics))


def _until(done: Trajectory, episode: Episode) -> Trajectory:
    """The odometry up to the last pose of a run that may have been interrupted."""
    if len(done) == len(episode.scans):
        return episode.odometry
    known = episode.odometry.times <= done.times[-1]
    return Trajectory(episode.odometry.times[known], episode.odometry.poses[known])
