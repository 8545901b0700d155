import numpy as np
import pytest
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from slam.errors import InputError
from slam.grid import GridSpec, OccupancyGrid
from slam.layers.doors import MappedDoor
from slam.layers.free_space import free_space
from slam.layers.route_graph import NO_DOOR, RouteGraph, route_graph
from slam.layers.thinning import skeleton

EIGHT, FOUR = np.ones((3, 3)), np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]])
CELL = 0.05  # m


def grid_of(picture: np.ndarray, cell: float = CELL) -> OccupancyGrid:
    """1 free, 0 occupied, -1 unknown; row 0 is the lowest."""
    occupied = np.select([picture == 1, picture == 0], [0.0, 1.0], 0.5)
    return OccupancyGrid(GridSpec(cell, 10, -20, *picture.shape), occupied, picture >= 0)


def rooms(gap: int = 18) -> np.ndarray:
    """Two rooms of 5 x 4 m and a doorway of `gap` cells between them; another, without one."""
    picture = np.zeros((90, 330), int)
    picture[5:85, 5:105] = picture[5:85, 110:210] = picture[5:85, 220:320] = 1
    picture[40 : 40 + gap, 105:110] = 1
    return picture


def at(grid: OccupancyGrid, *cells: tuple[int, int]) -> np.ndarray:
    """(n, 3) poses in cells."""
    return np.column_stack([grid.spec.centres(np.array(cells)), np.zeros(len(cells))])


def door_of(grid: OccupancyGrid, gap: int = 18) -> MappedDoor:
    ends = grid.spec.centres(np.array([(40, 107), (39 + gap, 107)]))
    return MappedDoor(ends, 0.25, 3, 9.0, 0.0, 9.0, 5, 5, 0.95)


def labelled(cells: np.ndarray, neighbours: np.ndarray = EIGHT) -> tuple[np.ndarray, int]:
    labels = np.zeros(cells.shape, np.int32)
    count = label(cells, neighbours, output=labels)
    return labels, int(count)  # pyright: ignore[reportArgumentType]


def parts_of(graph: RouteGraph, but: int = -1) -> int:
    """The number of connected parts, without the edge of a number."""
    ends = np.delete(graph.edges, but, axis=0) if but >= 0 else graph.edges
    size = len(graph.points)
    links = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(size, size))
    return int(connected_components(links, directed=False)[0])


def rings_of(graph: RouteGraph) -> int:
    """The number of independent ways round."""
    return len(graph.edges) - len(graph.points) + parts_of(graph)


@pytest.mark.parametrize("seed", range(4))
def test_a_skeleton_is_thin_and_connected_as_its_area_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    area = np.zeros((80, 90), bool)
    for _ in range(12):
        row, col = rng.integers(0, 60, 2)
        height, width = rng.integers(2, 30, 2)
        area[row : row + height, col : col + width] = True
    thin = skeleton(area)
    assert not (thin & ~area).any()
    assert labelled(thin)[1] == labelled(area)[1]
    square = thin[1:, 1:] & thin[1:, :-1] & thin[:-1, 1:] & thin[:-1, :-1]
    assert square.sum() <= 0.02 * thin.sum()
    holes = labelled(~np.pad(area, 1), FOUR)[
        1
    ]  # 4-connected, as the complement of an 8-connected area
    assert labelled(~np.pad(thin, 1), FOUR)[1] == holes


def test_routes_lead_through_the_door_and_nowhere_else() -> None:
    grid = grid_of(rooms())
    door = door_of(grid)
    graph = route_graph(grid, [door], 0.3, at(grid, (45, 50)))
    assert parts_of(graph) == 1
    x = graph.points[:, 0]
    wall, other = grid.spec.centres(np.array([(0, 107), (0, 215)]))[:, 0]
    assert (x < wall).any()
    assert ((x > wall) & (x < other)).any()
    assert not (x > other).any()  # the third room cannot be reached
    (crossing,) = np.flatnonzero(graph.doors != NO_DOOR)
    assert graph.doors[crossing] == 0
    a, b = graph.points[graph.edges[crossing]]
    assert np.allclose((a + b) / 2, door.ends.mean(axis=0))
    assert graph.lengths[crossing] < 2.5
    assert parts_of(graph, but=int(crossing)) == 2


@pytest.mark.parametrize("radius", [0.2, 0.4])
def test_every_edge_keeps_away_from_what_stands(radius: float) -> None:
    picture = rooms()
    picture[20:24, 30:34] = picture[60:63, 150:190] = 0  # a pillar, a table
    picture[5:30, 180:210] = -1  # unknown: not free either
    grid = grid_of(picture)
    graph = route_graph(grid, [], radius, at(grid, (45, 50)))
    solid = grid.spec.centres(np.argwhere(picture != 1))
    for a, b in graph.points[graph.edges]:
        for share in np.linspace(0, 1, 20):
            away = np.hypot(*(solid - a - share * (b - a)).T).min()
            assert away > radius - 0.75 * CELL
    assert len(graph.edges) >= 4


def test_a_robot_too_wide_for_the_door_stays_in_its_room() -> None:
    grid = grid_of(rooms(gap=10))
    door = door_of(grid, 10)
    graph = route_graph(grid, [door], 0.3, at(grid, (45, 50)))
    assert graph.points[:, 0].max() < grid.spec.centres(np.array([(0, 105)]))[0, 0]
    assert (graph.doors == NO_DOOR).all()
    both = route_graph(grid, [door], 0.3, at(grid, (45, 50), (45, 150)))
    assert parts_of(both) == 2
    with pytest.raises(InputError, match="radius 3 m fits nowhere"):
        route_graph(grid, [], 3.0, at(grid, (45, 50)))


@pytest.mark.parametrize("seed", range(5))
def test_the_graph_is_connected_as_the_free_space_is(seed: int) -> None:
    """Around furniture at random: as many parts, a way round each block, and few points."""
    rng = np.random.default_rng(seed)
    picture = np.zeros((240, 300), int)
    picture[4:-4, 4:-4] = 1
    for _ in range(25):
        row, col = rng.integers(4, 230), rng.integers(4, 290)
        picture[row : row + rng.integers(2, 40), col : col + rng.integers(2, 40)] = 0
    grid = grid_of(picture)
    everywhere = at(grid, *np.argwhere(picture == 1)[::50].tolist())
    space = free_space(grid, 0.25, everywhere)
    graph = route_graph(grid, [], 0.25, everywhere)
    parts, count = labelled(space.drivable)
    assert parts_of(graph) == count
    rows, cols = grid.spec.cells(graph.points).T
    of_points = parts[rows, cols]
    assert set(of_points.tolist()) == set(range(1, count + 1))
    for a, b in graph.edges:
        assert of_points[a] == of_points[b]
    assert len(graph.points) < 150
    longest = max(graph.lengths)
    assert longest <= 10.0 + 1e-9


def test_both_ways_round_a_block_stay() -> None:
    picture = np.zeros((120, 120), int)
    picture[5:115, 5:115] = 1
    picture[40:80, 40:80] = 0
    grid = grid_of(picture)
    graph = route_graph(grid, [], 0.3, at(grid, (20, 20)))
    assert rings_of(graph) == 1
    assert 8.0 < graph.lengths.sum() < 16.0  # between the block's outline and the room's


def test_a_finer_map_has_the_routes_of_a_coarser_one() -> None:
    picture = rooms()
    fine = np.kron(picture, np.ones((2, 2), int))
    coarse = grid_of(picture)
    spec = GridSpec(CELL / 2, 20, -40, *fine.shape)
    finer = grid_of(fine, CELL / 2)
    finer = OccupancyGrid(spec, finer.occupied, finer.observed)
    poses = at(coarse, (45, 50))
    one, two = (route_graph(grid, [], 0.3, poses) for grid in (coarse, finer))
    assert np.allclose(one.points, two.points)
    assert (one.edges == two.edges).all()
