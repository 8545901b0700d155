"""Write map.html: the template, its style and its scripts with the data of a map, in one file."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from slam.benchmark.run import Run
from slam.episode import Episode
from slam.grid import GridSpec
from slam.io.files import AnyPath, replacing
from slam.io.layers import FRAME, doors_collection
from slam.layers import Layers
from slam.layers.classification import KEPT_REASONS
from slam.layers.door_sights import echoes, history
from slam.layers.doors import LEAF_DEPTH, SURE
from slam.layers.filter_masks import CLOSED, keepout_mask

from ..console.html_page import filled_in, json_for_script
from ..figures.map_panel import MapPanel
from .drive import drive
from .images import Picture, belief_picture, layers_picture, map_picture, reasons_picture

HERE = Path(__file__).parent
SCRIPTS = ("data", "pictures", "view", "edits", "drive", "doors", "zones", "reading", "saving",
           "main")  # fmt: skip


def write_page(
    path: AnyPath,
    title: str,
    episode: Episode,
    run: Run,
    layers: Layers | None,
    keep: Collection[int] = KEPT_REASONS,
) -> None:
    """Write the page of a run on `episode`; without layers (None), with the belief alone.

    keep  reasons of the cells that count as standing, as in map.yaml and keepout.yaml
    """
    with replacing(path) as file:
        file.write(page(title, data(episode, run, layers, keep)).encode())


def page(title: str, content: dict[str, Any]) -> str:
    """The page: one file without network requests."""
    return filled_in(
        HERE,
        title=title,
        content=json_for_script(content),
        scripts=[(HERE / f"{name}.js").read_text(encoding="utf-8") for name in SCRIPTS],
    )


def data(
    episode: Episode, run: Run, layers: Layers | None, keep: Collection[int]
) -> dict[str, Any]:
    """What the scripts need."""
    count = len(run.poses)
    doors = {"type": "FeatureCollection", "frame": FRAME, "features": []}
    histories: list[Any] = []
    closed = np.zeros(run.grid.spec.shape, np.bool_)
    if layers is not None:
        doors, seen = doors_collection(layers), echoes(episode.scans[:count], run.poses)
        histories = [[_sight(*one) for one in history(door, seen)] for door in layers.doors]
        closed = keepout_mask(layers, keep) == CLOSED
    grid = run.grid if layers is None else layers.static_map(keep)
    content = {
        "grid": _grid(grid.spec),
        "view": [round(side, 2) for side in MapPanel("", grid, run.poses).box],
        "pictures": [picture.as_dict() for picture in _pictures(run, layers, keep)],
        "drive": drive(episode, run.poses, run.lost),
        "doors": doors,
        "histories": histories,
        "closed": _stretches(closed),
        "leaf_depth": LEAF_DEPTH,
        "sure": SURE,
    }
    return content | {"digest": hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]}


def _pictures(run: Run, layers: Layers | None, keep: Collection[int]) -> Iterator[Picture]:
    """The pictures, the one that is shown at first the first."""
    if layers is not None:
        yield map_picture(layers.static_map(keep))
        yield layers_picture(layers)
        yield reasons_picture(layers)
    yield belief_picture(run.grid)


def _grid(spec: GridSpec) -> dict[str, Any]:
    """The cells of map.pgm, for masks of the same size."""
    left, _, bottom, _ = spec.extent
    return {
        "resolution": spec.resolution, "left": left, "bottom": bottom, "rows": spec.rows,
        "cols": spec.cols,
    }  # fmt: skip


def _stretches(cells: np.ndarray) -> str:
    """Where cells (rows, cols) are true: numbers of the first cell of each stretch and of the one
    after its last, in the order of map.pgm (its first row the highest); uint32 in base64."""
    flat = np.concatenate([[False], cells[::-1].ravel(), [False]])
    return base64.b64encode(np.flatnonzero(flat[1:] != flat[:-1]).astype("<u4").tobytes()).decode()


def _sight(begin: float, end: float, opened: bool) -> list[float]:
    return [round(begin, 1), round(end, 1), int(opened)]
