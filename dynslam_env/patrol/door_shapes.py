"""Doors by their shape, recognised in a single scan, before the door has moved.

An open door is a gap of a door's width in a straight wall, a closed one a recess, since a leaf
hangs within the depth of its wall (`wall_gaps`). An open leaf may hide the wall at one jamb, or the
wall is short there: then the leaf shows the door (`leaf_doorways`).
"""

from __future__ import annotations

import numpy as np

from dynslam_env.patrol.echoes import beams_of, echoes_of
from dynslam_env.patrol.leaf_doorways import leaf_doorways
from dynslam_env.patrol.wall_gaps import wall_gaps
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan


def suspects(scan: Scan, pose: Pose2) -> Array:
    """(n, 5) x, y of the middle, m; direction of the wall, rad; width, m; 1 if a leaf closes it.
    Doorways seen through another one are among them."""
    sensor, beams = beams_of(scan, pose)
    return _suspects(scan.ranges, scan.angles, beams, sensor, scan.max_range)


@kernel
def _suspects(ranges, angles, beams, sensor, longest):
    echoes = echoes_of(ranges, angles, beams, sensor, longest)
    found = np.empty((len(ranges), 5))
    count = wall_gaps(echoes, found)
    return found[: leaf_doorways(echoes, found, count)]
