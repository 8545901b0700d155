"""A SLAM on its way through a recording: with a bar, in a window, with stages to look back at."""

from __future__ import annotations

from typing import Protocol

from slam.benchmark.run import Playback, Run
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode
from slam.interface import Estimate, Slam
from slam.scan import Scan
from slam.snapshot import MapSnapshot

from ..console.interrupts import deferred_interrupt
from ..console.progress import progress_bar

STAGES = 150


class Window(Protocol):
    """What shows a run while it goes on."""

    def show(self, k: int, n: int, estimate: Estimate, scan: Scan, slam: Slam) -> None:
        """Scan number `k` of `n`, from 1, was taken in."""
        ...


class MappingRun:
    """One run, kept as far as it went.

    window     shows it, if there is one
    stages     how many are kept of the way; each takes time to draw
    estimates  of the scans that were taken in
    """

    def __init__(
        self,
        slam: Slam,
        episode: Episode,
        name: str,
        window: Window | None = None,
        stages: int = STAGES,
    ):
        self.slam = slam
        self.episode = episode
        self.name = name
        self.estimates: list[Estimate] = []
        self._window = window
        self._playback = Playback(slam, episode)
        self._growth = SnapshotRecorder(self._playback, stages)
        self._result: Run | None = None

    def run(self) -> None:
        """All scans; whatever ends it early leaves what was done."""
        scans = self.episode.scans
        with progress_bar() as progress, deferred_interrupt() as between_steps:
            steps = progress.track(self._playback, len(scans), description=self.name)
            for k, estimate in enumerate(steps, 1):
                self.estimates.append(estimate)
                self._growth.after(k - 1)
                if self._window is not None:
                    self._window.show(k, len(scans), estimate, scans[k - 1], self.slam)
                between_steps()

    @property
    def result(self) -> Run:
        """What came out of it, as far as it went."""
        if self._result is None:
            self._result = self._playback.result()
        return self._result

    def stages(self) -> list[MapSnapshot]:
        """The map and the trajectory as believed every so many scans, and at the end."""
        return self._growth.stages()
