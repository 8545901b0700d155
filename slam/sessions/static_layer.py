"""What always stands, of a session: its scans without the echoes of what changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slam.geometry import Pose2, transform_points
from slam.layers import Layers
from slam.layers.classification import CHANGING, DOOR_LEAF, WENT_AWAY
from slam.sessions.session import Session


def of_what_stands(session: Session, made: Layers) -> Session:
    """The session with no reading where an echo lies in a cell of its layers that changes, or whose
    content went away."""
    leaves_out = (made.kind == CHANGING) | np.isin(made.reason, (WENT_AWAY, DOOR_LEAF))
    scans = []
    for scan, row in zip(session.scans, session.poses.tolist(), strict=True):
        rows, cols = made.spec.cells(transform_points(Pose2(*row), scan.points)).T
        ranges = scan.ranges.copy()
        ranges[np.flatnonzero(scan.hit)[leaves_out[rows, cols]]] = np.nan
        scans.append(replace(scan, ranges=ranges))
    return replace(session, scans=tuple(scans))
