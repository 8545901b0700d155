"""What environments are made of: their keywords, and numbers that are none."""

import inspect
import math
from dataclasses import fields, replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import (
    Corridor,
    Doors,
    DoorWorldEnv,
    DoorWorldVectorEnv,
    Exponential,
    Laser,
    Odometry,
    People,
    Periodic,
    Robot,
    Task,
    Uniform,
)
from dynslam_env.patrol.config import PatrolConfig, PatrolKeywords
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.goals import DoorPatrolGoalsEnv
from dynslam_env.patrol.goals_vector import DoorPatrolGoalsVectorEnv
from dynslam_env.patrol.vector import DoorPatrolVectorEnv, PatrolVectorKeywords
from dynslam_env.simulation.config import PlaceKeywords, WorldConfig, WorldKeywords
from dynslam_env.vector import VectorConfig, VectorKeywords, WorldVectorKeywords
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


COLLECTED = ("parts", "keywords")
KINDS = [
    (DoorWorldEnv, WorldKeywords),
    (DoorWorldVectorEnv, WorldVectorKeywords),
    (DoorPatrolEnv, PatrolKeywords),
    (DoorPatrolVectorEnv, PatrolVectorKeywords),
    (DoorPatrolGoalsEnv, PatrolKeywords),
    (DoorPatrolGoalsVectorEnv, PatrolVectorKeywords),
]


@pytest.mark.parametrize(("env", "keywords"), KINDS)
def test_an_unknown_keyword_is_answered_with_all_allowed_ones(env, keywords):
    with pytest.raises(TypeError) as refused:
        env(dors="static")
    told, _, listed = str(refused.value).partition("; allowed are ")
    assert told == f"{env.__name__}() got an unexpected keyword argument 'dors'"
    named = [name for name in inspect.signature(env).parameters if name not in COLLECTED]
    assert listed.split(", ") == [*named, *keywords.__annotations__]
    assert {"world", "doors", "people", "render_mode"} < set(listed.split(", "))


def test_a_patrol_takes_no_task():
    with pytest.raises(TypeError, match="unexpected keyword argument 'task'"):
        DoorPatrolEnv(task=Task())  # type: ignore[call-arg]


def test_gymnasium_passes_the_answer_on():
    with pytest.raises(TypeError, match=r"argument 'dors'; allowed are .* environment creator"):
        gym.make("DoorCorridor-v0", dors="static")


def test_keywords_and_configurations_name_the_same_parts():
    parts = {field.name for field in fields(WorldConfig)}  # a difficulty is part of the world
    assert set(WorldKeywords.__annotations__) == parts | {"difficulty"}
    patrol = set(PatrolKeywords.__annotations__) - set(PlaceKeywords.__annotations__)
    assert patrol == {field.name for field in fields(PatrolConfig)}
    vector = {field.name for field in fields(VectorConfig)}
    assert vector == set(VectorKeywords.__annotations__)


@pytest.mark.parametrize(("env", "keywords"), KINDS)
def test_every_keyword_is_documented(env, keywords):
    first, *_ = [cls for cls, _ in KINDS if cls.__name__ == env.__name__.replace("Vector", "")]
    owners = {DoorWorldEnv: (), DoorPatrolEnv: (DoorWorldEnv,)}
    owners[DoorPatrolGoalsEnv] = (DoorPatrolEnv, DoorWorldEnv)
    text = "".join(inspect.getdoc(cls) or "" for cls in (env, first, *owners[first]))
    named = {name for name in inspect.signature(env).parameters if name not in COLLECTED}
    for name in named | set(keywords.__annotations__):
        assert f"`{name}`" in text, name


def test_none_is_the_default():
    nothing: Any = dict.fromkeys(WorldKeywords.__annotations__)
    assert DoorWorldEnv(**nothing).world_config == DoorWorldEnv().world_config == WorldConfig()
