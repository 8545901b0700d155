"""The observation of a patrol: map around the robot, coarse scan, velocity, pose uncertainty."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from dynslam_env.patrol.memory import CELL_SIZE, DynamicMap
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.cells import U_MASK, U_SHIFT
from slam.maps.tiles import SHIFT
from slam.scan import Scan

MAP_PIXELS = 40  # of a side of the map
PIXEL_SIZE = 0.25  # m
LAYERS = ("occupied", "seen", "age", "flips")
AGE_SCALE = 20.0  # s: an age whose pixel is 1 - 1 / e
MAX_FLIP_RATE = 0.2  # 1/s: a rate of changes whose pixel is white
SCAN_SECTORS = 24
DEVIATION_RANGE = (1e-3, 1.0)  # m and rad, observed as 0 and 1
LOWER_TRIANGLE = (1, 0), (2, 0), (2, 1)


def observation_space() -> spaces.Dict:
    """See `DoorPatrolEnv`."""
    return spaces.Dict(
        {
            "map": spaces.Box(0, 255, (len(LAYERS), MAP_PIXELS, MAP_PIXELS), np.uint8),
            "scan": spaces.Box(0.0, 1.0, (SCAN_SECTORS,), np.float32),
            "velocity": spaces.Box(-1.0, 1.0, (2,), np.float32),
            "deviations": spaces.Box(0.0, 1.0, (3,), np.float32),
            "correlations": spaces.Box(-1.0, 1.0, (3,), np.float32),
        }
    )


def draw_map(memory: DynamicMap, pose: Pose2, time: float, image: np.ndarray) -> None:
    """Draw the map around `pose` into `image` (layers, MAP_PIXELS, MAP_PIXELS), ahead is up."""
    known = memory.map
    cells = known.cells
    _draw(np.array(pose), cells.tiles.index, cells.tiles.origin, 1 / CELL_SIZE,
          known.since_start(time), cells.occupied.flat, cells.observed.flat, known.times.flat,
          known.counts.flat, known.last.flat, known.prior, image)  # fmt: skip


def sectors(scan: Scan) -> np.ndarray:
    """(SCAN_SECTORS,) nearest echo of each sector of beams, right to left, over the laser's range;
    1 without an echo."""
    return _nearest(scan.ranges, scan.min_range, scan.max_range, SCAN_SECTORS)


def certainty(pose: Pose2, covariance: Array) -> tuple[np.ndarray, np.ndarray]:
    """Uncertainty of the pose along the robot, across it, and in heading: (3,) deviations on a
    logarithmic scale, 1 mm (mrad) as 0 and 1 m (rad) as 1, and (3,) correlations."""
    return _certainty(pose.theta, covariance)


def observe(
    memory: DynamicMap, pose: Pose2, covariance: Array, scan: Scan, velocity: Array,
    limits: tuple[float, float],
) -> dict[str, Any]:  # fmt: skip
    """The whole observation; `velocity` (2,) in m/s and rad/s, of which `limits` are 1."""
    image = np.empty((len(LAYERS), MAP_PIXELS, MAP_PIXELS), np.uint8)
    draw_map(memory, pose, scan.time, image)
    deviations, correlations = certainty(pose, covariance)
    return {
        "map": image,
        "scan": sectors(scan),
        "velocity": np.minimum(np.maximum(velocity / limits, -1.0), 1.0).astype(np.float32),
        "deviations": deviations,
        "correlations": correlations,
    }


@kernel
def _certainty(theta, covariance):
    c, s = np.cos(theta), np.sin(theta)
    turn = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    own = np.zeros((3, 3))
    for i, j, k, m in np.ndindex((3, 3, 3, 3)):
        own[i, j] += turn[i, k] * covariance[k, m] * turn[j, m]
    shown, correlations = np.empty(3, np.float32), np.empty(3, np.float32)
    deviations = np.sqrt(np.maximum(np.diag(own), 1e-12))
    low, high = DEVIATION_RANGE
    for k in range(3):
        shown[k] = np.log(min(max(deviations[k], low), high) / low) / np.log(high / low)
        i, j = LOWER_TRIANGLE[k]
        correlations[k] = min(max(own[i, j] / (deviations[i] * deviations[j]), -1.0), 1.0)
    return shown, correlations


@kernel
def _nearest(ranges, shortest, longest, sectors):
    found = np.ones(sectors, np.float32)
    for k in range(len(ranges)):
        if shortest <= ranges[k] < longest and ranges[k] > 0.0:
            sector = k * sectors // len(ranges)
            found[sector] = min(found[sector], np.float32(ranges[k] / longest))
    return found


@kernel(error_model="numpy")
def _draw(
    pose, index, origin, scale, now, occupied, observed, times, counts, last, prior, image
):  # fmt: skip
    """Each pixel has four samples: their largest P(occupied), age and rate of changes, and the
    share of them that was ever observed."""
    changes, free_for, occupied_for = prior
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    left, low, side = origin[0], origin[1], image.shape[1]
    ahead, beside = _sample_lines(pose, side)
    last_age, shade = 0.0, np.uint8(0)  # and how it is drawn
    for row in range(side):
        for col in range(side):
            most, seen, oldest, restless = 0.0, 0, 0.0, 0.0
            for part in range(4):
                x = (ahead[row, part & 1, 0] + beside[col, part >> 1, 0] - left) * scale
                y = (ahead[row, part & 1, 1] + beside[col, part >> 1, 1] - low) * scale
                if not (0.0 <= x < cols and 0.0 <= y < rows):
                    continue
                u, v = np.uint64(x), np.uint64(y)
                cell = ((v & U_MASK) << U_SHIFT) + (u & U_MASK)
                i = (np.uint64(index[v >> U_SHIFT, u >> U_SHIFT]) << (U_SHIFT + U_SHIFT)) + cell
                if not observed[i]:
                    continue
                seen += 1
                gone, h, flips = now - last[i], occupied[i], counts[i, 0] + counts[i, 1]
                if flips > 0:
                    if gone > 0.0:
                        closing = (changes + counts[i, 1]) / (free_for + times[i, 0])
                        opening = (changes + counts[i, 0]) / (occupied_for + times[i, 1])
                        stationary = closing / (closing + opening)
                        h = stationary + np.exp(-(closing + opening) * gone) * (h - stationary)
                    watched = max(times[i, 0] + times[i, 1], 10.0)
                    restless = max(restless, flips / watched)
                most, oldest = max(most, h), max(oldest, gone)
            if not seen:
                image[0, row, col], image[1, row, col] = 128, 0
                image[2, row, col], image[3, row, col] = 255, 0
                continue
            if oldest != last_age:
                last_age, shade = oldest, np.uint8(255.0 * (1.0 - np.exp(-oldest / AGE_SCALE)))
            image[0, row, col], image[1, row, col] = np.uint8(255.0 * most), np.uint8(63.75 * seen)
            image[2, row, col] = shade
            image[3, row, col] = np.uint8(255.0 * min(restless / MAX_FLIP_RATE, 1.0))


@kernel
def _sample_lines(pose, side):
    """(side, 2, 2) x and y, m, world, of the two samples in each row of pixels, ahead of the robot,
    and what the two samples of each column add to them."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    ahead, beside = np.empty((side, 2, 2)), np.empty((side, 2, 2))
    for k in range(side):
        for half in range(2):
            at = ((side - 1) / 2 - k + 0.5 * half - 0.25) * PIXEL_SIZE
            ahead[k, half, 0], ahead[k, half, 1] = pose[0] + c * at, pose[1] + s * at
            beside[k, half, 0], beside[k, half, 1] = -s * at, c * at
    return ahead, beside
