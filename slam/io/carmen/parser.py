"""Parse a CARMEN log line by line: keep the valid messages, count the others in `warnings`."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.io.carmen.messages import (
    Garbled,
    LaserMessage,
    Odom,
    parse_flaser,
    parse_odom,
    parse_param,
    parse_robotlaser,
)
from slam.io.carmen.outliers import outliers
from slam.io.guard import RECORD_BYTES, SCAN_BYTES, take
from slam.io.warnings import WarningCounter

COPIES = 3  # of the ranges: as they are read, in the scan, and what is computed from them
LASERS = {b"FLASER": parse_flaser, b"ROBOTLASER1": parse_robotlaser}
# Other messages of CARMEN, and comments: left out without a warning.
IGNORED = (b"#", b"SYNC", b"TRUEPOS", b"RLASER", b"LASER", b"RAWLASER", b"ROBOTLASER")


class CarmenParser:
    """Collects the `messages` of lines, their line `numbers`, `params` and `warnings`.

    reason  what was expected on the first line left out
    """

    def __init__(self) -> None:
        self.messages: list[Odom | LaserMessage] = []
        self.numbers: list[int] = []
        self.params: dict[bytes, float] = {}
        self.warnings = WarningCounter()
        self.reason = ""
        self._laser = b""
        self._beams = 0

    def take(self, number: int, line: bytes) -> None:
        """Parse one line."""
        words = line.split()
        if not words:
            return
        name = words[0]
        try:
            if name == b"ODOM":
                self._keep(number, parse_odom(words))
            elif name in LASERS:
                self._take_laser(number, words)
            elif name == b"PARAM":
                self.params |= parse_param(words)
            elif not name.startswith(IGNORED):
                self.warnings.add("unknown message left out", number)
        except Garbled as reason:
            self.reason = self.reason or f"{number}: {reason}"
            self.warnings.add("garbled line left out", number)

    def leave_out_outliers(self) -> None:
        """Call after the last line: whether a pose is an outlier shows in the message after it."""
        if not self.messages:
            return
        found = outliers(np.array([message.pose for message in self.messages])).tolist()
        kept = []
        for number, message, outlier in zip(self.numbers, self.messages, found, strict=True):
            if outlier:
                self.reason = (
                    self.reason or f"{number}: a pose within reach of the one before was expected"
                )
                self.warnings.add("pose leaps away and back, line left out", number)
            else:
                kept.append((number, message))
        self.numbers = [number for number, _ in kept]
        self.messages = [message for _, message in kept]

    @property
    def lasers(self) -> list[LaserMessage]:
        """The sweeps among the messages."""
        return [message for message in self.messages if isinstance(message, LaserMessage)]

    def param(self, name: bytes) -> float:
        """The log's own setting, 0 if it has none."""
        return self.params.get(name, 0.0)

    @property
    def mount(self) -> Pose2:
        """The front laser on the robot, by the log's parameters; m, rad."""
        return Pose2(
            self.param(b"robot_frontlaser_offset"),
            self.param(b"robot_frontlaser_side_offset"),
            self.param(b"robot_frontlaser_angular_offset"),
        )

    def _keep(self, number: int, message: Odom | LaserMessage) -> None:
        ranges = message.ranges.nbytes if isinstance(message, LaserMessage) else 0
        take(COPIES * ranges + RECORD_BYTES + SCAN_BYTES * bool(ranges))
        self.messages.append(message)
        self.numbers.append(number)

    def _take_laser(self, number: int, words: list[bytes]) -> None:
        if self._laser not in (b"", words[0]):
            self.warnings.add("line of a second laser left out", number)
            return
        message = LASERS[words[0]](words)
        self._laser = words[0]
        if self._beams not in (0, len(message.ranges)):
            self.warnings.add("number of beams changed", number)
        self._beams = len(message.ranges)
        if not np.all(message.ranges >= 0):
            self.warnings.add("negative or NaN range taken for no reading", number)
        self._keep(number, message)
