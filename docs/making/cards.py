"""`python -m docs.making.cards`: writes docs/environments.md from the classes' docstrings.

The page is in the repository, so that it reads on a code host too; a test compares the two.
"""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

from dynslam_env import PATROLS, WORLDS

PAGE = Path(__file__).parents[1] / "environments.md"
HEAD = """\
<!-- Written by `make docs` from the classes' docstrings. Change those. -->

# Environments

```python
import gymnasium as gym
import dynslam_env  # registers the names below

env = gym.make("DoorCorridor-v0")
observation, info = env.reset(seed=0)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
```

`gym.make_vec(ID, 64, threads=2)` steps many worlds at once, bit for bit what single ones give,
where a card says *many at once: yes*; elsewhere `gym.make_vec` takes Gymnasium's own.
`dynslam play --env DoorLoop-v0` drives by keyboard, and `SlamWrapper`
([API](api/dynslam_env.md)) puts any SLAM variant into any of the worlds. Each specification below
is its class's docstring. The pictures show each environment after 12 s of driving (seed 7): the
truth, and beside it the SLAM's map where one is inside.
"""


def ids() -> list[str]:
    """The names that dynslam_env registers, in their order."""
    return [*WORLDS, *PATROLS]


def page() -> str:
    """The whole page: a picture and the facts of each name, and each class's docstring once."""
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
        ("doors, people (seed 0)", _inhabitants(spec.id)),
        ("keywords it is registered with", keywords),
        ("time limit", f"{spec.max_episode_steps} steps" if spec.max_episode_steps else "its own"),
        ("observation", _space(spec.id, "observation_space")),
        ("action", _space(spec.id, "action_space")),
        ("many at once", many),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    return (
        f"## {spec.id}\n\n![{spec.id} after 12 s](worlds/{spec.id}.png)\n\n"
        f"| id | `{spec.id}` |\n|---|---|\n{table}\n"
    )


def _space(name: str, which: str) -> str:
    env = gym.make(name)
    space = getattr(env, which)
    env.close()
    if isinstance(space, gym.spaces.Dict):
        return ", ".join(f"`{key}` {tuple(part.shape or ())}" for key, part in space.items())
    return f"`{space}`"


def _inhabitants(name: str) -> str:
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
    return f"### {attribute}\n\nThe specification of {_listed(names)}. {head}\n{rest}\n"


def _listed(names: list[str]) -> str:
    told = [f"`{name}`" for name in names]
    return told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
