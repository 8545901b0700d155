# pyright: reportMissingImports=false
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.figures import film
from dynslam_cli.figures.film import Colours, write_film
from PIL import Image, ImageSequence

from slam.errors import InputError

RED = (200, 30, 40)


@pytest.fixture
def frames() -> list[Image.Image]:
    """A red square that wanders over shades of grey."""
    made = []
    for k in range(6):
        pixels = np.repeat(np.linspace(0, 255, 61).astype(np.uint8)[None, :, None], 41, axis=0)
        pixels = np.repeat(pixels, 3, axis=2)
        pixels[5 * k : 5 * k + 10, 20:30] = RED
        made.append(Image.fromarray(pixels))
    return made


def test_a_gif_has_all_frames_holds_the_last_and_keeps_exact_colours(
    tmp_path: Path, frames: list[Image.Image]
) -> None:
    path = tmp_path / "a.gif"
    write_film(frames, path, 10.0, hold=2.0, colours=Colours(np.array([RED]), 8))
    with Image.open(path) as image:
        shown = [frame.convert("RGB") for frame in ImageSequence.Iterator(image)]
        lasts = [frame.info["duration"] for frame in ImageSequence.Iterator(image)]
    assert len(shown) == 6
    assert lasts == [100] * 5 + [2100]
    for k, picture in enumerate(shown):
        assert picture.getpixel((25, 5 * k + 5)) == RED


def test_what_does_not_change_is_stored_once(tmp_path: Path) -> None:
    """Every frame was stored whole: the films of the worlds were a third larger."""
    noise = np.random.default_rng(0).integers(0, 256, (60, 80, 1), np.uint8).repeat(3, axis=2)
    made = []
    for k in range(20):
        pixels = noise.copy()
        pixels[:4, k], pixels[-4:, -1 - k] = RED, RED  # in two corners
        made.append(Image.fromarray(pixels))
    write_film(made[:1], tmp_path / "one.gif", 10.0)
    write_film(made, tmp_path / "all.gif", 10.0)
    sizes = [(tmp_path / name).stat().st_size for name in ("one.gif", "all.gif")]
    assert sizes[1] < 4 * sizes[0]  # with the palette of each
    with Image.open(tmp_path / "all.gif") as image:
        for k, frame in enumerate(ImageSequence.Iterator(image)):
            shown = np.asarray(frame.convert("RGB")).astype(int)
            assert np.abs(shown - np.asarray(made[k])).max() < 12, k


def test_the_same_frames_are_the_same_bytes(tmp_path: Path, frames: list[Image.Image]) -> None:
    for name in ("a.gif", "b.gif"):
        write_film(frames, tmp_path / name, 10.0)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_an_mp4_has_all_frames_and_holds_the_last(
    tmp_path: Path, frames: list[Image.Image]
) -> None:
    imageio = pytest.importorskip("imageio.v2")
    pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "a.mp4"
    write_film(frames, path, 10.0, hold=0.5)
    with imageio.get_reader(path) as reader:
        shown = [np.asarray(frame) for frame in reader]
    assert len(shown) == 6 + 5
    assert shown[0].shape == (40, 60, 3)  # even
    assert np.abs(shown[2][15, 25].astype(int) - RED).max() < 40
    assert np.abs(shown[-1].astype(int) - shown[5]).max() < 20


def test_without_the_encoder_films_are_gifs_and_an_mp4_says_what_is_missing(
    tmp_path: Path, frames: list[Image.Image], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "find_spec", lambda name: None)
    assert film.suffix() == ".gif"
    with pytest.raises(InputError, match=r"dynslam\[video\]"):
        write_film(frames, tmp_path / "a.mp4", 10.0)
    assert not (tmp_path / "a.mp4").exists()


def test_another_ending_is_refused(tmp_path: Path, frames: list[Image.Image]) -> None:
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        write_film(frames, tmp_path / "a.avi", 10.0)
