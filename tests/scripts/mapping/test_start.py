# pyright: reportMissingImports=false
"""What is made of --start, given how it compares with the other places of the map."""

import math

import pytest
from dynslam_cli.mapping.start import judged, parsed_pose

from slam.errors import InputError
from slam.geometry import Pose2
from slam.recovery.agreement import Agreement
from slam.recovery.places import Place
from slam.sessions.relocalisation import Comparison

GIVEN, ELSEWHERE, THIRD = Pose2(1.0, 2.0, 0.5), Pose2(8.0, -3.0, 2.0), Pose2(-5.0, 4.0, 0.0)
GOOD, BAD = Agreement(0.9, 0.02), Agreement(0.3, 0.4)


def test_a_start_that_fits_best_is_used_where_the_echoes_put_it():
    near = GIVEN @ Pose2(0.1, 0.05, 0.02)
    place = Place(near, -20.0, GOOD)
    start = judged(GIVEN, Comparison(place, Place(ELSEWHERE, -60.0, BAD), place, 4.0))
    assert start == (near, ())


def test_a_start_that_is_off_is_mended_and_told():
    near = GIVEN @ Pose2(0.4, 0.0, math.radians(3.0))
    place = Place(near, -20.0, GOOD)
    start = judged(GIVEN, Comparison(place, Place(ELSEWHERE, -60.0, BAD), place, 4.0))
    assert start.pose == near
    assert "off by 0.40 m and 3 degrees" in start.warnings[0]


def test_a_start_that_fits_nearly_as_well_as_another_is_believed():
    given = Place(GIVEN, -22.0, GOOD)
    start = judged(GIVEN, Comparison(Place(ELSEWHERE, -20.0, GOOD), given, given, 32.0))
    assert start == (GIVEN, ())


def test_a_start_is_replaced_by_a_place_that_is_unique():
    best, other = Place(ELSEWHERE, -20.0, GOOD), Place(THIRD, -60.0, BAD)
    start = judged(GIVEN, Comparison(best, other, Place(GIVEN, -90.0, BAD), 4.0))
    assert start.pose == ELSEWHERE
    (told,) = start.warnings
    assert told.startswith("--start 1.00 2.00 28.6 seems to be wrong: 30 % of the echoes")
    assert "used instead: --start 8.00 -3.00 114.6, where 90 % of them do" in told
    assert "by 40 nats" in told


@pytest.mark.parametrize(
    ("best", "other"),
    [
        (Place(ELSEWHERE, -20.0, GOOD), Place(THIRD, -22.0, GOOD)),
        (Place(ELSEWHERE, -70.0, BAD), Place(THIRD, -88.0, BAD)),
    ],
    ids=["two fit as well", "none fits"],
)
def test_a_wrong_start_is_kept_and_told_where_no_other_place_is_certain(best: Place, other: Place):
    start = judged(GIVEN, Comparison(best, other, Place(GIVEN, -90.0, BAD), 32.0))
    assert start.pose == GIVEN
    (told,) = start.warnings
    assert "seems to be wrong" in told
    assert "used as given. It may be --start 8.00 -3.00 114.6" in told


def test_a_start_that_fits_badly_is_told_even_where_no_place_fits_better():
    given = Place(GIVEN, -70.0, BAD)
    start = judged(GIVEN, Comparison(given, Place(ELSEWHERE, -90.0, BAD), given, 32.0))
    assert start.pose == GIVEN
    assert "30 % of the echoes" in start.warnings[0]
    assert start.warnings[0].endswith("no other place fits better; used as given")


def test_a_start_is_given_in_degrees():
    assert parsed_pose("--start", None) is None
    assert parsed_pose("--start", (1.0, 2.0, 180.0)) == Pose2(1.0, 2.0, math.pi)
    with pytest.raises(InputError, match="three finite numbers"):
        parsed_pose("--start", (1.0, math.inf, 0.0))
