"""`dynslam info FILE`: what is in a recording."""

from __future__ import annotations

from dataclasses import dataclass

from .source import RecordingSource


@dataclass(kw_only=True)
class InfoCommand(RecordingSource):
    """Tell what is in a recording: topics, lasers, odometry, how long and how far, what is wrong.

    Of a bag with several lasers, each is described, or those chosen by --laser.
    """

    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> int:
        """Read and print."""
        from .description import describe

        return describe(self)
