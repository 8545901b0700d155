"""Settings that make no sense are refused, by name."""

import math

import pytest

import slam
from slam.errors import InputError
from slam.maps.clamped import Clamped
from slam.maps.rays import Rays
from slam.maps.static import Static
from slam.motion.gaussian import OdometryMotion
from slam.motion.threshold import Spacing
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: HillClimb(precision=0.0), "HillClimb.precision"),
        (lambda: Correlative(step=0.0), "Correlative.step"),
        (lambda: GaussNewton(levels=0), "GaussNewton.levels"),
        (lambda: RandomRestart(restarts=-1), "RandomRestart.restarts"),
        (lambda: Static(resolution=0.0), "resolution"),
        (lambda: Static(resolution=math.nan), "resolution"),
        (lambda: Clamped(limit=-1.0), "limit"),
        (lambda: Rays(reach=-1.0), "Rays.reach"),
        (lambda: Spacing(math.nan, 1.0, 1.0), "spacing"),
        (lambda: OdometryMotion(rotation_floor=0.0), "OdometryMotion.rotation_floor"),
        (lambda: OdometryMotion(rotation_per_m=-1.0), "OdometryMotion.rotation_per_m"),
        (lambda: slam.make("static-ml", seed=-1), "seed"),
    ],
)
def test_is_refused(make, said: str):
    with pytest.raises(InputError, match=said):
        make()
