"""Memory of this process as the system sees it, MB; 0 where the system does not tell."""

from __future__ import annotations

import ctypes
import gc
import os
from contextlib import suppress
from pathlib import Path

PROCESS = Path("/proc/self")


def resident_mb() -> float:
    """Memory that this process holds now; what it has no use for is given back first."""
    gc.collect()
    with suppress(AttributeError, OSError, TypeError):  # glibc's alone
        ctypes.CDLL(None).malloc_trim(0)
    pages = PROCESS / "statm"
    if not pages.exists():
        return 0.0
    return int(pages.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak_mb() -> float:
    """The most that it held since `forget_peak`."""
    status = PROCESS / "status"
    if not status.exists():
        return 0.0
    peak = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
    return int(peak.split()[1]) * 1024 / 1e6


def forget_peak() -> None:
    """The peak is what is held now; where that is not allowed, it stays that of the whole life."""
    with suppress(OSError):
        (PROCESS / "clear_refs").write_text("5")
