"""Hyperparameters of an algorithm, from a file in the format of rl_zoo3."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from slam.errors import InputError
from slam.io.guard import take
from slam.io.one_line import listed, one_line
from slam.io.small_text import parse_text

ALGORITHMS = ("ppo", "recurrent-ppo")
MAX_SETTINGS = 1 << 16  # bytes; rl_zoo3's own files have 4 to 13 kB
MAX_VALUES = 10_000  # in a file, counted again at every reference
MAX_KWARGS = 2000  # characters of policy_kwargs
MAX_PARTS = 100  # values in it
MAX_WIDTH = 4096  # of a layer, or any other number in it
LAYER_BYTES = 64  # of a weight: four gates of an LSTM, its inputs and outputs, twice
LINEAR_PREFIX = "lin_"  # of a number that decreases linearly to 0


def read_settings(algorithm: str, env: str, path: Path | None = None) -> dict[str, Any]:
    """The hyperparameters of `env` in `path`, or in dynslam's own file of the algorithm."""
    own = path is None
    if path is None:
        path = Path(str(files("agents.training").joinpath(f"hyperparameters/{algorithm}.yml")))
    where = f"the hyperparameters of {algorithm}" if own else path
    known = parse_text(path, "YAML", _loaded, MAX_SETTINGS)
    if not isinstance(known, Mapping) or env not in known:
        names = listed(list(map(str, known))) if isinstance(known, Mapping) else "none"
        raise InputError(f"{where}: nothing for {env!r}; there is {names}")
    found = known[env]
    if not (isinstance(found, Mapping) and all(isinstance(name, str) for name in found)):
        raise InputError(f"{where}: {env!r} needs names and values, got {one_line(found)}")
    return dict(found)


class _Loader(yaml.SafeLoader):
    """Plain data; a mapping that merges others (<<) has a bounded number of entries."""

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Merge; raises ValueError where merged mappings double at each of many levels."""
        super().flatten_mapping(node)
        if len(node.value) > MAX_VALUES:
            raise ValueError(f"a mapping of more than {MAX_VALUES} values")


def _loaded(text: str) -> Any:
    """The data of a YAML file; raises ValueError for another, and where references (&name, *name)
    make a small file a huge one, or one without an end."""
    try:
        known = yaml.load(text, _Loader)
    except yaml.YAMLError as error:
        raise ValueError(error) from None
    todo, seen = [known], 0
    while todo:
        value = todo.pop()
        seen += 1
        if seen > MAX_VALUES:
            raise ValueError(f"it holds more than {MAX_VALUES} values")
        if isinstance(value, Mapping):
            todo += [*value.keys(), *value.values()]
        elif isinstance(value, list | tuple | set):
            todo += value
    return known


def arguments(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Hyperparameters as an algorithm's constructor takes them."""
    given = dict(settings)
    for name in ("n_envs", "n_timesteps", "policy"):
        given.pop(name, None)
    for name in ("learning_rate", "clip_range"):
        if isinstance(given.get(name), str):
            given[name] = _schedule(name, given[name])
    if isinstance(given.get("policy_kwargs"), str):
        given["policy_kwargs"] = _parsed(given["policy_kwargs"])
    return given


def check_network(kwargs: object) -> None:
    """Check the policy_kwargs of a file: names, lists and numbers that make a network within the
    budget of the file. Raises InputError."""
    todo, seen, widths = [kwargs], 0, [0.0]
    while todo and seen <= MAX_PARTS:
        value = todo.pop()
        seen += 1
        if isinstance(value, Mapping):
            todo += value.values()
        elif isinstance(value, list | tuple):
            todo += value
        elif isinstance(value, int | float):
            widths.append(abs(value))
    if seen > MAX_PARTS or not max(widths) <= MAX_WIDTH:
        raise InputError(f"policy_kwargs has up to {MAX_PARTS} parts and numbers to {MAX_WIDTH}")
    take(LAYER_BYTES * len(widths) * max(widths) ** 2)


def _schedule(name: str, text: str) -> Any:
    from stable_baselines3.common.utils import LinearSchedule

    try:
        return LinearSchedule(float(text.removeprefix(LINEAR_PREFIX)), 0.0, 1.0)
    except ValueError:
        raise InputError(
            f"{name} is a number, or {LINEAR_PREFIX}NUMBER, got {one_line(text)!r}"
        ) from None


def _parsed(text: str) -> dict[str, Any]:
    """The value of a text such as dict(a=1, b=dict(c=[2])), without evaluating code."""
    try:
        found = _value(ast.parse(text[:MAX_KWARGS].strip(), mode="eval").body)
    except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"policy_kwargs is dict(name=value, ...), got {one_line(text)!r}")
    return found


def _value(node: ast.expr) -> Any:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "dict":
        names = [keyword.arg for keyword in node.keywords]
        if node.args or None in names:
            raise ValueError("only names and values")
        return {str(keyword.arg): _value(keyword.value) for keyword in node.keywords}
    return ast.literal_eval(node)
