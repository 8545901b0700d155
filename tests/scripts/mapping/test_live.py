# pyright: reportMissingImports=false
from collections.abc import Iterator

import numpy as np
import pytest
from dynslam_cli.mapping.live import (
    LOST,
    MAX_HOLD,
    MIN_FRAME_TIME,
    MIN_MAP_TIME,
    STATUS_HEIGHT,
    Live,
    _span,
)

import slam
from dynslam_env.drawing import captions
from dynslam_env.drawing.colours import BLUE, FAINT, GREEN, VERMILION
from dynslam_env.drawing.render import pixels
from slam.benchmark.run import Playback
from slam.episode import Episode
from slam.errors import InputError
from slam.grid import OccupancyGrid
from slam.interface import Slam
from slam.layers.doors import MappedDoor

VARIANT = "dynamic-ml"


class Clock:
    """Moves when it is told to."""

    now = 100.0

    def __call__(self) -> float:
        return self.now

    def pass_by(self, seconds: float) -> None:
        self.now += seconds


class Counted:
    """A SLAM that counts how often its map is asked for."""

    def __init__(self, inner: Slam):
        self.inner, self.pose, self.maps = inner, inner.pose, 0

    def update(self, displacement, scan):
        return self.inner.update(displacement, scan)

    def map(self) -> OccupancyGrid:
        self.maps += 1
        return self.inner.map()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def live(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> Iterator[Live]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Live("a drive", clock, clock.pass_by)
    yield window
    window.close()


def shown(live: Live) -> np.ndarray:
    return pixels(live._screen)


def count(picture: np.ndarray, colour: tuple[int, int, int]) -> int:
    return int((picture[:-40] == colour).all(axis=2).sum())


def test_map_robot_echoes_and_how_sure_it_is_are_seen(
    live: Live, clock: Clock, short_episode: Episode
) -> None:
    playback, n = Playback(slam.make(VARIANT), short_episode), len(short_episode.scans)
    for k, estimate in enumerate(playback, 1):
        clock.now += 0.1
        live.show(k, n, estimate, short_episode.scans[k - 1], playback.slam)
    picture = shown(live)
    assert count(picture, VERMILION) > 200
    assert count(picture, GREEN) > 100
    assert count(picture, BLUE) > 10
    assert count(picture, (0, 0, 0)) > 100  # walls
    assert count(picture, (255, 255, 255)) > 10_000


def test_pictures_and_maps_come_no_more_often_than_they_should(
    live: Live, clock: Clock, short_episode: Episode, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pygame

    drawn = []
    monkeypatch.setattr(pygame.display, "flip", lambda: drawn.append(clock.now))
    robot = Counted(slam.make(VARIANT))
    for k, estimate in enumerate(Playback(robot, short_episode), 1):
        clock.now += 0.01
        live.show(k, 1000, estimate, short_episode.scans[k - 1], robot)
    gone = 0.01 * len(short_episode.scans)
    assert len(drawn) == pytest.approx(gone / MIN_FRAME_TIME, abs=2)
    assert robot.maps == pytest.approx(gone / MIN_MAP_TIME, abs=1.1)


def test_a_map_that_takes_long_is_drawn_rarely(
    live: Live, clock: Clock, short_episode: Episode
) -> None:
    class Slow(Counted):
        def map(self) -> OccupancyGrid:
            clock.now += 1.0
            return super().map()

    robot, began = Slow(slam.make(VARIANT)), clock.now
    for k, estimate in enumerate(Playback(robot, short_episode), 1):
        clock.now += 1.0
        live.show(k, 1000, estimate, short_episode.scans[k - 1], robot)
    assert robot.maps / (clock.now - began) < 0.1


def test_closing_the_window_leaves_the_run_going(
    live: Live, clock: Clock, short_episode: Episode
) -> None:
    import pygame

    playback = Playback(slam.make(VARIANT), short_episode)
    for k, estimate in enumerate(playback, 1):
        clock.now += 0.1
        if k == 10:
            pygame.event.post(pygame.event.Event(pygame.QUIT))
        live.show(k, 80, estimate, short_episode.scans[k - 1], playback.slam)
        assert live.closed == (k >= 10)
    assert not pygame.display.get_init()
    assert playback.done == len(short_episode.scans)


def test_a_revised_past_is_drawn_as_it_is_believed_now(
    live: Live, clock: Clock, short_episode: Episode
) -> None:
    class Revising(Counted):
        def trajectory(self) -> np.ndarray:
            return np.full((self.maps + 1, 3), 0.5)

        def finish(self) -> None: ...

    robot = Revising(slam.make(VARIANT))
    estimate = next(iter(Playback(robot, short_episode)))
    live.show(1, 80, estimate, short_episode.scans[0], robot)
    assert [tuple(pose) for pose in live._poses] == [(0.5, 0.5, 0.5)]


@pytest.mark.parametrize(
    ("lost", "robot", "words"),
    [(0.0, VERMILION, None), (0.5, VERMILION, FAINT), (0.97, LOST, LOST)],
)
def test_a_lost_robot_is_seen_at_once(
    live: Live, clock: Clock, short_episode: Episode, lost: float, robot, words
) -> None:
    playback, n = Playback(slam.make("odometry"), short_episode), len(short_episode.scans)
    for k, estimate in enumerate(playback, 1):
        clock.now += 0.1
        live.show(k, n, estimate._replace(lost=lost), short_episode.scans[k - 1], playback.slam)
    picture = shown(live)
    other = VERMILION if robot == LOST else LOST
    assert count(picture, robot) > 200
    assert count(picture, other) < 20
    for colour in (LOST, FAINT):  # in the line below
        written = (picture[-STATUS_HEIGHT:] == colour).all(axis=2).sum()
        assert (written > 20) == (colour == words)


def test_the_path_stays_marked_where_the_robot_was_lost(
    live: Live, clock: Clock, short_episode: Episode
) -> None:
    playback, n = Playback(slam.make("odometry"), short_episode), len(short_episode.scans)
    for k, estimate in enumerate(playback, 1):
        clock.now += 0.1
        told = estimate._replace(lost=0.9 * (20 <= k < 40))
        live.show(k, n, told, short_episode.scans[k - 1], playback.slam)
    assert count(shown(live), LOST) > 50
    assert count(shown(live), VERMILION) > 200


DOOR = MappedDoor(np.array([[1.0, 0.5], [1.0, -0.5]]), 0.5, 2, 9.0, 0.0, 9.0, 9, 9, 0.95)


def ran(live: Live, clock: Clock, episode: Episode) -> None:
    playback, n = Playback(slam.make(VARIANT), episode), len(episode.scans)
    for k, estimate in enumerate(playback, 1):
        clock.now += 0.1
        live.show(k, n, estimate, episode.scans[k - 1], playback.slam)


def test_it_ends_with_what_was_found_until_a_minute_has_passed(
    live: Live, clock: Clock, short_episode: Episode, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran(live, clock, short_episode)
    written: list[str] = []
    text = captions.text

    def noted(surface, words, *more):
        written.append(words)
        return text(surface, words, *more)

    monkeypatch.setattr(captions, "text", noted)
    pictures = []
    monkeypatch.setattr(live, "close", lambda: pictures.append(shown(live)))
    before, begun = shown(live), clock.now
    live.finish("done: 80 scans, doors: 1", [DOOR])
    assert clock.now - begun == pytest.approx(MAX_HOLD, abs=0.1)
    assert written[:2] == ["1", "done: 80 scans, doors: 1"]
    (after,) = pictures
    assert count(after, BLUE) > count(before, BLUE) + 50  # the door, and no ellipse any more
    assert count(after, (0, 0, 0)) > 100


@pytest.mark.parametrize("kind", ["KEYDOWN", "QUIT"])
def test_a_key_or_the_mouse_closes_it(
    live: Live, clock: Clock, short_episode: Episode, kind: str
) -> None:
    import pygame

    ran(live, clock, short_episode)
    pygame.event.post(pygame.event.Event(getattr(pygame, kind)))
    begun = clock.now
    live.finish("done", [])
    assert live.closed
    assert clock.now == begun
    live.finish("done", [])  # of a window that the user closed: nothing to show
    assert clock.now == begun


def test_the_last_picture_of_a_run_says_what_comes_next(
    live: Live, clock: Clock, short_episode: Episode, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    monkeypatch.setattr(captions, "text", lambda _, words, x, *more: written.append(words) or x)
    ran(live, clock, short_episode)
    told = [words for words in written if words.startswith("scan ")]
    assert told[-1] == "scan 80 of 80   0:08 elapsed, writing the files"
    assert not [words for words in written if "matched" in words]


def test_without_a_display_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(InputError, match="--live needs a display"):
        Live("a drive")


def test_spans() -> None:
    assert [_span(s) for s in (0, 59.6, 61, 3661)] == ["0:00", "1:00", "1:01", "1:01:01"]
