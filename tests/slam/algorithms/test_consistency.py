"""Whether errors are as large as `Estimate.covariance` says, in the built-in worlds."""

from functools import cache

import numpy as np
import pytest

from agents import record_path
from dynslam_env import Odometry
from slam.benchmark.run import Playback, build
from slam.episode import Episode
from slam.geometry import Array, wrap_angle

GOOD = Odometry(bias=0.02, alpha1=0.0004, alpha2=0.0001, alpha3=0.0004, alpha4=0.0001)
SEEDS = (300, 301, 302, 303)  # on which nothing was chosen
FIRST = 20  # scan; before, the pose is still known exactly


@cache
def drive(world: str, seed: int) -> Episode:
    """With the paper's odometry on even seeds, with a good one on odd ones."""
    return record_path(world, seed, odometry=GOOD if seed % 2 else Odometry())


def normalised(errors: Array, covariances: Array) -> float:
    """The mean of e' P^-1 e / 3: 1 where the errors are as large as claimed."""
    return float((errors * np.linalg.solve(covariances, errors[..., None])[..., 0]).mean())


def consistency(variant: str, episode: Episode) -> float:
    assert episode.truth is not None
    estimates = list(Playback(build(variant, episode), episode))
    errors = np.array([estimate.pose for estimate in estimates]) - episode.truth.poses
    errors[:, 2] = wrap_angle(errors[:, 2])
    covariances = np.array([estimate.covariance for estimate in estimates])
    return normalised(errors[FIRST:], covariances[FIRST:])


def test_errors_of_the_claimed_covariance_are_consistent() -> None:
    covariance = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]])
    errors = np.random.default_rng(0).multivariate_normal(np.zeros(3), covariance, 20_000)
    assert normalised(errors, np.tile(covariance, (20_000, 1, 1))) == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize(
    ("variant", "world"),
    [
        *(("static-ml", world) for world in ("DoorCorridor-v0", "DoorLoop-v0", "DoorOffice-v0")),
        *(("dynamic-ml", world) for world in ("DoorCorridor-v0", "DoorCrowd-v0")),
        *(("dynamic-graph", world) for world in ("DoorCorridor-v0", "DoorLoop-v0")),
        ("static-pf", "DoorCorridor-v0"),
        ("static-ml/beta1", "DoorCorridor-v0"),
    ],
)
def test_errors_are_as_large_as_the_covariance_says(variant: str, world: str) -> None:
    found = [consistency(variant, drive(world, seed)) for seed in SEEDS]
    assert 0.5 < np.mean(found) < 2.0, found
