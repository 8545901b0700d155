"""`python -m docs.making.cards`: writes docs/environments.md from the docstrings of the classes.

The page is kept in the repository, to be readable on a code host; a test compares the two.
"""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

from docs.making.films import SECONDS_PER_FRAME
from dynslam_env import PATROLS, WORLDS

PAGE = Path(__file__).parents[1] / "environments.md"
HEAD = """\
<!-- Written by `make docs` from the classes' docstrings. Change those. -->

# Environments

dynslam registers nine Gymnasium environments in which a robot with a laser drives among doors that
open and close: six worlds (corridor, standing doors, loop, office, crowd, wings) and three patrol
tasks for agents. This page has a card of each environment (picture, spaces, time limit) and the
specification of each class: actions, observations, rewards, start, end, arguments. The
specifications are the docstrings of the classes. The settings of the parts are on the page
[dynslam_env](api/dynslam_env.md).

```python
import gymnasium as gym
import dynslam_env  # registers the names below

env = gym.make("DoorCorridor-v0")
observation, info = env.reset(seed=0)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
```

* **Many at once.** `gym.make_vec(ID, 64, threads=2)` steps many worlds at once, with the same
  results, bit for bit, as single environments, if the card says *many at once: yes*; otherwise
  `gym.make_vec` uses Gymnasium's own vector environments.
* **Speed.** A step of `DoorCorridor-v0` takes 14 to 15 us of processor time alone (`gym.make`), and
  9 to 10 us in a vector of 64: 0.62 to 0.68 and 0.39 to 0.41 times the ten physics steps of pymunk
  that it replaces (`dynslam speed --what env`, a busy machine of 2 cores). Where the robot touches
  something, 5 to 6 % of these steps, pymunk makes the step: 60 us. The first contact of an episode
  takes 1 ms more, which these figures leave out. A reset takes 0.5 to 1.7 ms, of patrols 1.3 to 2.4
  on an idle machine ([more](accuracy.md#what-a-step-of-a-world-costs)).
* **By keyboard.** `dynslam play --env DoorLoop-v0` drives the robot while the map grows.
* **With a SLAM.** `SlamWrapper` ([API](api/dynslam_env.md)) adds any SLAM variant to any of the
  worlds. Put a time limit inside of it; around one outside, `FinalScores` adds the last scores.
  `SlamVectorEnv.make("DoorOffice-v0", 8, slam="hmm-ml")` steps many worlds with a SLAM each.
* **Copies.** `copy.deepcopy` and `pickle` copy every environment, also in mid-episode; the copy
  goes on bit for bit as the original ([example](search-a-tree.md)).
* **The wheels.** `odometry` and `velocity` are what the wheels report, with errors. The default
  adds errors to the true motion; with `odometry=dynslam_env.WheelEncoders(wheel_ratio=1.01)` the
  ticks of two wheels are counted, which turn also where the robot pushes a wall. Their errors are
  off unless they are given: where no wheel slips, `WheelEncoders()` is exact but for the ticks.
* **Splits.** `env.reset(options={"split": "test", "index": 17})` begins an episode that is the same
  for everybody; `difficulty="hard"` varies the worlds ([page](splits.md)).
* **Your own.** [Worlds and door laws of your own](your-own.md#world) are registered by name.

The pictures show each environment after 12 s of driving (seed 7): the truth, and beside it the
SLAM's map where a SLAM is inside.
"""


def ids() -> list[str]:
    """The ids that dynslam_env registers, in the order of registration."""
    return [*WORLDS, *PATROLS]


def page() -> str:
    """The whole page: a card of each id, and the docstring of each class once."""
    by_class: dict[str, list[EnvSpec]] = {}
    for name in ids():
        spec = gym.spec(name)
        by_class.setdefault(str(spec.entry_point), []).append(spec)
    parts = [HEAD]
    for entry_point, specs in by_class.items():
        parts += [_card(spec) for spec in specs]
        parts.append(_specification(entry_point, [spec.id for spec in specs]))
    return "\n".join(parts)


def _card(spec: EnvSpec) -> str:
    keywords = ", ".join(f"`{name}={value!r}`" for name, value in spec.kwargs.items()) or "none"
    many = "yes" if spec.vector_entry_point else "no"
    rows = [
        ("class", f"`{str(spec.entry_point).rpartition(':')[2]}`"),
        ("doors, people (seed 0)", _doors_and_people(spec.id)),
        ("registered with", keywords),
        ("solved from a return of", f"{spec.reward_threshold or 'not defined'}"),
        ("scores to compare with", "[of the test split](splits.md#reference-scores)"),
        ("time limit", f"{spec.max_episode_steps} steps" if spec.max_episode_steps else "its own"),
        ("observation", _space(spec.id, "observation_space")),
        ("action", _space(spec.id, "action_space")),
        ("many at once", many),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    return (
        f"## {spec.id}\n\n![{spec.id} after 12 s](worlds/{spec.id}.png)\n\n{_film(spec.id)}"
        f"| id | `{spec.id}` |\n|---|---|\n{table}\n"
    )


def _film(name: str) -> str:
    """The film of an environment; empty without one."""
    film = f"worlds/{name}.gif"
    if not (PAGE.parent / film).exists():
        return ""
    return f"![A drive in {name}, {SECONDS_PER_FRAME[name]:g} s between two pictures]({film})\n\n"


def _space(name: str, which: str) -> str:
    env = gym.make(name)
    space = getattr(env, which)
    env.close()
    if isinstance(space, gym.spaces.Dict):
        return ", ".join(f"`{key}` {tuple(part.shape or ())}" for key, part in space.items())
    return f"`{space}`"


def _doors_and_people(name: str) -> str:
    env = gym.make(name)
    env.reset(seed=0)
    world: Any = env.unwrapped
    for inner in ("patrol", "place"):  # a task around a world
        world = getattr(world, inner, world)
    env.close()
    return f"{len(world.layout.doors)}, {len(world.layout.routes)}"


def _specification(entry_point: str, names: list[str]) -> str:
    module, _, attribute = entry_point.partition(":")
    text = inspect.getdoc(getattr(import_module(module), attribute)) or ""
    head, _, rest = text.partition("\n")
    rest = re.sub(r"^## ", "#### ", rest, flags=re.MULTILINE)
    return f"### {attribute}\n\nThe specification of {_enumeration(names)}. {head}\n{rest}\n"


def _enumeration(names: list[str]) -> str:
    quoted = [f"`{name}`" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
