import ctypes
import os
import platform
from pathlib import Path

import numpy as np
import pytest

from slam.memory import give_back

PIECE, MANY = 100_000, 1000  # bytes, below those that the C library maps one by one; pieces


def resident() -> int:
    """Bytes of this process in memory."""
    return os.sysconf("SC_PAGE_SIZE") * int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_pieces_that_are_free_are_given_back():
    pieces = [np.ones(PIECE, np.uint8) for _ in range(MANY)]
    kept = pieces[-1]  # lies behind them: the C library would keep them
    pieces.clear()
    before = resident()
    give_back()
    assert before - resident() > 0.8 * PIECE * MANY
    assert kept.all()


@pytest.mark.parametrize("error", [AttributeError, OSError, TypeError])
def test_another_c_library_keeps_its_memory(monkeypatch, error):
    def load(name):
        raise error

    monkeypatch.setattr(ctypes, "CDLL", load)
    give_back()
