"""Lasers by name, with the effects of the real ones, as in `laser="SICK-LMS200"`.

Which figures come from data sheets and which are ours is said at each. Data sheets state limits,
not distributions: where one states an accuracy, sigma is chosen from its repeatability. Those of
the LMS200, and noise and beam of the UTM-30LX, are quoted from memory of the data sheets; the
LMS200 is checked against recordings (docs/sensors.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from dynslam_env.sensors.effects import (
    EchoLoss,
    MixedPixels,
    Quantisation,
    RangeNoise,
    Sweep,
)
from dynslam_env.sensors.laser import Laser
from slam.validation import one_of

SICK_LMS200 = Laser(
    beams=181,
    field_of_view=math.pi,
    max_range=80.0,
    sigma=0.005,
    effects=(
        Quantisation(0.01),
        MixedPixels(width=0.0044, merging=1.5),
        EchoLoss(reach=32.0, share=0.0006),
        Sweep(180.0 / 360.0 / 75.0),
    ),
)
"""SICK LMS200, 1 degree, centimetres. Technical description: 80 m, resolution 10 mm, statistical
error 5 mm (1 sigma), 10 m on a surface of 10 %, mirror at 75 Hz, beam of 4.4 mrad.
From the Intel log (docs/sensors.md): `merging`, and the share of echoes lost in spite of their
power. Ours: how sudden weak echoes are lost."""

HOKUYO_UTM_30LX = Laser(
    beams=1081,
    field_of_view=math.radians(270.0),
    max_range=30.0,
    min_range=0.1,
    sigma=0.006,
    effects=(
        RangeNoise(linear=0.0004),
        Quantisation(0.001),
        MixedPixels(width=0.0133, merging=1.5),
        EchoLoss(reach=32.0),
        Sweep(0.025 * 270.0 / 360.0),
    ),
)
"""Hokuyo UTM-30LX. Specification: 0.1 to 30 m, 270 degrees in steps of 0.25, 25 ms a turn, 1 mm,
repeatability below 10 mm to 10 m and below 30 mm to 30 m (sigma here: 10 mm at 10 m, 18 mm at
30 m), spot of 0.4 m at 30 m. Ours: `merging` and reach as those of the LMS200."""

RPLIDAR_A2 = Laser(
    beams=800,
    field_of_view=math.tau * 799.0 / 800.0,
    max_range=12.0,
    min_range=0.15,
    sigma=0.001,
    effects=(
        RangeNoise(quadratic=0.00022),
        Quantisation(0.001),
        MixedPixels(width=0.0044, merging=0.2),
        EchoLoss(reach=17.0),
        Sweep(0.1 * 799.0 / 800.0),
    ),
)
"""Slamtec RPLIDAR A2M8. Data sheet: 0.15 to 12 m on white, 10 Hz, 0.45 degrees, resolution below
0.5 mm to 1.5 m and below 1 % elsewhere; a triangulating laser, so its noise grows with the square
of the range: 0.5 mm at 1.5 m. The reach gives 14 m on a surface of 70 %. Ours: beam, merging,
sigma at the shortest range."""

LASERS: Mapping[str, Laser] = {
    "SICK-LMS200": SICK_LMS200,
    "Hokuyo-UTM-30LX": HOKUYO_UTM_30LX,
    "RPLIDAR-A2": RPLIDAR_A2,
}
"""Lasers by name."""


def laser_named(name: str) -> Laser:
    """The laser of this name; raises InputError for an unknown one."""
    one_of("laser", name, tuple(LASERS))
    return LASERS[name]
