"""What a map tells of a scan at a pose, and the climbs from many poses."""

import math

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.graph.global_search import GlobalSearch
from slam.maps.static import Static
from slam.motion.gaussian import Prediction
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton, climbed
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.field import EXPLAINED, KNOWN
from tests.slam.recovery.drawn_room import reading, room


def test_climbs_in_one_call_are_climbs() -> None:
    endpoint, points = reading(), room().points
    starts = np.array([[0.1, -0.05, 0.05], [-0.08, 0.02, -0.1], [0.0, 0.0, 0.0]])
    wide, limits = np.array([0.3, 0.3, 0.1]), GaussNewton().limits
    tops, values = climbed(starts, points, endpoint.reading(1), endpoint.reading(0), wide, limits)
    assert tops == pytest.approx(np.zeros((3, 3)), abs=0.02)
    priors = [
        Prediction(Pose2.of(start), Pose2(), wide).log_density(top[None])[0]
        for start, top in zip(starts, tops, strict=True)
    ]
    assert values == pytest.approx(endpoint.log_likelihood(room(), tops) + priors, abs=1e-3)


def test_what_a_map_does_not_know_is_not_wrong() -> None:
    endpoint = reading()
    inside, walls, beyond = [[0.5, 0.5]], [[2.0, 0.0], [0.0, 1.5]], [[6.0, 0.0], [0.0, -5.0]]
    points = np.array(inside + walls + beyond)
    assert endpoint.known_shares(points, Pose2()) == pytest.approx((0.4, 0.2))
    assert endpoint.known_shares(points[:0], Pose2()) == (0.0, 0.0)


def test_free_ground_beside_unknown_ground_knows_no_wall() -> None:
    """The laser looks at a wall 4 m ahead through a sector of 40 degrees."""
    angles = np.radians(np.arange(-20.0, 20.5, 0.5))
    ahead = Scan(4.0 / np.cos(angles), angles, max_range=8.0)
    known, endpoint = Static(), Endpoint()
    for _ in range(5):
        endpoint.refresh(known, known.integrate(ahead, Pose2()))
    points = np.array([[2.0, 0.0], [1.91, 0.585], [4.0, 0.0], [3.8, 1.22], [2.0, 1.0]])
    found = np.zeros(5, np.uint8)
    endpoint.raise_known(found, points, Pose2())
    assert found.tolist() == [KNOWN, 0, EXPLAINED, KNOWN, 0]


def test_a_widened_map_misses_no_place_between_candidates() -> None:
    endpoint, rng = reading(), np.random.default_rng(0)
    few = endpoint.nothing + 0.9 * (endpoint.top - endpoint.nothing)  # mean, of echoes on walls
    coarse = GlobalSearch(endpoint, known=True)
    widened = GlobalSearch(endpoint, known=True, widened=True)
    found = []
    for x, y, theta in rng.uniform(-1.0, 1.0, (50, 3)) * [0.1, 0.1, math.radians(1.0)]:
        points, here = room(Pose2(x, y, theta)).points, np.zeros(3)
        maps = (one.candidates(points, Pose2(), here, least=few) for one in (coarse, widened))
        found.append([len(candidates) for candidates in maps])
    by_coarse, by_widened = np.sum(found, axis=0).tolist()
    assert by_coarse < by_widened == 50
