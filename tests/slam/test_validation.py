"""Settings that make no sense are refused, by name."""

import math

import pytest

import slam
from slam.errors import InputError
from slam.maps.clamped import Clamped
from slam.maps.rays import Rays
from slam.maps.static import Static
from slam.motion.gaussian import GaussianMotion
from slam.motion.threshold import MotionThreshold
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from slam.validation import number, one_of, unknown_name, whole_number


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: HillClimb(precision=0.0), "HillClimb.precision"),
        (lambda: Correlative(step=0.0), "Correlative.step"),
        (lambda: GaussNewton(levels=0), "GaussNewton.levels"),
        (lambda: RandomRestart(restarts=-1), "RandomRestart.restarts"),
        (lambda: Static(resolution=0.0), "resolution"),
        (lambda: Static(resolution=math.nan), "resolution"),
        (lambda: Clamped(limit=-1.0), "limit"),
        (lambda: Rays(reach=-1.0), "Rays.reach"),
        (lambda: MotionThreshold(math.nan, 1.0, 1.0), "threshold"),
        (lambda: GaussianMotion(rotation_floor=0.0), "GaussianMotion.rotation_floor"),
        (lambda: GaussianMotion(rotation_per_m=-1.0), "GaussianMotion.rotation_per_m"),
        (lambda: slam.make("static-ml", seed=-1), "seed"),
    ],
)
def test_is_refused(make, said: str):
    with pytest.raises(InputError, match=said):
        make()


def test_an_unknown_name_is_answered_with_the_nearest_ones():
    known = ["walk", "wander", "explore"]
    assert unknown_name("agent", "wandr", known) == ("unknown agent 'wandr'; did you mean wander?")
    assert unknown_name("agent", "wandr", known, "agents.names()").endswith(
        "wander? (all 3: agents.names())"
    )


def test_where_no_name_is_near_the_first_ten_are_listed():
    known = [f"world-{k}" for k in range(12)]
    message = unknown_name("world", "zzz", known)
    assert message == f"unknown world 'zzz'; known: {', '.join(known[:10])} and 2 more"
    assert unknown_name("world", "zzz", known[:2]) == "unknown world 'zzz'; known: world-0, world-1"
    assert unknown_name("world", "zzz", []) == "unknown world 'zzz'; known: none"


def test_a_wrong_choice_is_answered_with_the_nearest_and_all():
    allowed = (None, "moving", "static")
    one_of("doors", None, allowed)
    for value, hint in (("statik", "; did you mean 'static'?"), ("ajar", ""), (3, "")):
        with pytest.raises(InputError) as refused:
            one_of("doors", value, allowed)
        assert str(refused.value) == (
            f"doors must be one of None, 'moving', 'static', got {value!r}{hint}"
        )


@pytest.mark.parametrize("value", [2**63, -(2**70), 16**5000], ids=["2**63", "-2**70", "16**5000"])
def test_whole_numbers_beyond_64_bits_are_refused_in_a_line(value: int):
    with pytest.raises(InputError, match=r"seeds must be .* of at least 1, got one beyond 64 bits"):
        whole_number("seeds", value, 1)


def test_a_number_too_large_to_be_written_is_refused_in_a_line():
    with pytest.raises(InputError, match="time must be a finite number, got one beyond 64 bits"):
        number("time", 16**5000)
