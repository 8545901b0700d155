"""A reference trajectory named on the command line."""

from __future__ import annotations

from pathlib import Path

from slam.errors import InputError
from slam.io.formats import kind_of
from slam.io.tum import read_tum
from slam.trajectory import Trajectory


def reference(named: str, recording: Path) -> Trajectory:
    """A file in the TUM format, or else a topic of the recording. Raises InputError."""
    if Path(named).is_file():
        return read_tum(named)
    if kind_of(recording) != "bag":
        raise InputError(f"{named}: no such file, and {recording} has no topics")
    from slam.io.bags import read_reference

    return read_reference(recording, named)
