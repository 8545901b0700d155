"""Torch's threads, memory and tensor layout during training."""

from __future__ import annotations

import contextlib
import ctypes

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

LEARNING_THREADS = 2  # the same on every machine: sums of floats depend on it
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # of glibc's mallopt
KEPT_BYTES, MAX_KEPT_ARRAY = 1 << 30, 1 << 25  # of freed memory, except larger arrays


def keep_freed_memory() -> None:
    """Keep memory that one minibatch frees for the next: returning it to the system and fetching it
    again page by page takes a fifth of the time."""
    with contextlib.suppress(AttributeError, TypeError):  # another C library has no mallopt
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(TRIM_THRESHOLD, KEPT_BYTES)
        mallopt(MMAP_THRESHOLD, MAX_KEPT_ARRAY)


class Threads(BaseCallback):
    """Torch has LEARNING_THREADS threads while the policy learns, and one while worlds are stepped:
    the second would wait for work in a busy loop, on a core that a worker needs."""

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        torch.set_num_threads(1)

    def _on_rollout_end(self) -> None:
        torch.set_num_threads(LEARNING_THREADS)

    def _on_training_end(self) -> None:
        torch.set_num_threads(1)


def use_channels_last(model: OnPolicyAlgorithm) -> None:
    """Store the channels of a pixel side by side: convolutions take two thirds of the time, forward
    and backward."""
    model.policy.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
