"""A room drawn by hand: 4 x 3 m, a block in it, a door in a gap of its lower wall, one person."""

import numpy as np

from dynslam_env.drawing.captions import TITLE_HEIGHT
from dynslam_env.drawing.render import Viewer
from dynslam_env.drawing.scene import Belief, Scene
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.scan import Scan

ROOM = [(0, 0, 1, 0), (2, 0, 4, 0), (4, 0, 4, 3), (4, 3, 0, 3), (0, 3, 0, 0)]
PORCH = [(1, 0, 1, -1), (1, -1, 2, -1), (2, -1, 2, 0)]
BLOCK = [(2.5, 1, 3.5, 1), (3.5, 1, 3.5, 2), (3.5, 2, 2.5, 2), (2.5, 2, 2.5, 1)]
LEAF = [(1, 0.02), (2, 0.02), (2, -0.02), (1, -0.02)]
ROBOT = Pose2(1.5, 1.5, 0.0)
PERSON = (0.5, 2.4, 0.25)


def scene(pose=ROBOT, walls=None, title="truth") -> Scene:
    angles = np.linspace(-0.3, 0.3, 31)
    corners = np.array(LEAF)
    return Scene(
        walls=np.array([*ROOM, *PORCH, *BLOCK], dtype=np.float64) if walls is None else walls,
        leaves=np.hstack([corners, np.roll(corners, -1, axis=0)])[None],
        sweeps=np.array([(1.0, 0.02, 0.0, 1.5)]),
        scan=Scan(1.0 / np.cos(angles), angles, max_range=8.0),
        pose=pose,
        radius=0.22,
        trail=[pose],
        title=title,
        people=np.array([PERSON]),
    )


def belief(pose=ROBOT) -> Belief:
    """4 x 3 m in cells of half a metre: free but for the one at (0.25, 0.25), top row unseen."""
    occupied, observed = np.full((6, 8), 0.0), np.full((6, 8), True)
    occupied[0, 0], observed[5] = 1.0, False
    grid = OccupancyGrid(GridSpec(0.5, 0, 0, 6, 8), occupied, observed)
    return Belief(grid, pose, [pose], "a SLAM")


def draw(view=None, **changes) -> np.ndarray:
    frame = Viewer(window=False, fps=10).draw(scene(**changes), None, view)
    assert frame is not None
    return frame


def pixel(frame, view, x, y, panel=0, place=None) -> tuple[int, ...]:
    """The colour at a point of the world, m, in the truth (0) or the map beside it (1)."""
    place = place or scene()
    size = view.panel(place.walls)
    projection = view.projection(place.walls, (place.pose.x, place.pose.y), size)
    right, down = projection.at(x, y)
    return tuple(frame[int(down) + TITLE_HEIGHT, int(right) + panel * size[0]].tolist())
