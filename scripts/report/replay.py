"""The data of a replay: an episode in moments, as the page's script draws it."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from PIL import Image

from slam.geometry import Array

from ..trials.recorded_run import RecordedRun
from ..trials.results import Condition
from .maps import PALETTE


def replay(condition: Condition, runs: Mapping[str, RecordedRun], seed: int) -> dict[str, Any]:
    """One episode, all variants; JSON.

    Numbers are rounded to centimetres. Images are PNG in data URLs, their first row the highest.
    """
    first = next(iter(runs.values()))
    moments = first.scans
    return {
        "title": f"{condition}, seed {seed}",
        "scans": moments.tolist(),
        "walls": _rounded(first.walls),
        "doors": _rounded(first.doors),
        "truth": _rounded(first.truth),
        "echoes": [[_some(echo) for echo in scan] for scan in np.round(first.echoes, 2).tolist()],
        "variants": [
            {
                "name": name,
                "extent": [round(float(side), 3) for side in run.extent],
                "poses": _rounded(run.online),
                "images": [_png(image) for image in run.shades],
            }
            for name, run in runs.items()
        ],
    }


def _rounded(array: Array) -> list[Any]:
    return np.round(array.astype(np.float64), 2).tolist()


def _some(point: list[float]) -> list[float] | None:
    return point if point[0] == point[0] else None


def _png(shades: np.ndarray) -> str:
    image = Image.fromarray(np.ascontiguousarray(shades[::-1]), mode="P")
    image.putpalette(PALETTE.tobytes())
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()
