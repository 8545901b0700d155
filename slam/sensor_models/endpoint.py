"""Endpoint sensor model: a likelihood field around occupied cells (Thrun et al. 2005, 6.4)."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.interface import MapModel, Slope
from slam.maps.packed import PackedLayer
from slam.maps.rays import TILE_MARGIN
from slam.maps.tiles import AREA, Layer, Tiles
from slam.scan import Scan
from slam.sensor_models import field
from slam.sensor_models.blocks import BLOCKS
from slam.sensor_models.pyramid import LEVELS, Pyramid
from slam.validation import positive

ROUNDING = 1e-6
# F above which an echo is explained and below which it is contradicted; the prior lies between
EXPLAINED_F, CONTRADICTED_F = 0.4, 0.1
INTERPOLATED = 2  # cells around an echo's, whose samples its value depends on
SIDE = 0.15  # m before and beyond an echo, where it is told from which side a wall is known
SHARPNESS = 9.0  # at beta 1, see `SensorModel`: the field is as wide as cells need it
TABLE_SIZE = 4096  # values of the logarithm that are tabulated
Samples = tuple[np.ndarray, np.ndarray, tuple[float, float], float, float, float, float]
Reading = tuple[np.ndarray, Array, tuple[float, float], float, int, float]  # see `field.slope`


class Endpoint:
    """log p(z | s, h) = beta sum_k log(z_hit F(e_k) + z_rand) over the echoes e_k of a scan.

    F(e) = max_c h_c exp(-d(e, c)^2 / 2 sigma^2) over the cells c with echoes, d being the distance
    to the centroid of c's echoes; and at least the h of the cell of e if that cell has no echo.
    The logarithm is kept as a field, sampled at the centres of the cells, updated where the map
    changed, and interpolated by a quadratic B-spline: bilinear interpolation would have its maxima
    at the samples, and draw the pose to the grid.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, standard deviation of the distance between an echo and the object that it hit
    z_hit   share of echoes that the map explains
    z_rand  likelihood of an echo that it does not explain
    tiles   of the map
    refreshed  (n, 2) the blocks of the last refresh, by row and column in `Tiles.index`, in blocks
    """

    levels = LEVELS

    def __init__(
        self, beta: float = 0.3, sigma: float = 0.04, z_hit: float = 0.9, z_rand: float = 0.1
    ):
        self.beta = beta
        self.sigma = sigma
        self.z_hit = z_hit
        self.z_rand = z_rand
        positive(self, "beta", "sigma", "z_hit", "z_rand")
        self.sharpness = SHARPNESS / beta
        self._map_model: MapModel | None = None
        self._coarser: Pyramid | None = None  # from the first time on that it is asked for

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Update the field around the `changed` cells (ids) of the map; a new map's are all."""
        cells, tiles = map_model.cells, map_model.cells.tiles
        if map_model is not self._map_model:
            self._begin(map_model)
            changed = cells.observed_ids()
        blocks = field.mark_stale(
            changed, cells.occupied.flat, cells.centroids.offset.flat, cells.centroids.count.flat,
            self._h_level.flat, self._centroid.flat, self._stale.values, tiles.places, tiles.corner,
            tiles.index, self._radius,
        )  # fmt: skip
        field.refresh(
            blocks, self._stale.values, tiles.index, self._h_level.flat, self._centroid.flat,
            self._field.flat, *self._model,
        )  # fmt: skip
        self.refreshed = blocks
        self.rewritten(blocks)

    def rewritten(self, blocks: np.ndarray) -> None:
        """The field of these blocks (n, 2) has changed: coarser ones are not up to date."""
        if self._coarser is not None:
            self._coarser.dirty.add(blocks)

    def of_layer(self, layer: Layer) -> Endpoint:
        """The same model of another field of the same tiles, which no map refreshes."""
        other = Endpoint(self.beta, self.sigma, self.z_hit, self.z_rand)
        other.set_field(self.tiles, layer)
        return other

    def _begin(self, map_model: MapModel) -> None:
        """Start a field for a new map; unknown cells have the map's prior."""
        tiles = map_model.cells.tiles
        self._map_model = map_model
        self._radius = math.ceil(3 * self.sigma / tiles.resolution - ROUNDING)
        if self._radius > TILE_MARGIN - INTERPOLATED:
            most = tiles.resolution * (TILE_MARGIN - INTERPOLATED) / 3
            raise InputError(
                f"Endpoint.sigma may be {most:g} m at most with cells of {tiles.resolution:g} m, "
                f"got {self.sigma:g}"
            )
        self._model = _tables(self.sigma, tiles.resolution, self.z_hit, self.z_rand)
        prior = min(max(round(255 * map_model.cells.prior), field.H_MIN), field.H_MAX)
        self._h_level = tiles.layer(np.uint8, prior)
        self._centroid = tiles.layer(np.int8, field.NO_CENTROID, (AREA, 2))
        self._stale = tiles.layer(np.bool_, shape=(BLOCKS**2,))
        unknown = float(np.log(self.z_hit * (prior / 255) + self.z_rand))
        self.set_field(tiles, tiles.layer(np.float32, unknown))

    def set_field(self, tiles: Tiles, layer: Layer) -> None:
        """Use `layer` of the tiles as the field; its fill value is that of unknown cells."""
        self.tiles, self._field, self.unknown = tiles, layer, float(layer.fill)
        h = np.array([field.H_MIN, field.H_MAX]) / 255
        low, high = np.log(self.z_hit * h + self.z_rand).tolist()
        self.top = max(high, self.unknown)
        self.nothing, self.free = low, math.log(self.z_hit * CONTRADICTED_F + self.z_rand)
        self._explained = math.log(self.z_hit * EXPLAINED_F + self.z_rand)
        self._coarser = None
        self.refreshed = np.empty((0, 2), np.int32)

    def field(self, level: int = 0) -> Layer:
        """The field of cells 1 << level times as wide as the map's."""
        return self._field if level == 0 else self._pyramid.level(level)

    @property
    def maxima(self) -> Layer:
        """The maxima of the field over squares of 2 x 2 cells, see `pyramid.in_units`."""
        return self._pyramid.maxima

    @property
    def _pyramid(self) -> Pyramid:
        if self._coarser is None:
            span = self.nothing, self.top
            self._coarser = Pyramid(self.tiles, self._field, self.unknown, *span)
        return self._coarser

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3); may be -inf where below `floor`."""
        tiles = self.tiles
        return self.beta * field.sums(
            poses, scan.points, tiles.index, self._field.flat, tiles.origin, tiles.resolution,
            self.unknown, floor / self.beta - ROUNDING, self.top,
        )  # fmt: skip

    @property
    def samples(self) -> Samples:
        """What kernels compare poses by: the last arguments of `search.candidates.likeliest`."""
        tiles = self.tiles
        return (tiles.index, self._field.flat, tiles.origin, tiles.resolution,
                self.unknown, self.top, self.beta)  # fmt: skip

    def shares(self, points: Array, pose: Pose2) -> tuple[float, float]:
        """Shares of echoes (n, 2) that the map explains (occupied) and contradicts (free)."""
        tiles = self.tiles
        above, below = field.counts(
            *pose, points, tiles.index, self._field.flat, tiles.origin, tiles.resolution,
            self.free, self._explained,
        )  # fmt: skip
        n = max(len(points), 1)
        return above / n, below / n

    def known_shares(self, points: Array, pose: Pose2) -> tuple[float, float]:
        """Shares of echoes (n, 2) that the map explains, and that it knows and does not explain
        (see `field.raise_known`)."""
        known = np.zeros(len(points), np.uint8)
        self.raise_known(known, points, pose)
        return shares_of_known(known)

    def raise_known(self, known: np.ndarray, points: Array, pose: Pose2) -> None:
        """Raise `known` (n,) uint8 to 1 for echoes (n, 2) that the map knows, and to 2 for those
        that it explains; of several maps one after the other. See `field.raise_known`."""
        tiles = self.tiles
        field.raise_known(
            known, tuple(pose), points, tiles.index, self._field.flat, tiles.origin,
            tiles.resolution, self.free, self._explained,
        )  # fmt: skip

    def behind(self, points: Array, views: Array, pose: Pose2) -> float:
        """Share of echoes (n, 2), seen along unit vectors `views` (n, 2), on the far side of a wall
        that the map knows from that side alone: the robot would have seen through it."""
        tiles = self.tiles
        number = field.behind(
            tuple(pose), points, SIDE * views, tiles.index, self._field.flat, tiles.origin,
            tiles.resolution, self.free, self._explained,
        )  # fmt: skip
        return number / max(len(points), 1)

    def reading(self, level: int) -> Reading:
        """What kernels evaluate the field of `level` by."""
        tiles = self.tiles
        values = self.field(level).values
        return tiles.index, values, tiles.origin, tiles.resolution, level, self.beta

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature of the log-likelihood, from the field of `level`."""
        return Slope(*field.slope(*pose, scan.points, *self.reading(level)))


def shares_of_known(known: np.ndarray) -> tuple[float, float]:
    """See `Endpoint.known_shares`; `known` by `raise_known`."""
    n = max(len(known), 1)
    return float((known == field.EXPLAINED).sum() / n), float((known == field.KNOWN).sum() / n)


class FrozenEndpoint:
    """A compressed copy of an `Endpoint` and its current field.

    nbytes  size of the copy
    """

    def __init__(self, endpoint: Endpoint):
        self._parameters = endpoint.beta, endpoint.sigma, endpoint.z_hit, endpoint.z_rand
        self._field = PackedLayer(endpoint.tiles, endpoint.field())
        self.nbytes = self._field.nbytes

    def unpacked(self) -> Endpoint:
        """The same `Endpoint`, without a map to be refreshed from."""
        endpoint = Endpoint(*self._parameters)
        endpoint.set_field(*self._field.unpacked())
        return endpoint


@cache
def _tables(
    sigma: float, resolution: float, z_hit: float, z_rand: float
) -> tuple[np.float32, np.ndarray, np.ndarray]:
    """The last arguments of `field.refresh`; the same for all maps of these parameters."""
    h = np.clip(np.arange(256), field.H_MIN, field.H_MAX) / 255
    log_f = np.linspace(math.log(h[-1]), math.log(h[0]), TABLE_SIZE)
    transformed = np.log(z_hit * np.exp(log_f) + z_rand)
    falloff = 0.5 * (resolution / sigma) ** 2
    return np.float32(falloff), np.log(h).astype(np.float32), transformed.astype(np.float32)
