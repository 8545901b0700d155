"""Memory of this process as reported by the system, MB; 0 if the system does not report it."""

from __future__ import annotations

import ctypes
import gc
import os
from contextlib import suppress
from pathlib import Path

PROCESS = Path("/proc/self")


def resident_mb() -> float:
    """Resident memory now, MB, after garbage collection and returning free memory to the system."""
    gc.collect()
    with suppress(AttributeError, OSError, TypeError):  # glibc only
        ctypes.CDLL(None).malloc_trim(0)
    pages = PROCESS / "statm"
    if not pages.exists():
        return 0.0
    return int(pages.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak_mb() -> float:
    """Peak of resident memory since `forget_peak`, MB."""
    status = PROCESS / "status"
    if not status.exists():
        return 0.0
    peak = next(
        line
        for line in status.read_text(errors="replace").splitlines()
        if line.startswith("VmHWM:")
    )
    return int(peak.split()[1]) * 1024 / 1e6


def forget_peak() -> None:
    """Reset the peak to the memory held now; without permission it stays that of the whole run."""
    with suppress(OSError):
        (PROCESS / "clear_refs").write_text("5")
