"""Whether a run was sure where the robot was, from `Estimate.lost` and `Estimate.drift`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slam.geometry import Array
from slam.metrics.lost import ALARM_LEVEL

from ..console.exits import EXIT_UNSURE

MAX_LOST_SHARE = 0.2  # of the scans; a run that was lost for more is not sure
MOST_DRIFTS = 3  # that a warning lists


@dataclass(frozen=True)
class Certainty:
    """How sure a run was.

    times  (n,) s, of its scans
    lost   (n,) probabilities of being lost
    drift  (n,) m, by which a drift was taken out of the poses
    """

    times: Array
    lost: Array
    drift: Array

    @property
    def at_end(self) -> float:
        """The probability of being lost at the last scan."""
        return float(self.lost[-1]) if len(self.lost) else 0.0

    @property
    def share(self) -> float:
        """Share of the scans at which the robot was lost."""
        return float((self.lost > ALARM_LEVEL).mean()) if len(self.lost) else 0.0

    @property
    def sure(self) -> bool:
        """Whether the robot was not lost at the end, nor for long."""
        return self.at_end <= ALARM_LEVEL and self.share <= MAX_LOST_SHARE

    @property
    def status(self) -> int:
        """The exit status of a run that met no other trouble."""
        return 0 if self.sure else EXIT_UNSURE

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to tell of a run in which the robot was lost, or had drifted."""
        return (*self._of_drifts(), *self._of_losses())

    def _of_losses(self) -> tuple[str, ...]:
        if not self.share and self.sure:
            return ()
        if self.sure:
            return (f"the robot was lost at {_percent(self.share)} of the scans, and found again",)
        where = (
            "at the end" if self.at_end > ALARM_LEVEL else f"at {_percent(self.share)} of the scans"
        )
        return (f"the robot was lost {where}: the poses there are not to be trusted",)

    def _of_drifts(self) -> tuple[str, ...]:
        drifts = self._drifts()
        if not drifts:
            return ()
        first, others = drifts[:MOST_DRIFTS], len(drifts) - MOST_DRIFTS
        told = ", ".join(f"{one['distance']:.2f} m at {one['time']:.2f} s" for one in first)
        more = "once" if others == 1 else f"{others} times"
        told += f", and {more} more" if others > 0 else ""
        return (
            f"the map had drifted before the robot came back to old ground, and its pose was moved "
            f"by {told}: what it drew shortly before is off by as much",
        )

    def _drifts(self) -> list[dict[str, float]]:
        """Time, s, and distance, m, of each."""
        found = np.flatnonzero(self.drift)
        return [{"time": float(self.times[k]), "distance": float(self.drift[k])} for k in found]

    def as_dict(self) -> dict[str, Any]:
        """For a summary."""
        return {"lost_at_end": self.at_end, "lost_share": self.share, "drifts": self._drifts()}


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
