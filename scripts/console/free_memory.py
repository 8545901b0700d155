"""How much memory this process may still take."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

MEMINFO = Path("/proc/meminfo")
GROUP_LIMITS = (  # of a container: (limit, what is used of it)
    (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")),
    (
        Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"),
        Path("/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ),
)


def free_memory() -> float:
    """Bytes that are free on this machine and in this container; infinity if it does not tell."""
    return min([_of_machine(), *(_of_group(limit, used) for limit, used in GROUP_LIMITS)])


def _of_machine() -> float:
    try:
        found = re.search(r"^MemAvailable:\s+(\d+) kB", MEMINFO.read_text(), re.MULTILINE)
        if found:
            return float(found[1]) * 1024
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError, AttributeError):
        return math.inf


def _of_group(limit: Path, used: Path) -> float:
    try:
        return float(limit.read_text()) - float(used.read_text())
    except (OSError, ValueError):  # "max": no limit
        return math.inf
