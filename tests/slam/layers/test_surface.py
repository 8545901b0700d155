import numpy as np

from slam.geometry import Pose2 as Pose
from slam.geometry import transform_points
from slam.layers.surface import NO_SURFACE, extent, find_surface
from slam.maps.rays import Rays
from tests.slam.layers.rooms import HOUSE, watch

SCANS, POSES = watch([HOUSE] * 8, [Pose(0.1 * k, 0.02 * k, 0.3) for k in range(8)])
SPEC = extent(SCANS, POSES, Rays(), 0.05)
SURFACE = find_surface(SCANS, POSES, Rays(), SPEC)


def echoes() -> np.ndarray:
    pairs = zip(SCANS, POSES.tolist(), strict=True)
    return np.concatenate([transform_points(Pose(*pose), scan.points) for scan, pose in pairs])


def test_cells_are_those_of_the_echoes() -> None:
    points = echoes()
    cells, counts = np.unique(SPEC.cells(points), axis=0, return_counts=True)
    np.testing.assert_array_equal(SURFACE.cells, cells)
    np.testing.assert_array_equal(SURFACE.echoes, counts)
    assert (SURFACE.number[tuple(cells.T)] == np.arange(len(cells))).all()
    assert (SURFACE.number != NO_SURFACE).sum() == len(cells)


def test_places_are_the_means_of_the_echoes() -> None:
    points = echoes()
    of = SURFACE.number[tuple(SPEC.cells(points).T)]
    for i in range(len(SURFACE.cells)):
        np.testing.assert_allclose(SURFACE.places[i], points[of == i].mean(axis=0), atol=1e-9)


def test_normals_are_those_of_the_echoes_around() -> None:
    """A slow reference: the smaller eigenvector of the scatter of all echoes within two cells."""
    points, told = echoes(), 0
    cells = SPEC.cells(points)
    for i, cell in enumerate(SURFACE.cells):
        around = points[(np.abs(cells - cell) <= 2).all(axis=1)]
        if len(around) > 1 and SURFACE.normals[i].any():
            values, axes = np.linalg.eigh(np.cov(around.T, bias=True))
            assert abs(SURFACE.normals[i] @ axes[:, 0]) > 1 - 1e-6
            np.testing.assert_allclose(SURFACE.spread[i], np.sqrt(max(values[0], 0)), atol=1e-6)
            told += 1
    assert told > len(SURFACE.cells) / 2
