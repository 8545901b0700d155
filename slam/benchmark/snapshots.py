"""Map snapshots at regular intervals of a run, for animations."""

from __future__ import annotations

from slam.benchmark.run import Playback
from slam.maps.snapshot import MapSnapshot


class SnapshotRecorder:
    """Records about `stages` snapshots of a whole run, one every few scans.

    every  number of scans between snapshots
    """

    def __init__(self, playback: Playback, stages: int = 150):
        self.every = max(1, round(len(playback.episode.scans) / stages))
        self._playback = playback
        self._kept: list[MapSnapshot] = []

    def after(self, number: int) -> None:
        """Call after scan `number`, counted from 0."""
        if number % self.every == 0:
            self._keep()

    def stages(self) -> list[MapSnapshot]:
        """The snapshots so far, and one of the present as the last; empty before the first scan."""
        if self._playback.done:
            if self._kept and self._kept[-1].scan == self._playback.done - 1:
                self._kept.pop()  # `finish` may have revised it
            self._keep()
        return list(self._kept)

    def _keep(self) -> None:
        run = self._playback.result()
        self._kept.append(MapSnapshot.of(run.poses, run.grid))
