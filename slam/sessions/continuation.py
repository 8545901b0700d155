"""The SLAM that continues a saved map, or localises in it."""

from __future__ import annotations

from slam.algorithms.graph_slam import GraphSlam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.errors import InputError
from slam.geometry import Pose2
from slam.recovery.watch import Watch
from slam.registry import make
from slam.sessions.session import Session


def empty(variant: str, start: Pose2 = Pose2(), seed: int = 0) -> MaximumLikelihood | GraphSlam:
    """A SLAM of the variant, with an empty map to which keyframes can be added. Raises InputError
    if the variant is neither a maximum likelihood SLAM, MAP-ml, nor a graph, MAP-graph."""
    robot = make(variant, start, seed)
    if not isinstance(robot, MaximumLikelihood | GraphSlam):
        raise InputError(
            f"a map is continued by a variant MAP-ml or MAP-graph, such as hmm-ml, got {variant!r}"
        )
    return robot


def continued(
    session: Session, variant: str, start: Pose2, seed: int = 0
) -> MaximumLikelihood | GraphSlam:
    """A SLAM of the variant with the session's map and the robot at `start` in it. Raises
    InputError as `empty`."""
    robot = empty(variant, start, seed)
    robot.remember(session.keyframes())
    robot.place(start)
    return robot


def localiser(session: Session, variant: str, start: Pose2, seed: int = 0) -> MaximumLikelihood:
    """As `continued`, but with a frozen map: localisation only. That of a graph is maximum
    likelihood on its map model: in a known map there are no loops to close. It notices that it is
    lost, whatever the variant."""
    robot = empty(variant, start, seed)
    if isinstance(robot, GraphSlam):
        robot = MaximumLikelihood(
            start, robot.rng, map_model=robot.map_model(), sensor_model=robot.sensor_model(),
            motion_model=robot.motion_model, search=robot.search,
        )  # fmt: skip
    robot.watch = robot.watch or Watch()
    robot.remember(session.keyframes())
    robot.place(start)
    robot.freeze()
    return robot
