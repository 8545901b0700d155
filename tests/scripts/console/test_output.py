"""One writer a folder: a lock that ends with the process that holds it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.console.output import own_directory
from slam.errors import InputError

HOLD = """
import sys, time
from pathlib import Path
from dynslam_cli.console.output import own_directory
own_directory(Path(sys.argv[1]))
print("locked", flush=True)
time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path: Path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "locked\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_folder_that_another_process_writes_to_is_refused(tmp_path: Path, holder) -> None:
    """Two benches in one folder did every run twice, without a word."""
    with pytest.raises(InputError, match="another dynslam is writing to it"):
        own_directory(tmp_path)


def test_a_killed_process_leaves_no_lock_and_no_file(tmp_path: Path, holder) -> None:
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    own_directory(tmp_path)
    assert own_directory(tmp_path) == tmp_path, "its own process may ask again"
    assert not list(tmp_path.iterdir())
