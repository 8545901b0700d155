"""Worlds and door laws of one's own, by name."""

from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import dynslam_env
from dynslam_env import Corridor, Fixed, FlipClock, Layout, Uniform, register_law, register_world
from dynslam_env.simulation.registry import NAMED_LAWS, NAMED_WORLDS
from slam import InputError, plugins

IDS = ["DoorCorridor-v0", "DoorPatrol-v0", "DoorPatrolGoals-v0"]
WORLDS, LAWS = ("corridor", "loop", "office", "crowd", "wings"), ("moving", "static")


class Room:
    """A square room without doors."""

    def layout(self, rng):
        walls = [(0, 0, 5, 0), (5, 0, 5, 5), (5, 5, 0, 5), (0, 5, 0, 0)]
        return Layout(np.array(walls), (), (1.0, 2.5, 0.0), np.array([(4.0, 2.5)]))  # type: ignore


@dataclass(frozen=True)
class Together:
    """All doors flip at once, every `period` s."""

    period: float = 1.0

    def initial_states(self, is_open, rng):
        return np.zeros_like(is_open)

    def clock(self, count, rng):
        return FlipClock(((self.period, door) for door in range(count)), lambda: self.period)


@pytest.fixture
def own_names(monkeypatch):
    """What a test registers is gone after it, and no entry point was read before."""
    for table in (NAMED_WORLDS, NAMED_LAWS):
        monkeypatch.setattr(table, "_parts", dict(table._parts))
        monkeypatch.setattr(table, "_discovered", False)


def test_the_built_in_names_are_in_the_same_tables():
    assert NAMED_WORLDS.names()[:5] == WORLDS
    assert NAMED_LAWS.names()[:2] == LAWS
    assert NAMED_WORLDS.get("crowd") == Corridor(people=6)
    assert (NAMED_LAWS.get("moving"), NAMED_LAWS.get("static")) == (Uniform(), Fixed())


def walls(env: Any) -> np.ndarray:
    world = env.unwrapped
    for inner in ("patrol", "place"):  # a task around a world
        world = getattr(world, inner, world)
    return world.layout.walls


@pytest.mark.parametrize("id", IDS)
def test_a_world_of_ones_own_works_by_name(own_names, id):
    register_world("room", Room())
    env = gym.make(id, world="room")
    env.reset(seed=0)
    assert walls(env).tolist() == Room().layout(None).walls.tolist()
    env.close()


@pytest.mark.parametrize("id", IDS[:2])
def test_a_world_of_ones_own_works_by_name_in_vector_environments(own_names, id):
    register_world("room", Room())
    envs: Any = gym.make_vec(id, 2, world="room")
    envs.reset(seed=0)
    assert [world.openings.shape for world in envs.physics] == [(0,), (0,)]
    envs.close()


def test_a_law_of_ones_own_works_by_name(own_names):
    register_law("together", Together(0.5))
    by_name, by_object = (
        gym.make("DoorCorridor-v0", doors=law) for law in ("together", Together(0.5))
    )
    (_, info), (_, other) = by_name.reset(seed=3), by_object.reset(seed=3)
    assert (info["door_angles"] == 0.0).all()
    for _ in range(10):
        info = by_name.step(np.zeros(2, dtype=np.float32))[4]
        other = by_object.step(np.zeros(2, dtype=np.float32))[4]
        assert info["door_angles"].tobytes() == other["door_angles"].tobytes()
    assert (info["door_angles"] > 0.0).any()  # each that is not blocked has begun to open


@pytest.mark.parametrize(
    ("register", "part", "keyword"),
    [(register_world, Room(), "world"), (register_law, Together(), "doors")],
)
def test_wrong_registrations_are_refused(own_names, register, part, keyword):
    own = {"world": "loop", "doors": "static"}[keyword]
    for name in ("", "my own", "a,b", "tab\t"):
        with pytest.raises(InputError, match=f"a name for {keyword}= has no spaces or commas"):
            register(name, part)
    with pytest.raises(InputError, match=f"{keyword}='{own}' is dynslam's own"):
        register(own, part)
    for wrong in (3, type(part)):
        with pytest.raises(InputError, match=f"{keyword}='mine' must be a"):
            register("mine", wrong)
    assert (NAMED_WORLDS.names(), NAMED_LAWS.names()) == (WORLDS, LAWS)


def test_an_unknown_name_is_answered_with_all_known_ones(own_names):
    register_world("room", Room())
    register_law("together", Together())
    wrongs: list[dict[str, Any]] = [{"world": "rooms"}, {"doors": "togethre"}]
    for wrong in wrongs:
        with pytest.raises(InputError) as refused:
            dynslam_env.DoorWorldEnv(**wrong)
        for name in (
            *wrong.values(),
            *(("room", *WORLDS) if "world" in wrong else ("together", *LAWS)),
        ):
            assert repr(name) in str(refused.value)


def test_entry_points_of_installed_packages_are_found(own_names, monkeypatch):
    here = __name__
    installed = {
        "dynslam.worlds": [("room", "ROOM"), ("broken", "missing"), ("loop", "ROOM")],
        "dynslam.laws": [("together", "TOGETHER")],
    }

    def entry_points(group):
        return [EntryPoint(name, f"{here}:{value}", group) for name, value in installed[group]]

    monkeypatch.setattr(plugins, "entry_points", entry_points)
    with pytest.warns(UserWarning, match="dynslam.worlds 'broken'"):
        env = gym.make("DoorCorridor-v0", world="room", doors="together")
    assert NAMED_WORLDS.names() == (*WORLDS, "room")
    assert NAMED_LAWS.names() == (*LAWS, "together")
    env.reset(seed=0)
    assert len(walls(env)) == 4


ROOM, TOGETHER = Room(), Together()
