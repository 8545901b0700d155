"""The lasers of a run, told apart by where they are mounted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.episode import Episode
from slam.geometry import Pose2
from slam.sessions.session import Session

MOST = 8  # lasers of a robot; more mounts are one laser that moves on it


class Lasers(NamedTuple):
    """The mounts of a robot's lasers; one mount, or none, for a single laser."""

    mounts: tuple[Pose2, ...]

    @staticmethod
    def of_episode(episode: Episode) -> Lasers:
        """The lasers of an episode."""
        mounts = tuple(dict.fromkeys(scan.mount for scan in episode.scans))
        return Lasers(mounts if len(mounts) <= MOST else ())

    def of(self, session: Session) -> list[Session]:
        """What each laser saw, of a session; scans of other mounts, as of a robot before, are taken
        to be of the first laser."""
        if len(self.mounts) < 2:
            return [session]
        number = {mount: k for k, mount in enumerate(self.mounts)}
        laser = np.array([number.get(scan.mount, 0) for scan in session.scans])
        chosen = [laser == k for k in range(len(self.mounts))]
        return [session.kept(which) for which in chosen if which.any()]
