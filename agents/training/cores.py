"""Cores: learning has them for itself while the worlds wait for it."""

from __future__ import annotations

import contextlib
import ctypes

import torch
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

THREADS = 2  # whatever the machine and the workers: sums of floats depend on it
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # of glibc's mallopt
KEPT, LARGEST = 1 << 30, 1 << 25  # bytes: all that is freed, but of larger arrays


def use_cores() -> None:
    """Let torch learn in THREADS threads, and keep the memory that a minibatch frees for the next.

    To give it back to the system, and to get it page by page anew, takes a fifth of the time.
    """
    torch.set_num_threads(THREADS)
    with contextlib.suppress(AttributeError, TypeError):  # another C library has no mallopt
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(TRIM_THRESHOLD, KEPT)
        mallopt(MMAP_THRESHOLD, LARGEST)


def lay_out(model: OnPolicyAlgorithm) -> None:
    """Let convolutions keep the channels of a pixel side by side: they take two thirds of the time
    then, forward and backward."""
    model.policy.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
