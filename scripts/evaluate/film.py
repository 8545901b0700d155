"""A film of a patrol: MP4 with `dynslam[video]`, else an animated GIF."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image

from slam.errors import InputError

SPEED = 5.0  # times as fast as it was


def suffix() -> str:
    """Of the films that can be written here."""
    return ".mp4" if find_spec("imageio") and find_spec("imageio_ffmpeg") else ".gif"


def film(frames: Sequence[np.ndarray], path: Path, rate: float) -> None:
    """Write frames (rows, cols, 3), `rate` of which were a second, as `path` (.mp4 or .gif)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".gif":
        images = [Image.fromarray(frame) for frame in frames]
        images[0].save(
            path, save_all=True, append_images=images[1:], duration=1e3 / (SPEED * rate), loop=0
        )
        return
    try:
        import imageio.v2 as imageio
    except ImportError:
        raise InputError("films need imageio: install dynslam[video]") from None
    even = [frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2] for frame in frames]
    imageio.mimwrite(path, even, fps=SPEED * rate, macro_block_size=1)  # type: ignore[arg-type]
