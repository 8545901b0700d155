"""Pose graphs, and a slow reference of their cost, pose by pose."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Pose2
from slam.graph.edges import Edge
from slam.graph.pose_graph import PoseGraph

ODOMETRY = np.diag([1 / 0.02**2, 1 / 0.02**2, 1 / math.radians(0.5) ** 2])
LOOP = np.diag([1 / 0.03**2, 1 / 0.03**2, 1 / math.radians(0.5) ** 2])


def error(edge: Edge, poses) -> np.ndarray:
    """The error of an edge's displacement, in the second's frame."""
    first, second = Pose2.of(poses[edge.first]), Pose2.of(poses[edge.second])
    return np.array((first @ edge.displacement).between(second))


def square(edge: Edge, poses) -> float:
    e = error(edge, poses)
    return float(e @ edge.information @ e)


def random_information(rng: np.random.Generator) -> np.ndarray:
    """An information matrix: deviations of 1 to 10 cm and 0.3 to 3 degrees, correlated."""
    root = np.diag(10.0 ** rng.uniform((1, 1, 1.3), (2, 2, 2.3)))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    mixed = root @ (0.7 * np.eye(3) + 0.3 * turn @ np.diag([0.2, 1.0, 2.0]) @ turn.T) @ root
    return (mixed + mixed.T) / 2


def noisy(displacement: Pose2, information, rng: np.random.Generator, share=1.0) -> Pose2:
    """A measured displacement."""
    return displacement @ Pose2.of(
        share * rng.multivariate_normal(np.zeros(3), np.linalg.inv(information))
    )


def ring(n: int, laps=2, length=30.0) -> list[Pose2]:
    """Poses around a circle of so many metres, heading along it."""
    radius = length / math.tau
    return [
        Pose2(radius * math.sin(a), radius * (1 - math.cos(a)), math.remainder(a, math.tau))
        for a in np.arange(n) / n * laps * math.tau
    ]


def chain(truth: list[Pose2], rng: np.random.Generator, share=1.0) -> PoseGraph:
    """A chain of measurements along the truth, with the same first pose."""
    graph = PoseGraph(np.array([truth[0]]))
    for k in range(len(truth) - 1):
        moved = noisy(truth[k].between(truth[k + 1]), ODOMETRY, rng, share)
        graph.add_pose(Pose2.of(graph.poses[-1]) @ moved)
        graph.edges.append(Edge(k, k + 1, moved, ODOMETRY))
    return graph


def loop(truth: list[Pose2], first: int, second: int, rng, off=Pose2()) -> Edge:
    """A measured loop with an outlier error `off`."""
    moved = noisy(truth[first].between(truth[second]), LOOP, rng) @ off
    return Edge(first, second, moved, LOOP, loop=True)
