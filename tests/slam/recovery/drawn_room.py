"""A room that has been drawn, for tests of searches."""

import numpy as np

from slam.geometry import Pose2
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint


def room(pose: Pose2 = Pose2()) -> Scan:
    """A scan in the middle of a room of 4 x 3 m, from a pose in it."""
    angles = np.radians(np.arange(-180.0, 180.0, 2.0))
    c, s = np.cos(angles + pose.theta), np.sin(angles + pose.theta)
    with np.errstate(divide="ignore"):
        x = np.where(c > 0, 2.0 - pose.x, 2.0 + pose.x) / np.abs(c)
        y = np.where(s > 0, 1.5 - pose.y, 1.5 + pose.y) / np.abs(s)
    return Scan(np.minimum(x, y), angles, max_range=8.0)


def reading() -> Endpoint:
    """The room, drawn several times."""
    known, endpoint = Static(), Endpoint()
    for _ in range(5):
        endpoint.refresh(known, known.integrate(room(), Pose2()))
    return endpoint
