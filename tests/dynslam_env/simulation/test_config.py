"""No setting of dynslam_env takes a number that is none."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from dynslam_env import (
    Corridor,
    Doors,
    Exponential,
    Laser,
    Odometry,
    People,
    Periodic,
    Robot,
    Task,
    Uniform,
)
from slam import InputError, Pose2

LAWS = (Uniform(), Exponential(), Periodic())
SETTINGS = (Corridor(), Doors(), Laser(), Odometry(), People(), Robot(), Task(), *LAWS)
NUMBERS = [
    (settings, field.name)
    for settings in SETTINGS
    for field in fields(settings)
    if isinstance(getattr(settings, field.name), int | float)
]
NOT_FINITE = (math.nan, math.inf, -math.inf)
LAYOUT = Corridor().layout(np.random.default_rng(0))


def test_every_kind_of_settings_is_asked():
    assert {type(settings) for settings, _ in NUMBERS} == {type(each) for each in SETTINGS}


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize(("settings", "name"), NUMBERS)
def test_numbers_are_finite(settings, name, value):
    with pytest.raises(InputError, match=rf"{type(settings).__name__}\.{name} must be"):
        replace(settings, **{name: value})


@pytest.mark.parametrize("value", NOT_FINITE)
def test_numbers_within_settings_are_finite(value):
    with pytest.raises(InputError, match=r"Laser\.mount must hold finite numbers"):
        Laser(mount=Pose2(0.1, value, 0.0))
    with pytest.raises(InputError, match=r"Task\.reward\['time'\] must be a finite number"):
        Task(reward={"time": value})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"walls": np.full((3, 4), math.nan)}, r"Layout\.walls must hold finite"),
        ({"walls": np.zeros((3, 2))}, r"Layout\.walls must have shape \(n, 4\), got \(3, 2\)"),
        ({"path": np.array([(0.0, 0.0), (math.inf, 0.0)])}, r"Layout\.path must hold finite"),
        ({"path": np.empty((0, 2))}, r"Layout\.path needs at least one waypoint"),
        ({"start": Pose2(0.0, 0.0, math.nan)}, r"Layout\.start must hold finite"),
        ({"doors": (LAYOUT.doors[0]._replace(width=math.inf),)}, r"door of Layout\.doors"),
        ({"doors": (LAYOUT.doors[0]._replace(hinge=(math.nan, 0.0)),)}, r"door of Layout\.doors"),
    ],
)
def test_layouts_are_finite(wrong, message):
    with pytest.raises(InputError, match=message):
        replace(LAYOUT, **wrong)
