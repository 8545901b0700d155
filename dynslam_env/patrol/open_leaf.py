"""The leaf of a door that stands open: echoes in a row at a jamb, square to the wall.

Unlike a wall that meets the doorway there, a leaf ends: beams pass its line beyond its width.
"""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel

MIN_DEPTH = 0.2  # m from the wall: nearer, an echo may be the wall's
BAND = 0.12  # m of a leaf's echoes from the line square to the wall at the jamb
MIN_ECHOES, MIN_LENGTH = 4, 0.35  # of a leaf; m
OVERHANG = 0.15  # m, by which a leaf reaches farther than its width, from the wall's other face
PAST = 0.25, 0.75  # m, beyond a leaf's width from the wall, where beams must pass its line
MIN_PASSED = 2  # of these beams


@kernel
def open_leaf(ranges, beams, longest, doorway):
    """Whether a leaf is seen that stands open on either side of the wall, and whether a row of
    echoes, which may be a wall's, is seen on the sensor's side.

    beams    (2, n) cosines and sines of the bearings
    doorway  m, along the wall and across it from the sensor to the middle; half the width, m; the
             wall's direction as cosine and sine
    """
    ahead, side, half, ux, uy = doorway
    echoes, nearest, farthest = np.zeros((2, 2)), np.full((2, 2), np.inf), np.zeros((2, 2))
    passed, ended = np.zeros((2, 2)), np.zeros((2, 2))
    longest_leaf, least, most = 2.0 * half + OVERHANG, 2.0 * half + PAST[0], 2.0 * half + PAST[1]
    for k in range(len(ranges)):
        if not ranges[k] > 0.0:
            continue
        forth = beams[0, k] * ux + beams[1, k] * uy
        across = (beams[0, k] * uy - beams[1, k] * ux) * np.sign(side)
        away = min(ranges[k], longest)
        along, deep = away * forth - ahead, away * across - abs(side)
        for jamb in range(2):
            at, behind = (half if jamb else -half), int(deep > 0.0)
            if ranges[k] < longest and abs(along - at) < BAND:
                if MIN_DEPTH < abs(deep) < longest_leaf:
                    echoes[jamb, behind] += 1
                    nearest[jamb, behind] = min(nearest[jamb, behind], abs(deep))
                    farthest[jamb, behind] = max(farthest[jamb, behind], abs(deep))
                elif least < abs(deep) < most:
                    ended[jamb, behind] += 1
            crossed = (ahead + at) / forth if forth != 0.0 else -1.0  # m to the leaf's line
            depth = crossed * across - abs(side)
            if 0.0 < crossed < away - BAND and least < abs(depth) < most:
                passed[jamb, int(depth > 0.0)] += 1
    row = (echoes >= MIN_ECHOES) & (farthest - nearest >= MIN_LENGTH)
    leaf = row & (passed >= MIN_PASSED) & (ended == 0)
    return int(leaf.any()), int(row[:, 0].any())
