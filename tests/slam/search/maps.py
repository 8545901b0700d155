"""A room as a map, with a refreshed sensor model."""

from __future__ import annotations

from functools import cache

from slam.geometry import Pose2
from slam.interface import MapModel, Posterior
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.motion.gaussian import Prediction
from slam.sensor_models.endpoint import Endpoint
from tests.slam.worlds import loop, scan_at

MODELS = {"static": Static, "histogram": Histogram}


@cache
def room(resolution=0.05, model="static", beta=0.2, scans=15) -> Endpoint:
    """A sensor model of the room, mapped from true poses."""
    grid: MapModel = MODELS[model](resolution)
    reading = Endpoint(beta=beta, sigma=min(0.05, 1.9 * resolution))
    for k, pose in enumerate(loop(scans + 1)[:-1]):
        scan = scan_at(Pose2.of(pose), time=1.7 * k)
        reading.refresh(grid, grid.integrate(scan, Pose2.of(pose)))
    return reading


@cache
def view(truth: Pose2):
    """A scan of the room."""
    return scan_at(truth)


def in_room(reading, truth: Pose2, start: Pose2, displacement: Pose2, deviations) -> Posterior:
    """The posterior of a scan at `truth`, predicted at `start @ displacement`."""
    return Posterior(reading, view(truth), Prediction(start, displacement, deviations))
