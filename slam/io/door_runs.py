"""The history of a door as a table: runs of equal state."""

from __future__ import annotations

import numpy as np

from slam.errors import InputError
from slam.forecast.watched import Runs, checked
from slam.io.files import AnyPath, replacing, text_lines
from slam.io.guard import RECORD_BYTES, guarded, take
from slam.io.one_line import one_line

HEADER = "begin_s,end_s,state"


def read_door_runs(path: AnyPath) -> Runs:
    """Read a CSV file with the header `begin_s,end_s,state`: unix times in s, and 0 or 1.

    Runs are in order of time; between them are gaps where nobody looked. Raises InputError that
    names the file and, for a line that cannot be read, the line.
    """
    with guarded(path):
        return _read(path)


def write_door_runs(runs: Runs, path: AnyPath) -> None:
    """Write what `read_door_runs` reads, with times to the millisecond."""
    rows = zip(*(part.tolist() for part in runs), strict=True)
    lines = [HEADER, *(f"{begin:.3f},{end:.3f},{state}" for begin, end, state in rows)]
    with replacing(path) as file:
        file.write("\n".join(lines).encode() + b"\n")


def _read(path: AnyPath) -> Runs:
    rows: list[tuple[float, float, float]] = []
    headed = False
    for number, text in text_lines(path):
        if not headed:
            headed = _is_header(text, f"{path}:{number}")
            continue
        take(RECORD_BYTES)
        rows.append(_row(text, f"{path}:{number}"))
    if not rows:
        raise InputError(f"{path}: no runs; expected lines `{HEADER}`")
    return checked(*np.array(rows).T, after=-np.inf)


def _is_header(text: str, where: str) -> bool:
    if text.replace(" ", "") != HEADER:
        raise InputError(f"{where}: expected the header `{HEADER}`, got {one_line(text, 60)!r}")
    return True


def _row(text: str, where: str) -> tuple[float, float, float]:
    try:
        begin, end, state = map(float, text.split(","))
    except ValueError:
        raise InputError(
            f"{where}: expected three numbers `{HEADER}`, got {one_line(text, 60)!r}"
        ) from None
    return begin, end, state
