# pyright: reportMissingImports=false, reportArgumentType=false
"""The process that does jobs, and what it may leave behind."""

import os
import sys
import time
from dataclasses import dataclass

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
