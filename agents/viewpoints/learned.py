"""Learned: chooses viewpoints by a trained network. Needs `dynslam[train]`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from agents.viewpoints.features import features
from agents.viewpoints.network import ViewpointNetwork, inputs
from agents.viewpoints.situation import Situation
from agents.weights import check_weights
from slam.errors import InputError
from slam.io.arrays import read_arrays
from slam.io.guard import guarded
from slam.io.one_line import one_line


class Learned:
    """The viewpoint with the largest logit, or to explore.

    path  file of `save_network`
    """

    def __init__(self, path: Path):
        self._network = load_network(path)
        torch.set_num_threads(1)

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        fit = np.isfinite([*situation.times, situation.frontier])
        given = inputs(features(situation)[None], fit[None])
        with torch.no_grad():
            return int(self._network(given)[0][0].argmax())


def save_network(network: ViewpointNetwork, path: Path) -> None:
    """Write the weights as arrays of numpy."""
    weights = {name: value.numpy() for name, value in network.state_dict().items()}
    np.savez_compressed(path, allow_pickle=False, **weights)


def load_network(path: Path) -> ViewpointNetwork:
    """Read what `save_network` wrote; no code in the file is run. Raises InputError for others."""
    network = ViewpointNetwork()
    what = "the weights of a viewpoint policy"
    arrays = read_arrays(path, what)
    with guarded(path):
        try:
            weights = {name: torch.from_numpy(arrays[name]) for name in network.state_dict()}
            network.load_state_dict(weights)
            check_weights(network.state_dict())
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise InputError(f"not {what} ({one_line(error)})") from None
    return network.eval()
