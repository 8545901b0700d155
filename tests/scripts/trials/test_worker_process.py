# pyright: reportMissingImports=false, reportArgumentType=false
"""The process that does jobs, and what it may leave behind."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
from dynslam_cli.trials.jobs import Done
from dynslam_cli.trials.worker_process import WorkerProcess


@dataclass(frozen=True)
class Task:
    """Does one of these."""

    what: str
    limit: float = 30.0
    file: str = ""  # that a process which is left behind makes when it ends by itself

    def __call__(self) -> Done:
        if self.what == "forks" and os.fork() == 0:
            time.sleep(60)
            open(self.file, "x").close()
        if self.what == "works long":
            sleeper = subprocess.Popen(["sleep", "60"])
            Path(self.file).write_text(f"{os.getpid()} {sleeper.pid}")
            time.sleep(60)
        if self.what in ("forks", "leaves"):
            os._exit(5)
        if self.what == "talks":
            print("noise " * 1000, file=sys.stderr, flush=True)
        return Done({"pid": os.getpid()})

    def row(self) -> dict[str, object]:
        return {}


@pytest.fixture
def keeper():
    made = WorkerProcess()
    yield made
    made.stop()


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
def test_one_that_dies_is_told_at_once_though_what_it_started_holds_its_pipes(keeper, tmp_path):
    late = tmp_path / "late"
    done = keeper.do(Task("forks", file=str(late)))
    assert done.row["error"] == "the process ended with status 5"
    assert not late.exists()


def test_the_last_words_are_those_of_the_job_that_ended_it(keeper):
    first = keeper.do(Task("talks")).row["pid"]
    assert keeper.do(Task("talks")).row["pid"] == first
    assert keeper.do(Task("leaves")).row["error"] == "the process ended with status 5"


def test_a_job_may_hold_what_no_module_defines(keeper):
    class Local(Task):
        pass

    assert keeper.do(Local("rests")).row["pid"] != os.getpid()


def test_one_that_ended_with_nothing_to_do_costs_the_next_job_nothing(keeper):
    first = keeper.do(Task("rests")).row["pid"]
    os.kill(first, 9)
    keeper._child.wait()
    assert keeper.do(Task("rests")).row["pid"] != first


def test_what_lies_in_the_folder_that_it_is_called_from_is_not_imported(
    keeper, tmp_path, monkeypatch
):
    (tmp_path / "slam").mkdir()
    (tmp_path / "slam" / "__init__.py").write_text("raise SystemExit('somebody else')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    assert "pid" in keeper.do(Task("rests")).row


PARENT = """
import sys
from tests.scripts.trials.test_worker_process import Task, WorkerProcess
WorkerProcess().do(Task("works long", file=sys.argv[1]))
"""


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="asks Linux which processes live")
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_it_ends_with_its_parent_and_so_does_what_it_started(tmp_path, how):
    told, root = tmp_path / "told", Path(__file__).parents[3]
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(told)], cwd=root)
    _wait_for(lambda: told.exists() and len(told.read_text().split()) == 2)
    orphans = told.read_text().split()
    assert all(map(_lives, orphans))
    parent.send_signal(how)
    parent.wait(timeout=10)
    _wait_for(lambda: not any(map(_lives, orphans)))


def _wait_for(happens):
    end = time.monotonic() + 30
    while not happens():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


def _lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False
