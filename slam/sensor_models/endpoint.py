"""Endpoint reading: each echo should lie on something occupied (Thrun et al. 2005, 6.4)."""

from __future__ import annotations

import math

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
from slam.sensor_models.coarse import LEVELS, REACH, Means, Peaks
from slam.validation import positive

ROUNDING = 1e-6
NEAR, CLEAR = 0.4, 0.1  # of F: from where on an echo is explained, or contradicted; the prior of
# what is unknown lies between them
FINENESS = 4096  # values of the logarithm that are tabulated


class Endpoint:
    """log p(z | s, h) = beta sum_k log(z_hit F(e_k) + z_rand) over the echoes e_k of a scan.

    F(e) = max_c h_c exp(-d(e, c)^2 / 2 sigma^2) over the cells c that ever gave an echo, d being
    the distance to the centroid of c's echoes; and no less than the h of the cell that e lies in,
    if that one never gave an echo.
    The logarithm is kept as a field, sampled at the centres of the cells, brought up to date where
    the map changed, and read between the samples with a quadratic B-spline: a bilinear reading
    would have its peaks at the samples, and the robot would stick to the grid.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, how far an echo may lie from what it hit
    z_hit   share of echoes that the map explains
    z_rand  floor of an echo that it does not
    tiles   of the map that is read
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
        self._map_model: MapModel | None = None

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Bring the field up to date around the `changed` cells (ids) of the map."""
        if map_model is not self._map_model:
            self._begin(map_model)
        cells, tiles = map_model.cells, map_model.cells.tiles
        blocks = field.take_notice(
            changed, cells.occupied.flat, cells.centroids.offset.flat, cells.centroids.count.flat,
            self._level.flat, self._moved.flat, self._stale.values, tiles.places, tiles.corner,
            tiles.index, self._radius,
        )  # fmt: skip
        field.refresh(blocks, self._stale.values, tiles.index, self._level.flat, self._moved.flat,
                      self._field.flat, self._radius, *self._model)  # fmt: skip
        for made in (self._peaks, self._means):
            if made is not None:
                made.due.add(blocks)

    def _begin(self, map_model: MapModel) -> None:
        """Fields for a map that was not read before: what is unknown takes the map's prior."""
        tiles = map_model.cells.tiles
        self._map_model = map_model
        self._radius = math.ceil(3 * self.sigma / tiles.resolution - ROUNDING)
        if self._radius + REACH > TILE_MARGIN:
            raise InputError(
                f"Endpoint.sigma may be {tiles.resolution * (TILE_MARGIN - REACH) / 3:g} m at "
                f"most with cells of {tiles.resolution:g} m, got {self.sigma:g}"
            )
        h = np.clip(np.arange(256), field.H_LOW, field.H_HIGH) / 255
        log_f = np.linspace(math.log(h[-1]), math.log(h[0]), FINENESS)
        transformed = np.log(self.z_hit * np.exp(log_f) + self.z_rand)
        falloff = 0.5 * (tiles.resolution / self.sigma) ** 2
        self._model = (
            np.float32(falloff),
            np.log(h).astype(np.float32),
            transformed.astype(np.float32),
        )
        prior = min(max(round(255 * map_model.cells.prior), field.H_LOW), field.H_HIGH)
        self._level = tiles.layer(np.uint8, prior)
        self._moved = tiles.layer(np.int8, field.NO_ECHO, (AREA, 2))
        self._stale = tiles.layer(np.bool_, shape=(BLOCKS**2,))
        unknown = float(np.log(self.z_hit * h[prior] + self.z_rand))
        self.read(tiles, tiles.layer(np.float32, unknown))

    def read(self, tiles: Tiles, layer: Layer) -> None:
        """Take `layer` of the tiles for the field, blank where nothing is known."""
        self.tiles, self._field, self.unknown = tiles, layer, float(layer.fill)
        h = np.array([field.H_LOW, field.H_HIGH]) / 255
        low, high = np.log(self.z_hit * h + self.z_rand).tolist()
        self._span = low, high
        self._top = max(high, self.unknown)
        self._peaks: Peaks | None = None
        self._means: Means | None = None

    def field(self, level: int = 0) -> Layer:
        """The field of cells 1 << level times as wide as the map's; the coarser from the first time
        on that one is asked for."""
        if level == 0:
            return self._field
        if self._means is None:
            self._means = Means(self.tiles, self._field, self.unknown)
        return self._means.level(level)

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3); maybe -inf where it is below `floor`."""
        tiles = self.tiles
        return self.beta * field.values(
            poses, scan.points, tiles.index, self._field.flat, tiles.origin, tiles.resolution,
            self.unknown, floor / self.beta - ROUNDING, self._top,
        )  # fmt: skip

    def shares(self, scan: Scan, pose: Pose2) -> tuple[float, float]:
        """Shares of the echoes that lie near something occupied, and that lie where it is free."""
        tiles = self.tiles
        each = field.each(np.array(pose), scan.points, tiles.index, self._field.flat,
                                 tiles.origin, tiles.resolution, self.unknown)  # fmt: skip
        near, clear = np.log(self.z_hit * np.array([NEAR, CLEAR]) + self.z_rand)
        n = max(len(each), 1)
        return float((each > near).sum() / n), float((each < clear).sum() / n)

    def bound(self, scan: Scan, poses: Array, reach: float) -> Array:
        """(n,) no less than the log-likelihood at any pose within `reach` m, in x and in y, of each
        of the poses (n, 3), with the same heading."""
        if self._peaks is None:
            self._peaks = Peaks(self.tiles, self._field, self.unknown, *self._span)
        return self.beta * self._peaks.bounds(scan.points, poses, reach)

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature of the log-likelihood, read off the field of `level`."""
        tiles = self.tiles
        return Slope(*field.slope(
            *pose, scan.points, tiles.index, self.field(level).values, tiles.origin,
            tiles.resolution, level, self.beta,
        ))  # fmt: skip


class FrozenEndpoint:
    """What an `Endpoint` reads of a map as it is now, kept small.

    nbytes  that are kept
    """

    def __init__(self, reading: Endpoint):
        self._parameters = reading.beta, reading.sigma, reading.z_hit, reading.z_rand
        self._field = PackedLayer(reading.tiles, reading.field())
        self.nbytes = self._field.nbytes

    def reading(self) -> Endpoint:
        """One that reads the same, and takes notice of no map."""
        reading = Endpoint(*self._parameters)
        reading.read(*self._field.unpacked())
        return reading
