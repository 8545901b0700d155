"""Hyperparameters of an algorithm, from a file in the format of rl_zoo3."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from slam.errors import InputError

ALGORITHMS = ("ppo", "recurrent-ppo")
LINEAR_PREFIX = "lin_"  # of a number that decreases linearly to 0


def read_settings(algorithm: str, env: str, path: Path | None = None) -> dict[str, Any]:
    """The hyperparameters of `env` in `path`, or in dynslam's own file of the algorithm."""
    if path is None:
        text = (
            files("agents.training").joinpath(f"hyperparameters/{algorithm}.yml").read_text("utf-8")
        )
    else:
        text = path.read_text("utf-8")
    where = path or f"the hyperparameters of {algorithm}"
    try:
        known = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(f"{where}: not YAML ({error})") from None
    if not isinstance(known, Mapping) or env not in known:
        names = ", ".join(map(str, known)) if isinstance(known, Mapping) else "none"
        raise InputError(f"{where}: nothing for {env!r}; there is {names}")
    if not isinstance(known[env], Mapping):
        raise InputError(f"{where}: {env!r} needs names and values, got {known[env]!r}")
    return dict(known[env])


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


def _schedule(name: str, text: str) -> Any:
    from stable_baselines3.common.utils import LinearSchedule

    try:
        return LinearSchedule(float(text.removeprefix(LINEAR_PREFIX)), 0.0, 1.0)
    except ValueError:
        raise InputError(f"{name} is a number, or {LINEAR_PREFIX}NUMBER, got {text!r}") from None


def _parsed(text: str) -> dict[str, Any]:
    """The value of a text such as dict(a=1, b=dict(c=[2])), without evaluating code."""
    try:
        found = _value(ast.parse(text.strip(), mode="eval").body)
    except (SyntaxError, TypeError, ValueError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"policy_kwargs is dict(name=value, ...), got {text!r}")
    return found


def _value(node: ast.expr) -> Any:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "dict":
        names = [keyword.arg for keyword in node.keywords]
        if node.args or None in names:
            raise ValueError("only names and values")
        return {str(keyword.arg): _value(keyword.value) for keyword in node.keywords}
    return ast.literal_eval(node)
