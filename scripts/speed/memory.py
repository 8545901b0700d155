"""Memory of the map of each SLAM over time in one place: constant or growing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

import slam
from slam.benchmark.results import Result
from slam.benchmark.run import Playback, true_start
from slam.episode import Episode, Truth
from slam.interface import MapModel, Slam
from slam.maps.tiles import AREA
from slam.trajectory import Trajectory

from ..console.progress import ProgressTracker

LAPS = 4


class MapMemory(NamedTuple):
    """Memory of a map, with the layers of its sensor model.

    nbytes    bytes of the tiles in use and of other data of the map model
    observed  number of observed cells
    cells     number of cells of the tiles in use
    """

    nbytes: int
    observed: int
    cells: int


def map_of(robot: Slam) -> MapModel | None:
    """The map model of a SLAM; None if it has none with cells."""
    map_model = getattr(robot, "map_model", None)
    return map_model if hasattr(map_model, "cells") else None


def map_memory(map_model: MapModel) -> MapMemory:
    """Memory of `map_model` now."""
    tiles = map_model.cells.tiles
    in_use = tiles.references > 0
    observed = int(map_model.cells.observed.values[in_use].sum())
    cells = (int(in_use.sum()) - 1) * AREA
    return MapMemory(getattr(map_model, "nbytes", tiles.nbytes), observed, cells)


def memory_rows(variants: Sequence[str], episode: Episode, track: ProgressTracker) -> list[Result]:
    """One row per variant that has a map: its bytes after each of LAPS drives, to and fro."""
    long, ends = to_and_fro(episode, LAPS), len(episode.scans) - 1
    rows = []
    for variant in track(variants, "memory"):
        robot = slam.make(variant, true_start(episode))
        map_model = map_of(robot)
        if map_model is None:
            continue
        series = [
            map_memory(map_model).nbytes
            for number, _ in enumerate(Playback(robot, long))
            if number and number % ends == 0
        ]
        rows.append({"what": variant, "seconds": long.scans[-1].time, "bytes": series})
    return rows


def memory_table(rows: list[Result]) -> Table:
    """For a terminal."""
    minutes = rows[0]["seconds"] / 60 if rows else 0.0
    title = f"kB of the map after each quarter of {minutes:.0f} minutes in one corridor"
    table = Table(box=HORIZONTALS, title=title)
    table.add_column("what", no_wrap=True)
    for lap in range(1, LAPS + 1):
        table.add_column(f"{lap}/{LAPS}", justify="right")
    table.add_column("4/4 over 1/4", justify="right")
    for row in rows:
        shown = [f"{nbytes / 1e3:,.0f}" for nbytes in row["bytes"]]
        table.add_row(row["what"], *shown, f"{row['bytes'][-1] / row['bytes'][0]:.2f}")
    return table


def to_and_fro(episode: Episode, laps: int) -> Episode:
    """The episode forwards, backwards, forwards, ...: one continuous drive, `laps` times as long.

    The doors move accordingly; driving backwards, the robot sees the same scans.
    """
    n = len(episode.scans)
    forth, back = np.arange(n), np.arange(n)[::-1]
    order = np.concatenate([forth[:1], *((back if lap % 2 else forth)[1:] for lap in range(laps))])
    steps = np.abs(np.diff(episode.times[order]))
    times = episode.times[0] + np.concatenate([[0.0], np.cumsum(steps)])
    scans = (
        replace(episode.scans[k], time=time)
        for k, time in zip(order.tolist(), times.tolist(), strict=True)
    )
    odometry = Trajectory(times, episode.odometry.at(episode.times)[order])
    truth = episode.truth
    if truth is not None:
        truth = Truth(truth.poses[order], truth.walls, truth.doors[order])
    return Episode(tuple(scans), odometry, truth, episode.meta)
