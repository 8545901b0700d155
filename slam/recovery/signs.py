"""Signs that a scan is not continuous with the one before: the robot may be elsewhere."""

from __future__ import annotations

from enum import Enum

from slam.recovery.agreement import Agreement
from slam.recovery.surprise import Surprise

JUMP = 0.12  # change of a scan
TURNED = 0.12  # share of the echoes that the map explained in one scan, and contradicts in the next
FADED = 0.18  # share of the echoes that the map explained in one scan, and does not in the next
USUAL_FACTOR = 4.0  # a change of a scan, or of what is explained, that is so much the usual one


class Sign(Enum):
    """What tells it."""

    SCAN = "the scan changed at once, or the odometry failed"
    TURN = "the map explained one scan, and contradicts the next"
    FADE = "the map explained one scan, and far less of the next: it was carried to a frontier"


class Signs:
    """Tells whether a scan is continuous with the one before, by itself and by the map.

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
        self._change = self._usual_less = 0.0  # usual change of a scan, and of what is explained

    def seen(self, agreement: Agreement, change: float) -> list[Sign]:
        """The signs of a keyframe, the strongest first."""
        before, self._before = self._before or agreement, agreement
        self._less = before.explained - agreement.explained
        turn = min(self._less, agreement.contradicted - before.contradicted)
        values = {
            Sign.SCAN: (change, USUAL_FACTOR * self._change),
            Sign.TURN: (turn, 0.0),
            Sign.FADE: (self._less, USUAL_FACTOR * self._usual_less),
        }
        return [sign for sign, value in values.items() if self._surprises[sign].surprising(*value)]

    def learn(self, change: float, rate: float) -> None:
        """Learn what is usual from a keyframe at a pose that is not doubted."""
        self._change += rate * (change - self._change)
        self._usual_less += rate * (abs(self._less) - self._usual_less)

    def dismiss(self, sign: Sign) -> None:
        """The last value of a sign meant nothing."""
        self._surprises[sign].dismiss()
