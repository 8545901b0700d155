"""A SLAM run on a recording with a progress bar, an optional window, and snapshots of the map."""

from __future__ import annotations

from typing import Protocol

from slam.benchmark.run import Playback, Run
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode
from slam.interface import Estimate, Slam
from slam.maps.snapshot import MapSnapshot
from slam.scan import Scan

from ..console.interrupts import deferred_interrupt
from ..console.progress import progress_bar


class Window(Protocol):
    """Shows a run in progress."""

    def show(self, k: int, n: int, estimate: Estimate, scan: Scan, slam: Slam) -> None:
        """Show the state after scan number `k` of `n`, counted from 1."""
        ...


class MappingRun:
    """One run, which may end early.

    window     shows the run, if given
    snapshots  largest number of snapshots; each takes time to draw
    estimates  of the scans processed so far
    """

    def __init__(
        self,
        slam: Slam,
        episode: Episode,
        name: str,
        window: Window | None = None,
        snapshots: int = 1,
    ):
        self.slam = slam
        self.episode = episode
        self.name = name
        self.estimates: list[Estimate] = []
        self._window = window
        self._playback = Playback(slam, episode)
        self._recorder = SnapshotRecorder(self._playback, snapshots)
        self._result: Run | None = None

    def run(self) -> None:
        """Process all scans; an exception keeps the estimates made before it."""
        scans = self.episode.scans
        with progress_bar() as progress, deferred_interrupt() as between_steps:
            steps = progress.track(self._playback, len(scans), description=self.name)
            for k, estimate in enumerate(steps, 1):
                self.estimates.append(estimate)
                self._recorder.after(k - 1)
                if self._window is not None:
                    self._window.show(k, len(scans), estimate, scans[k - 1], self.slam)
                between_steps()

    @property
    def result(self) -> Run:
        """The result of the scans processed so far."""
        if self._result is None:
            self._result = self._playback.result()
        return self._result

    def snapshots(self) -> list[MapSnapshot]:
        """Maps and trajectories as estimated at evenly spaced scans, and at the end."""
        return self._recorder.stages()
