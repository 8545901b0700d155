"""Signs that a robot was carried from one scan to the next."""

from __future__ import annotations

from enum import Enum

from slam.recovery.agreement import Agreement
from slam.recovery.surprise import Surprise

JUMP = 0.12  # change of a scan
TURNED = 0.12  # share of the echoes that the map explained in one scan, and contradicts in the next
FADED = 0.18  # share of the echoes that the map explained in one scan, and does not in the next
USUAL_FACTOR = 4.0  # times the usual change of a scan, or of the share explained, are surprising


class Sign(Enum):
    """How it shows: in the scans themselves, or, where these are continuous, in the map."""

    SCAN = "the scan changed at once, or the odometry failed"
    TURN = "the map explained one scan, and contradicts the next"
    FADE = "the map explained one scan, and far less of the next"


class Signs:
    """Finds the signs of each keyframe.

    Each sign is surprising above a threshold, above a multiple of what is usual in this recording,
    and above what was dismissed.
    """

    def __init__(self) -> None:
        self._surprises = {
            Sign.SCAN: Surprise(JUMP),
            Sign.TURN: Surprise(TURNED),
            Sign.FADE: Surprise(FADED),
        }
        self._before: Agreement | None = None  # of the last keyframe
        self._less = 0.0  # share that the map explains less of the last keyframe than of that one
        self._change = self._step = 0.0  # usual change of a scan, and of the share explained

    def seen(
        self, agreement: Agreement, change: float, continuous: bool, arriving: bool
    ) -> Sign | None:
        """The first sign of a keyframe that counts (arguments: see `LostBelief.update`). The map
        gives none of a scan that sees something else than the one before, and it explains less of
        each scan where the robot comes from new ground."""
        before, self._before = self._before or agreement, agreement
        self._less = before.explained - agreement.explained
        turn = min(self._less, agreement.contradicted - before.contradicted)
        values = {
            Sign.SCAN: (change, USUAL_FACTOR * self._change),
            Sign.TURN: (turn, 0.0),
            Sign.FADE: (self._less, USUAL_FACTOR * self._step),
        }
        counts = {
            Sign.SCAN: True,
            Sign.TURN: continuous,
            Sign.FADE: continuous and not arriving,
        }
        seen = [sign for sign, value in values.items() if self._surprises[sign].surprising(*value)]
        return next((sign for sign in seen if counts[sign]), None)

    def learn(self, change: float, rate: float) -> None:
        """Learn what is usual from the last keyframe, at a pose that is not doubted."""
        self._change += rate * (change - self._change)
        self._step += rate * (abs(self._less) - self._step)

    def dismiss(self, sign: Sign) -> None:
        """The last sign of this kind meant nothing."""
        self._surprises[sign].dismiss()
