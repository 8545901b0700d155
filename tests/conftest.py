"""Fixture: the real logs. Kernels may compile within a test: no test is timed."""

import gc
import os
from pathlib import Path

import pytest
from hypothesis import settings

# torch's idle threads sleep, not spin: several processes share the cores (7 times faster then)
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

# every run tries the same examples; new ones: pytest --hypothesis-profile=default
settings.register_profile("dynslam", deadline=None, derandomize=True)
settings.load_profile("dynslam")


def pytest_collection_finish() -> None:
    """What was imported stays: the garbage collector need not look at a million objects again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real logs beside the repository; tests that need it are skipped without it."""
    folder = Path(__file__).parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the real logs (../shared/data) are not here")
    return folder
