# pyright: reportMissingImports=false
"""Limits and measures of a program, against what it really takes."""

import os
import shutil
import sys
import time

import pytest
from dynslam_cli.outside.adapter import read_adapter
from dynslam_cli.outside.program import ProgramError, run_programs
from dynslam_cli.trials.outside_trial import told_version

from slam.errors import InputError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")


def python(code: str) -> list[str]:
    return [sys.executable, "-S", "-c", code]


def test_time_processor_time_and_memory_are_those_of_the_program_and_what_it_starts(tmp_path):
    busy = "import time; b = time.process_time()\nwhile time.process_time() < b + 0.4: pass"
    starts = f"import subprocess, sys; subprocess.run([sys.executable, '-S', '-c', {busy!r}])"
    large = "x = bytearray(90_000_000); import time; time.sleep(0.2)"
    commands = [python("import time; time.sleep(0.5)"), python(starts), python(large)]
    spent = run_programs(commands, tmp_path, 60, 1000)
    assert 1.1 < spent.wall < 20
    assert 0.4 < spent.cpu < 2
    assert 95 < spent.memory < 130


def test_a_small_program_is_not_charged_for_the_process_that_started_it(tmp_path):
    here = bytearray(300_000_000)
    spent = run_programs([python("import time; time.sleep(0.2)")], tmp_path, 60, 200)
    assert 2 < spent.memory < 60
    assert len(here) == 300_000_000


def test_a_program_may_have_a_name_of_any_bytes(tmp_path):
    """Its name stands in the file that its memory is read from."""
    name = os.fsdecode(os.fsencode(tmp_path) + b"/sl\xfcmber")
    shutil.copy("/bin/sleep", name)
    spent = run_programs([[name, "0.2"]], tmp_path, 60, 1000)
    assert spent.memory > 0.5


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("print('this is why'); raise SystemExit(3)", "status 3; this is why"),
        ("import os; os.kill(os.getpid(), 11)", "ended by signal 11"),
        ("import time; time.sleep(60)", "time limit of 2 s"),
        ("x = bytearray(400_000_000); import time; time.sleep(60)", "memory limit of 200 MB"),
    ],
)
def test_one_that_fails_or_exceeds_a_limit_is_ended_and_told(tmp_path, code, told):
    begun = time.monotonic()
    with pytest.raises(ProgramError, match=told):
        run_programs(
            [python("pass"), python(code), python("raise SystemExit(9)")], tmp_path, 2, 200
        )
    assert time.monotonic() - begun < 15


def test_the_time_limit_is_that_of_all_commands_together(tmp_path):
    naps = [python("import time; time.sleep(0.8)")] * 5
    with pytest.raises(ProgramError, match="time limit of 2 s"):
        run_programs(naps, tmp_path, 2, 200)


def test_what_it_leaves_running_is_ended_with_it(tmp_path):
    late = tmp_path / "late"
    left = f"import time; time.sleep(1.0); open({str(late)!r}, 'x').close()"
    starts = f"import subprocess, sys; subprocess.Popen([sys.executable, '-S', '-c', {left!r}])"
    run_programs([python(starts)], tmp_path, 60, 200)
    time.sleep(2.0)
    assert not late.exists()


def test_one_that_is_not_there_is_told(tmp_path):
    with pytest.raises(InputError, match="no-such-slam: cannot be started"):
        run_programs([["no-such-slam"]], tmp_path, 2, 200)


def test_a_program_that_is_not_installed_is_told_before_it_is_run(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('commands = ["true"]\nversion = "{python} -c \'import not_there\'"\n')
    with pytest.raises(InputError, match=r"outside:mine: .*No module named 'not_there'"):
        told_version(read_adapter(path))
    says_nothing = "import sys; print(file=sys.stderr); exit(3)"
    path.write_text(f'commands = ["true"]\nversion = "{{python}} -c \'{says_nothing}\'"\n')
    with pytest.raises(InputError, match=r"outside:mine: .*exit status 3"):
        told_version(read_adapter(path))
