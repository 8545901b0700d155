# pyright: reportMissingImports=false
import time

import pytest
from dynslam_cli.mapping.run_clock import RunClock, in_words

from slam.kernel import COMPILING


def test_compiling_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = RunClock(time.perf_counter() - 100.0)
    monkeypatch.setattr(COMPILING, "seconds", COMPILING.seconds + 60.0)
    told = clock.as_dict()
    assert told["seconds_compiling"] == pytest.approx(60.0)
    assert told["seconds_in_all"] == pytest.approx(40.0, abs=5.0)


def test_in_words() -> None:
    times = {"seconds_in_all": 12.34, "seconds_compiling": 0.2}
    assert in_words(times) == "12.3 s with all files"
    times["seconds_compiling"] = 61.6
    assert in_words(times) == "12.3 s with all files, and 62 s of compiling, this once"
