"""Looks at doorways that are known: how many beams of a scan reach each, and where they end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynslam_env.patrol.echoes import beams_of
from dynslam_env.patrol.open_leaf import open_leaf
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan

MIN_INCIDENCE = 0.2  # sine of the angle between beam and wall: flatter beams are not used
LEAF_TOLERANCE = 0.16  # m of an echo from the wall's middle line that may be the closed leaf's
JAMB_SIDE = 0.06  # m beside a jamb, where echoes may be of its side
INNER_SHARE = 0.75  # of the width of a doorway in which beams count


def looked(scan: Scan, pose: Pose2, places: Array) -> NDArray[np.int64]:
    """(d, 4) of each doorway of `places` (d, 4), x, y, direction, width, m and rad: beams that
    reached it, how many of them ended at it, and 1 if a leaf that stands open is seen, and if one
    seems to stand towards the sensor; see `open_leaf`."""
    sensor, beams = beams_of(scan, pose)
    return _looked(scan.ranges, beams, sensor, scan.max_range, places)


@kernel
def _looked(ranges, beams, sensor, longest, places):
    found = np.empty((len(places), 4), np.int64)
    for d in range(len(places)):
        found[d] = looked_at(ranges, beams, sensor, longest, places[d])
    return found


@kernel
def looked_at(ranges, beams, sensor, longest, place):
    """A row of `looked` for one `place` (4,); `longest`, m, is what the sensor measures. Only the
    inner part of the doorway counts; beams that ended before it do not."""
    ux, uy = np.cos(place[2]), np.sin(place[2])
    dx, dy = place[0] - sensor[0], place[1] - sensor[1]
    half, side, ahead = place[3] / 2, dx * uy - dy * ux, dx * ux + dy * uy
    reached, ended = 0, 0
    for k in range(len(ranges)):
        bx, by = beams[0, k], beams[1, k]
        across = bx * uy - by * ux
        if not ranges[k] > 0.0 or abs(across) < MIN_INCIDENCE:
            continue
        away = side / across
        if away < 0.0 or away > longest - LEAF_TOLERANCE / abs(across):
            continue
        if abs(away * (bx * ux + by * uy) - ahead) > INNER_SHARE * half:
            continue
        behind = (min(ranges[k], longest) - away) * abs(across)
        ends = ranges[k] * (bx * ux + by * uy) - ahead
        if behind < LEAF_TOLERANCE and abs(ends) > half - JAMB_SIDE:
            continue  # it may have met the side of a jamb
        if behind > -LEAF_TOLERANCE:
            reached += 1
            ended += behind < LEAF_TOLERANCE
    leaf, towards = open_leaf(ranges, beams, longest, (ahead, side, half, ux, uy))
    return reached, ended, leaf, towards
