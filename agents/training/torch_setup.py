"""Torch's threads, memory and tensor layout during training."""

from __future__ import annotations

import contextlib
import ctypes

import torch
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

TORCH_THREADS = 2  # the same on every machine: sums of floats depend on it
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # of glibc's mallopt
KEPT_BYTES, MAX_KEPT_ARRAY = 1 << 30, 1 << 25  # of freed memory, except larger arrays


def configure_torch() -> None:
    """Let torch use TORCH_THREADS threads, and keep memory that one minibatch frees for the next.

    Returning it to the system and fetching it again page by page takes a fifth of the time.
    """
    torch.set_num_threads(TORCH_THREADS)
    with contextlib.suppress(AttributeError, TypeError):  # another C library has no mallopt
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(TRIM_THRESHOLD, KEPT_BYTES)
        mallopt(MMAP_THRESHOLD, MAX_KEPT_ARRAY)


def use_channels_last(model: OnPolicyAlgorithm) -> None:
    """Store the channels of a pixel side by side: convolutions take two thirds of the time, forward
    and backward."""
    model.policy.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
