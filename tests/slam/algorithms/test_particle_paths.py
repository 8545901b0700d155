"""Paths of particles that were resampled: each goes by way of its parents."""

import numpy as np

from slam.algorithms.particle_paths import ParticlePaths
from slam.geometry import Pose2

KEYFRAMES, PARTICLES = 6, 4


def resampled() -> ParticlePaths:
    rng, paths = np.random.default_rng(3), ParticlePaths()
    for _ in range(KEYFRAMES):
        paths.add_keyframe(rng.normal(size=(PARTICLES, 3)), rng.integers(0, PARTICLES, PARTICLES))
        pose = Pose2.of(paths.poses[-1][1])
        paths.add_scan(pose, 1)
        paths.add_scan(pose @ Pose2(0.1, 0.2, 0.3), 1)
    return paths


def by_parents(paths: ParticlePaths, particle: int) -> np.ndarray:
    path = []
    for k in reversed(range(KEYFRAMES)):
        path.append(paths.poses[k][particle])
        particle = int(paths.parents[k][particle])
    return np.array(path[::-1])


def test_the_last_poses_are_those_on_the_path_of_each_particle() -> None:
    paths = resampled()
    for number in (1, 3, KEYFRAMES):
        found = paths.last(number)
        assert len(found) == number
        for particle in range(PARTICLES):
            wanted = by_parents(paths, particle)[KEYFRAMES - number :]
            np.testing.assert_array_equal([poses[particle] for poses in found], wanted)


def test_a_trajectory_has_all_scans_from_the_keyframes_of_one_particle() -> None:
    paths = resampled()
    for particle in range(PARTICLES):
        found, keyframes = paths.trajectory(particle), by_parents(paths, particle)
        assert found.shape == (2 * KEYFRAMES, 3)
        for k, keyframe in enumerate(keyframes):
            there = Pose2.of(keyframe)
            np.testing.assert_allclose(found[2 * k][:2], there[:2], atol=1e-12)
            np.testing.assert_allclose(
                found[2 * k + 1][:2], (there @ Pose2(0.1, 0.2, 0.3))[:2], atol=1e-12
            )


def test_without_a_scan_it_is_empty() -> None:
    assert ParticlePaths().trajectory(0).shape == (0, 3)
