"""Small valid files of policies and checkpoints, and what uses them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from gymnasium.spaces import Dict
from stable_baselines3 import PPO

from agents.trained import Trained
from agents.training.policy_file import restore, save_model, write_slim
from agents.viewpoints.learned import load_network, save_network
from agents.viewpoints.network import ViewpointNetwork
from dynslam_env.patrol.env import DoorPatrolEnv

NETWORK = {"net_arch": [4]}


@cache
def _patrol() -> Any:
    """An environment with few observations: its policy is small, and read in a millisecond."""
    env = DoorPatrolEnv()
    every = cast(Dict, env.observation_space)
    env.observation_space = Dict({name: every[name] for name in ("deviations", "velocity")})
    return env


@cache
def _model() -> Any:
    model = PPO(
        "MultiInputPolicy", _patrol(), n_steps=2, batch_size=2, policy_kwargs=NETWORK, seed=0
    )
    for weight in model.policy.parameters():
        weight.square().sum().backward()
    model.policy.optimizer.step()  # as after a segment: with moments
    return model


def save_sample(path: Path) -> Path:
    """Of checkpoint.zip."""
    settings = {"policy": "MultiInputPolicy", "policy_kwargs": "dict(net_arch=[4])"}
    training = {"env": "DoorPatrol-v0", "algorithm": "ppo", "settings": settings}
    save_model(_model(), training, path)
    return path


def slim_sample(path: Path) -> None:
    """Of best.zip."""
    write_slim(save_sample(path), path)


def viewpoints_sample(path: Path) -> None:
    """Of best.npz."""
    torch.manual_seed(0)
    save_network(ViewpointNetwork(), path)


def read_trained(path: Path) -> object:
    """As an agent that acts."""
    agent = Trained(path, _patrol())
    seen = {"deviations": np.zeros(3, np.float32), "velocity": np.zeros(2, np.float32)}
    assert np.isfinite(agent.predict(seen)[0]).all(), "an action is no number"
    return agent


def read_checkpoint(path: Path) -> object:
    """As a training that goes on."""
    model = _model()
    restore(model, path)
    state = model.policy.state_dict().values()
    assert all(bool(weight.isfinite().all()) for weight in state), "a weight is no number"
    return model


def read_viewpoints(path: Path) -> object:
    """As the network that chooses viewpoints."""
    weights = load_network(path).state_dict().values()
    assert all(bool(weight.isfinite().all()) for weight in weights), "a weight is no number"
    return weights
