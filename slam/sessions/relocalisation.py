"""Global relocalisation of a new recording in a saved map; and the SLAM that continues there."""

from __future__ import annotations

import math

import numpy as np

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.graph.global_search import GlobalSearch
from slam.graph.local_map import LocalMap
from slam.interface import MapModel, Posterior
from slam.maps.clamped import Clamped
from slam.maps.tiles import TILE
from slam.motion.gaussian import Prediction
from slam.registry import make
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.sensor_models.endpoint import Endpoint
from slam.sessions.session import Session

PATH_LENGTH = 4.0  # m of path of the new recording that are used
MAX_SCANS = 400  # maximum number of its scans, if the robot hardly moves
MIN_HIT_SHARE = 0.6  # minimum share of its echoes that lie on occupied cells
SEARCH_ACCURACY = np.array(
    [0.1, 0.1, math.radians(1.0)]
)  # m, m, rad: accuracy of the global search


def relocated(session: Session, episode: Episode) -> Pose2:
    """The start pose of the episode in the session's map, found without an initial guess.

    The first metres of the episode are mapped separately, and matched with the whole map at all
    headings (branch and bound, Hess et al. 2016). Raises InputError if they fit nowhere.
    """
    before, seen = _sensor_model(session), _panorama(episode)
    cells = before.tiles
    low = np.array(cells.origin)
    size = np.array(cells.index.shape[::-1]) * cells.resolution * TILE
    middle = low + size / 2
    reach = np.array([*(size / 2), math.pi])
    around = Pose2(float(middle[0]), float(middle[1]))
    rough = GlobalSearch(before).best(seen.points, around, reach)
    posterior = Posterior(before, seen, Prediction(rough, Pose2(), SEARCH_ACCURACY))
    pose = Correlative()(posterior, np.random.default_rng(0))
    near, _ = before.shares(seen, pose)
    if near < MIN_HIT_SHARE:
        raise InputError(
            f"the recording does not seem to begin within the map: at the best place, "
            f"{100 * near:.0f} % of its echoes lie on something there, "
            f"of {100 * MIN_HIT_SHARE:.0f} % needed"
        )
    return pose


def empty(variant: str, start: Pose2 = Pose2(), seed: int = 0) -> MaximumLikelihood:
    """A SLAM of the variant, with an empty map to which keyframes can be added. Raises InputError
    if the variant is not a maximum likelihood SLAM, MAP-ml."""
    robot = make(variant, start, seed)
    if not isinstance(robot, MaximumLikelihood):
        raise InputError(f"a map is continued by a variant MAP-ml, such as hmm-ml, got {variant!r}")
    return robot


def continued(session: Session, variant: str, start: Pose2, seed: int = 0) -> MaximumLikelihood:
    """A SLAM of the variant with the session's map and the robot at `start` in it. Raises
    InputError as `empty`."""
    robot = empty(variant, start, seed)
    robot.remember(session.keyframes())
    robot.place(start)
    return robot


def localiser(session: Session, variant: str, start: Pose2, seed: int = 0) -> MaximumLikelihood:
    """As `continued`, but with a frozen map: localisation only."""
    robot = continued(session, variant, start, seed)
    robot.freeze()
    return robot


def _sensor_model(session: Session) -> Endpoint:
    """A sensor model on the map of the session, for matching."""
    map_model: MapModel = Clamped()
    changed = [map_model.integrate(scan, pose) for scan, pose in session.keyframes()]
    reading = Endpoint()
    reading.refresh(map_model, np.unique(np.concatenate(changed)))
    return reading


def _panorama(episode: Episode) -> Scan:
    """The echoes of the first metres of an episode as one scan, in the frame of its first pose."""
    front = MaximumLikelihood()
    local, last = LocalMap([], episode.scans[0]), None
    scans = zip(episode.displacements()[:MAX_SCANS], episode.scans, strict=False)
    for displacement, scan in scans:
        front.update(displacement, scan)
        if last is not None and front.keyframe is not last:
            local.add(scan, front.pose)
        last = front.keyframe
        if local.length >= PATH_LENGTH:
            break
    return local.panorama()
