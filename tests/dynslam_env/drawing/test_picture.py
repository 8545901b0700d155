import numpy as np
import pytest

from dynslam_env.drawing.captions import TITLE_HEIGHT, bar_length, shortened, width_of
from dynslam_env.drawing.colours import (
    BLUE,
    FACE,
    LIT,
    ORANGE,
    PAPER,
    PURPLE,
    SKY,
    SOLID,
    UNKNOWN,
    VERMILION,
)
from dynslam_env.drawing.render import Viewer
from dynslam_env.drawing.view import View
from slam.geometry import Pose2
from slam.scan import Scan

from .scenes import PERSON, ROBOT, belief, draw, pixel, scene

WHOLE = View()
ZOOMS = [
    View(25.0),
    View(60.0),
    View(300.0, centre=(1.6, 0.3), size=(640, 480)),
]


@pytest.mark.parametrize("view", ZOOMS)
def test_walls_floor_and_door_are_where_they_are(view):
    frame = draw(view)
    assert pixel(frame, view, 2.3, 0.0) == FACE
    assert pixel(frame, view, 1.25, 0.0) == ORANGE
    assert pixel(frame, view, 1.75, 0.0) == ORANGE
    assert pixel(frame, view, 2.2, 0.5) == PAPER
    assert pixel(frame, view, 1.5, -0.4) == PAPER  # behind the door
    assert pixel(frame, view, 2.4, -0.4) == SOLID


@pytest.mark.parametrize("view", [View(25.0), View(60.0), View(150.0)])
def test_a_person_is_where_they_are(view):
    frame, (x, y, radius) = draw(view), PERSON
    for dx, dy in ((0.7, 0.0), (-0.7, 0.0), (0.0, 0.7), (0.0, -0.7)):
        assert pixel(frame, view, x + dx * radius, y + dy * radius) == PURPLE
    assert pixel(frame, view, x + 1.6 * radius, y) == PAPER


def test_a_block_and_all_beyond_the_walls_is_solid():
    frame = draw(WHOLE)
    assert pixel(frame, WHOLE, 3.0, 1.5) == SOLID
    assert pixel(frame, WHOLE, -0.2, 1.5) == SOLID
    assert pixel(frame, WHOLE, 3.8, 1.5) == PAPER


@pytest.mark.parametrize("scale", [40.0, 200.0, 800.0])
@pytest.mark.parametrize("pose", [ROBOT, Pose2(0.9, 2.1, 2.0)])
def test_followed_the_robot_is_in_the_middle(scale, pose):
    frame = draw(View(scale, follow=True, size=(400, 300)), pose=pose)
    assert frame.shape == (300 + TITLE_HEIGHT, 400, 3)
    behind = pose @ Pose2(-0.1, 0.0, 0.0)
    dx, dy = (behind.x - pose.x) * scale, (behind.y - pose.y) * scale
    assert tuple(frame[TITLE_HEIGHT + 150 - round(dy), 200 + round(dx)]) == BLUE


def test_edges_are_smooth():
    """Across the robot's rim there are colours between its own and the white around it."""
    frame = draw(View(150.0, follow=True, size=(400, 300)))
    middle = TITLE_HEIGHT + 150
    rim = frame[middle - 45 : middle + 45, 200 - 45 : 200 + 45].reshape(-1, 3)
    red = rim[:, 0]
    assert np.count_nonzero((red > BLUE[0] + 10) & (red < PAPER[0] - 10)) > 50
    assert len(np.unique(red)) > 8


def test_a_slanting_wall_has_many_shades():
    walls = np.vstack([scene().walls, [(0.3, 0.3, 1.3, 0.5)]])
    view = View(60.0, centre=(0.8, 0.4), size=(60, 32))
    frame = draw(view, walls=walls)
    assert len(np.unique(frame[TITLE_HEIGHT:, :, 0])) > 8


@pytest.mark.parametrize("scale", [11.0, 60.0, 333.3])
def test_lines_keep_their_width(scale):
    view = View(scale, centre=(4.0, 0.5), size=(200, 40))
    row = draw(view)[TITLE_HEIGHT + 20, :, 0].astype(float)
    dark = (PAPER[0] - row[80:100]).sum() + (SOLID[0] - row[100:120]).clip(0).sum()
    assert 1.5 < dark / (PAPER[0] - FACE[0]) < 3.5


def test_beside_the_world_is_the_map_with_both_robots():
    view = View(60.0, stacked=False)
    pose = Pose2(2.2, 2.1, 0.0)
    frame = Viewer(False, 10).draw(scene(), belief(pose), view)
    assert frame is not None
    assert frame.shape[1] == 2 * view.panel(scene().walls)[0]
    assert pixel(frame, view, 0.25, 0.25, panel=1) == (0, 0, 0)
    assert pixel(frame, view, 2.0, 1.0, panel=1) == (255, 255, 255)
    assert pixel(frame, view, 2.2, 2.7, panel=1) == UNKNOWN
    assert pixel(frame, view, -0.2, 1.0, panel=1) == UNKNOWN
    assert pixel(frame, view, 2.1, 2.1, panel=1) == VERMILION
    assert pixel(frame, view, ROBOT.x, ROBOT.y, panel=1) != VERMILION
    left = frame.shape[1] // 2
    ring = (frame[TITLE_HEIGHT:, left:] == BLUE).all(axis=2)  # of the true robot
    assert ring.sum() > 50
    outlined = frame[TITLE_HEIGHT:, left:, 0].astype(int) < (UNKNOWN[0] + SKY[0]) // 2 + 10
    assert outlined.sum() > 500  # the true walls
    legend = frame[:TITLE_HEIGHT, left:]
    for colour in (BLUE, VERMILION):
        assert (legend == colour).all(axis=2).sum() > 10


@pytest.mark.parametrize("scale", [40.0, 300.0, 2000.0])
def test_the_map_is_drawn_at_any_zoom(scale):
    view = View(scale, centre=(0.25, 0.25), size=(200, 100), stacked=False)
    assert pixel(with_map(view), view, 0.25, 0.25, panel=1) == (0, 0, 0)


@pytest.mark.parametrize("scale", [0.1, 40.0, 2000.0])
def test_far_from_the_map_nothing_is_known(scale):
    view = View(scale, centre=(3e5, -3e5), size=(200, 100), stacked=False)
    assert (with_map(view)[TITLE_HEIGHT:, 201:] == UNKNOWN).all()


def with_map(view):
    frame = Viewer(False, 10).draw(scene(), belief(), view)
    assert frame is not None
    return frame


def test_a_wide_world_has_its_map_below():
    walls = np.array([(0, 0, 60, 0), (60, 0, 60, 8), (60, 8, 0, 8), (0, 8, 0, 0)], dtype=float)
    viewer = Viewer(False, 10)
    single, double = viewer.draw(scene(walls=walls)), viewer.draw(scene(walls=walls), belief())
    assert single is not None
    assert double is not None
    assert double.shape == (2 * single.shape[0], single.shape[1], 3)


def test_the_size_stays_when_the_world_changes_and_is_even():
    viewer, sizes = Viewer(False, 10), set()
    for i in range(3):
        grown = scene().walls * (1 + 0.37 * i)
        frame = viewer.draw(scene(walls=grown))
        assert frame is not None
        sizes.add(frame.shape)
    assert len(sizes) == 1
    assert all(side % 2 == 0 for side in sizes.pop()[:2])


def test_a_beam_without_a_reading_lights_nothing():
    dull = scene()
    ranges = dull.scan.ranges.copy()
    ranges[:] = np.nan
    blind = dull._replace(scan=type(dull.scan)(ranges, dull.scan.angles, max_range=8.0))
    frame = Viewer(False, 10).draw(blind)
    assert pixel(frame, WHOLE, 2.2, 1.5) == PAPER
    assert pixel(draw(), WHOLE, 2.2, 1.55) != PAPER


def test_between_a_near_and_a_far_beam_the_light_steps():
    """Not a line from one end to the other: behind a corner it would cross what is solid."""
    pair = scene()._replace(scan=Scan(np.array([0.5, 2.0]), np.array([-0.1, 0.1]), max_range=8.0))
    view = View(300.0, centre=(2.0, 1.5), size=(400, 200))
    frame = Viewer(False, 10).draw(pair, None, view)
    assert pixel(frame, view, ROBOT.x + 0.62, ROBOT.y - 0.006) == PAPER
    assert pixel(frame, view, ROBOT.x + 0.62, ROBOT.y + 0.006) == LIT


def test_a_title_that_is_too_long_is_cut():
    assert shortened("short", 100) == "short"
    cut = shortened("a title that goes on and on", 100)
    assert cut.endswith(" ...")
    assert width_of(cut) <= 100
    frame = draw(title="truth " * 40)
    assert (frame[:TITLE_HEIGHT, -20:] != PAPER).any()  # the scale bar still stands at the end


@pytest.mark.parametrize(
    ("pixels_per_metre", "metres"), [(60, 1), (20, 5), (18, 5), (150, 0.5), (1100, 0.1), (5, 20)]
)
def test_the_scale_bar_is_a_round_length(pixels_per_metre, metres):
    assert bar_length(pixels_per_metre) == pytest.approx(metres)


def test_texts_survive_pygames_end():
    import pygame

    before = draw()
    pygame.quit()
    assert (draw() == before).all()
