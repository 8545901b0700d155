"""Writes a table of scans as a rawlog of MRPT: `python write_rawlog.py LOG.csv DRIVE.rawlog`.

Pairs of an action (the odometry's displacement) and a sensory frame (a scan), gzipped: what
icp-slam and rbpf-slam read. MRPT's carmen2rawlog 2.5.8 cannot be used: it gives every scan the time
of its own run, half the angle between beams, and no actions, without which rbpf-slam crashes.
"""

from __future__ import annotations

import gzip
import math
import struct
import sys

import numpy as np
from scan_table import ScanTable, read_table  # beside this file

END = b"\x88"  # after every object
FROM_ODOMETRY = 0
GAUSSIAN = 0
# Deviations of the Gaussian motion model as MRPT has them: a1 to a4; at rest, m and rad.
OWN_MOTION = (0.01, math.degrees(0.001), math.radians(1.0), 0.05, 0.01, math.radians(0.2))
MOTION = tuple(4.0 * value for value in OWN_MOTION)  # chosen on seeds 1000 and 1001: docs/rivals.md
UNUSED_MOTION = (0.05, math.radians(4.0), 0.01, math.degrees(1e-4), 0.001, math.radians(0.05))
PARTICLES = 300  # of the motion model that is not used
TICKS_1970 = 116_444_736_000_000_000  # of 100 ns, from 1601 to 1970
START = 1_000_000_000.0  # s since 1970, the time of 0 s: MRPT takes a time of 0 for none
RANGE_DEVIATION = 0.01  # m


def made(kind: str, version: int, content: bytes) -> bytes:
    """An object in MRPT's serialization."""
    name = kind.encode()
    return bytes([0x80 | len(name)]) + name + bytes([version]) + content + END


def ticks(time: float) -> bytes:
    """A time, s, as MRPT's time stamp."""
    return struct.pack("<Q", TICKS_1970 + round(1e7 * (START + time)))


def action(moved: np.ndarray, time: float) -> bytes:
    """The odometry's displacement (3,), m and rad, since the last scan."""
    content = struct.pack("<I", FROM_ODOMETRY)
    content += made("mrpt::poses::CPose2D", 1, struct.pack("<3d", *moved))
    content += struct.pack("<I6f", GAUSSIAN, *MOTION)
    content += struct.pack("<I6f", PARTICLES, *UNUSED_MOTION)
    content += struct.pack("<?2f?2i", False, 0.0, 0.0, False, 0, 0) + ticks(time)
    movement = made("mrpt::obs::CActionRobotMovement2D", 6, content)
    return made("mrpt::obs::CActionCollection", 0, struct.pack("<I", 1) + movement)


def frame(table: ScanTable, k: int) -> bytes:
    """Scan k."""
    ranges, step = table.ranges[k], table.head["angle_increment"][0]
    x, y, turn = table.head["mount"]
    far = table.head["range_max"][0]
    middle = turn + table.head["angle_min"][0] + step * (len(ranges) - 1) / 2
    seen = (ranges < far) & (ranges > table.head["range_min"][0])
    c, s = math.cos(middle), math.sin(middle)
    pose = struct.pack("<3d9d", x, y, 0.0, c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
    content = struct.pack("<f?f", abs(step) * (len(ranges) - 1), step > 0, far)
    content += made("mrpt::poses::CPose3D", 3, pose) + struct.pack("<I", len(ranges))
    content += np.where(seen, ranges, far).astype("<f4").tobytes() + seen.astype("u1").tobytes()
    content += struct.pack("<f", RANGE_DEVIATION) + ticks(float(table.times[k]))
    content += struct.pack("<fI5sd?", 0.0, 5, b"LASER", 0.0, False)
    scan = made("mrpt::obs::CObservation2DRangeScan", 7, content)
    return made("mrpt::obs::CSensoryFrame", 2, struct.pack("<I", 1) + scan)


def displacements(poses: np.ndarray) -> np.ndarray:
    """(n, 3) from each pose to the next, in the frame of the first of them; the first is zero."""
    step = np.diff(poses, axis=0, prepend=poses[:1])
    theta = np.concatenate([poses[:1, 2], poses[:-1, 2]])
    c, s = np.cos(theta), np.sin(theta)
    x, y = c * step[:, 0] + s * step[:, 1], c * step[:, 1] - s * step[:, 0]
    return np.column_stack([x, y, np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))])


def main(log: str, out: str) -> None:
    """Read, write."""
    table = read_table(log)
    with gzip.open(out, "wb", compresslevel=1) as file:
        for k, moved in enumerate(displacements(table.poses)):
            file.write(action(moved, float(table.times[k])) + frame(table, k))


if __name__ == "__main__":
    main(*sys.argv[1:])
