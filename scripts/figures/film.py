"""Films: an animated GIF, or with `dynslam[video]` an MP4."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from slam.errors import InputError
from slam.io.files import AnyPath, placing, replacing

MAX_COLOURS = 255  # of a GIF; one more place of its palette means "as in the frame before"
MIN_COLOUR_DISTANCE = 8  # levels; Pillow confuses closer colours
MP4_QUALITY = 7.0  # of 10: keeps thin lines and small letters sharp


class Colours(NamedTuple):
    """The palette of a GIF; fewer colours make a smaller file.

    exact  (n, 3) 0 to 255, colours kept exactly
    mixed  number of further colours, chosen from the first, the middle and the last frame
    """

    exact: np.ndarray = np.zeros((0, 3), int)
    mixed: int = MAX_COLOURS


ANY_COLOURS = Colours()


def suffix() -> str:
    """Suffix of the best film that can be written: .mp4 if its encoder is installed, else .gif."""
    return ".mp4" if find_spec("imageio") and find_spec("imageio_ffmpeg") else ".gif"


def write_film(
    frames: Sequence[Image.Image],
    path: AnyPath,
    fps: float,
    hold: float = 0.0,
    colours: Colours = ANY_COLOURS,
) -> None:
    """Write frames of one size as `path` (.gif or .mp4); equal frames give equal bytes of a GIF.

    frames   accessed one by one, a few of them twice; they may be drawn on access
    fps      frames per second
    hold     additional time of the last frame, s
    colours  palette of a GIF

    Raises InputError for another ending, for .mp4 without its encoder, and where `path` cannot be
    written.
    """
    path = Path(path)
    if path.suffix == ".gif":
        _write_gif(frames, path, fps, hold, colours)
    elif path.suffix == ".mp4":
        _write_mp4(frames, path, fps, hold)
    else:
        raise InputError(f"{path}: a film's name must end in .gif or .mp4")


def _write_gif(
    frames: Sequence[Image.Image], path: Path, fps: float, hold: float, colours: Colours
) -> None:
    palette = _palette(frames, colours)
    indexed = _changes(frames, palette)
    durations = [round(1000 / fps)] * len(frames)
    durations[-1] += round(1000 * hold)
    with replacing(path) as file:
        next(indexed).save(
            file,
            format="GIF",
            save_all=True,
            append_images=indexed,
            duration=durations,
            loop=0,
            optimize=False,  # else each frame gets its own palette
            transparency=_unchanged(palette),
            disposal=1,  # a frame is drawn over the one before
        )


def _changes(frames: Sequence[Image.Image], palette: Image.Image) -> Iterator[Image.Image]:
    """Each frame in the colours of `palette`, transparent where it is as the one before: that is
    half of the bytes, or less."""
    before = None
    for frame in frames:
        indexed = frame.quantize(palette=palette, dither=Image.Dither.NONE)
        colours = np.asarray(indexed)
        if before is not None:
            changed = np.where(colours == before, np.uint8(_unchanged(palette)), colours)
            indexed = Image.fromarray(changed)
        indexed.putpalette(palette.getpalette() or [])
        before = colours
        yield indexed


def _unchanged(palette: Image.Image) -> int:
    """The last place of the palette."""
    return len(palette.getpalette() or []) // 3 - 1


def _palette(frames: Sequence[Image.Image], colours: Colours) -> Image.Image:
    """The exact and the mixed colours as a palette, and the first of them again: no pixel becomes
    the second of two equal colours."""
    chosen = [frames[0], frames[len(frames) // 2], frames[-1]]
    sheet = Image.new("RGB", (chosen[0].width, chosen[0].height * len(chosen)))
    for number, frame in enumerate(chosen):
        sheet.paste(frame, (0, number * frame.height))
    found = sheet.quantize(colours.mixed, method=Image.Quantize.MEDIANCUT).getpalette() or []
    mixed = np.array(found[: 3 * colours.mixed]).reshape(-1, 3)
    if len(colours.exact):
        apart = np.abs(mixed[:, None] - colours.exact).max(axis=2).min(axis=1) > MIN_COLOUR_DISTANCE
        mixed = np.concatenate([colours.exact, mixed[apart]])[:MAX_COLOURS]
    palette = Image.new("P", (1, 1))
    palette.putpalette([*mixed.ravel().tolist(), *mixed[0].tolist()])
    return palette


def _write_mp4(frames: Sequence[Image.Image], path: Path, fps: float, hold: float) -> None:
    if suffix() != ".mp4":
        raise InputError(f"{path}: an MP4 needs an encoder: pip install 'dynslam[video]'")
    import imageio.v2 as imageio

    with (
        placing(path) as made,
        imageio.get_writer(
            made, fps=fps, quality=MP4_QUALITY, macro_block_size=1, ffmpeg_log_level="error"
        ) as writer,
    ):
        for frame in _held(frames, round(hold * fps)):
            writer.append_data(_even(frame))  # pyright: ignore[reportAttributeAccessIssue]


def _held(frames: Sequence[Image.Image], longer: int) -> Iterator[Image.Image]:
    yield from frames
    if longer:
        yield from [frames[-1]] * longer


def _even(frame: Image.Image) -> np.ndarray:
    """(rows, cols, 3) with even rows and cols, which the encoder requires."""
    return np.asarray(frame)[: frame.height // 2 * 2, : frame.width // 2 * 2]
