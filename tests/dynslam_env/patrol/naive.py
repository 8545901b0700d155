"""The dynamic map, slow and obvious: a dict of cells."""

import math
from dataclasses import dataclass, field

import numpy as np

from dynslam_env.patrol.memory import (
    CELL_SIZE,
    EVIDENCE,
    FRESHNESS_SCALE,
    FULL_WEIGHT_TIME,
    PASS_DISTANCE,
    PASS_OFFSET,
    PRIOR_CHANGES,
    PRIOR_DWELL,
    STATIC_WEIGHT,
)
from slam.maps.cells import Cells
from slam.maps.rays import Rays
from slam.maps.tiles import AREA, TILE

FREE, OCCUPIED = 0, 1


@dataclass
class Cell:
    h: float = 0.5
    state: int | None = None
    times: list[float] = field(default_factory=lambda: [0.0, 0.0])
    counts: list[int] = field(default_factory=lambda: [0, 0])
    last: float = 0.0
    echoes: list[tuple[float, float]] = field(default_factory=list)
    known: bool = False

    @property
    def closing(self) -> float:
        return (PRIOR_CHANGES + self.counts[OCCUPIED]) / (PRIOR_DWELL / 2 + self.times[FREE])

    @property
    def opening(self) -> float:
        return (PRIOR_CHANGES + self.counts[FREE]) / (PRIOR_DWELL / 2 + self.times[OCCUPIED])

    def predicted(self, now: float) -> float:
        rate = self.closing + self.opening
        share = self.closing / rate
        return share + math.exp(-rate * (now - self.last)) * (self.h - share)

    def bits(self, now: float) -> float:
        h = self.predicted(now)
        return -sum(p * math.log2(p) for p in (h, 1 - h) if p > 0)

    def observe(self, hit: bool, now: float) -> None:
        gone, rate = now - self.last, self.closing + self.opening
        odds = math.exp(EVIDENCE.hit if hit else EVIDENCE.free)
        h = self.predicted(now)
        self.h, self.last = single(odds * h / (odds * h + 1 - h)), single(now)
        was = self.state if gone * rate < 1 else None
        self.state = OCCUPIED if self.h > 0.8 else FREE if self.h < 0.2 else was
        if was is not None:
            self.times[was] = single(self.times[was] + gone)
            if self.state is not None and self.state != was:
                self.counts[self.state] += 1


class NaiveMemory:
    def __init__(self):
        self.cells: dict[tuple[int, int], Cell] = {}
        self._rays = Cells(CELL_SIZE, 0.5, Rays())  # which cells beams cross has tests of its own

    def look(self, scan, pose) -> float:
        seen, tiles = self._rays.trace(scan, pose), self._rays.tiles
        for x, y in seen.echoes:
            self._at(math.floor(y / CELL_SIZE), math.floor(x / CELL_SIZE)).echoes.append((x, y))
        told = []
        for id_, hit in zip(seen.cells.tolist(), seen.hit.tolist(), strict=True):
            row, col = tiles.places[id_ // AREA] * TILE + divmod(id_ % AREA, TILE)
            cell = self._at(int(row), int(col))
            if hit or not cell.echoes or went_through(cell.echoes, scan, pose @ scan.mount):
                told.append((cell, hit))
        for cell, hit in told:
            if hit and not cell.known:
                cell.known, cell.h, cell.state, cell.times[FREE] = True, 0.5, None, 0.0
        before = sum(cell.bits(scan.time) for cell, _ in told)
        for cell, hit in told:
            cell.observe(hit, scan.time)
        return before - sum(cell.bits(scan.time) for cell, _ in told)

    def freshness(self, now: float) -> float:
        total = 0.0
        for cell in self.cells.values():
            if cell.known:
                weight = STATIC_WEIGHT + (
                    min(*cell.times, FULL_WEIGHT_TIME) / FULL_WEIGHT_TIME
                    if any(cell.counts)
                    else 0.0
                )
                total += weight * math.exp((cell.last - now) / FRESHNESS_SCALE)
        return total

    def _at(self, row: int, col: int) -> Cell:
        return self.cells.setdefault((row, col), Cell())


def single(value: float) -> float:
    """As it is kept: near 0 and 1 it matters."""
    return float(np.float32(value))


def went_through(echoes, scan, sensor) -> bool:
    """Whether the beam next to the mean of the echoes passed it closely, and went on."""
    x, y = np.mean(echoes, axis=0) - (sensor.x, sensor.y)
    off = [math.remainder(math.atan2(y, x) - sensor.theta - a, math.tau) for a in scan.angles]
    beam = int(np.argmin(np.abs(off)))
    away = math.hypot(x, y)
    if beam == 0 and off[0] < 0:
        return False  # a place right of all beams is left alone
    return away * abs(off[beam]) <= PASS_OFFSET and scan.ranges[beam] >= away + PASS_DISTANCE
