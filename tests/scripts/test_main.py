# pyright: reportMissingImports=false
import json
import os
import re
import subprocess
import sys
from importlib.metadata import version

import pytest
from dynslam_cli import main

import slam
from tests.slam.io.samples import samples


def test_a_mistake_is_one_line_and_status_2(capsys, tmp_path):
    assert main.status(["run", str(tmp_path / "none.log"), "--out", str(tmp_path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("dynslam: ")
    assert "none.log" in lines[0]


def test_an_unknown_variant_is_answered_with_the_nearest_and_where_all_are(capsys, log, tmp_path):
    assert main.status(["run", str(log), "--slam", "dinamic-ml", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "unknown SLAM variant 'dinamic-ml'; did you mean dynamic-ml" in error
    assert len(error) < 300
    told = re.search(r'python -c "(.*)"', error)
    assert told
    exec(told[1])
    assert capsys.readouterr().out.split() == slam.variants()


def test_an_unknown_command_is_answered_with_the_nearest(capsys):
    assert main.status(["cmopare", "a", "b"]) == 2
    assert capsys.readouterr().err.startswith(
        "dynslam: unknown command 'cmopare'; did you mean compare"
    )


def test_without_a_command_the_help_is_shown_as_a_mistake(capsys):
    assert main.status([]) == 2
    assert capsys.readouterr() == ("", main.overview() + "\n")


def test_a_place_that_cannot_be_written_is_told_at_once(capsys, log, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert main.status(["run", str(log), "--out", str(tmp_path / "file")]) == 2
    assert "can be written" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["seeds", "jobs"])
def test_demo_refuses_senseless_numbers(capsys, tmp_path, option):
    assert main.status(["demo", "--out", str(tmp_path), f"--{option}", "0"]) == 2
    assert re.search(f"{option} must be .*at least 1.*, got 0", capsys.readouterr().err)


def test_interrupt_is_no_traceback(capsys, monkeypatch):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "_run", interrupted)
    assert main.status([]) == 130
    assert capsys.readouterr().err == "dynslam: interrupted\n"


@pytest.mark.parametrize(("error", "told"), [(MemoryError(), ""), (MemoryError("9 GB"), " (9 GB)")])
def test_too_little_memory_is_told_in_one_line(capsys, monkeypatch, error, told):
    def fail(arguments):
        raise error

    monkeypatch.setattr(main, "_run", fail)
    assert main.status(["map", "drive.csv"]) == 2
    assert capsys.readouterr().err == f"dynslam: out of memory{told}\n"


def test_somebody_elses_package_of_our_name_is_told(tmp_path):
    (tmp_path / "slam").mkdir()
    (tmp_path / "slam" / "__init__.py").touch()
    run = subprocess.run(
        [sys.executable, "-c", "from dynslam_cli.main import main; main(['demo'])"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert "`slam`" in run.stderr
    assert "not dynslam's" in run.stderr


def test_the_version_is_that_of_the_package(capsys):
    assert main.status(["--version"]) == 0
    assert capsys.readouterr().out == f"dynslam {version('dynslam')}\n"


def test_help_names_the_commands(capsys):
    with pytest.raises(SystemExit) as left:
        main.status(["--help"])
    assert left.value.code == 0
    out = capsys.readouterr().out
    for name in main.COMMANDS:
        assert re.search(f"^  {name} +[A-Z]", out, re.MULTILINE)


@pytest.mark.parametrize("name", main.COMMANDS)
def test_the_help_tells_the_first_sentence_of_each_command(name):
    command = main.COMMANDS[name]
    words = " ".join((command.load().__doc__ or "").split())
    assert re.split(r"(?<=\.) (?=[A-Z])", words)[0] == command.summary


HEAVY = {"numba", "matplotlib", "gymnasium", "pymunk", "pygame", "scipy", "torch", "joblib"}
SHOW_MODULES = """
import json, sys
from dynslam_cli import main
try:
    main.status(sys.argv[1:])
except SystemExit as left:
    assert left.code == 0
print(json.dumps(sorted({name.split(".")[0] for name in sys.modules})))
"""


@pytest.mark.parametrize("arguments", [["--help"], *([name, "--help"] for name in main.COMMANDS)])
def test_help_imports_no_heavy_library(arguments):
    run = subprocess.run(
        [sys.executable, "-c", SHOW_MODULES, *arguments], capture_output=True, text=True, check=True
    )
    assert set(json.loads(run.stdout.splitlines()[-1])) & HEAVY == set()


@pytest.mark.parametrize("language", ["C", "tr_TR.UTF-8", "POSIX"])
def test_letters_that_a_terminal_has_not_are_written_as_numbers(tmp_path, language):
    """An ASCII terminal and another letter in a path were a traceback."""
    path = tmp_path / "Fl\u00fcr\u0131.csv"
    path.write_bytes(samples()["table.csv"])
    env = {**os.environ, "LC_ALL": language, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    for file, status in ((path, 0), (tmp_path / "Fl\u00fcr\u015f.csv", 2)):
        done = subprocess.run(
            [sys.executable, "-m", "dynslam_cli.main", "info", str(file)],
            capture_output=True, text=True, env=env, check=False,
        )  # fmt: skip
        assert done.returncode == status, done.stderr
        assert "Traceback" not in done.stderr
        assert (done.stdout + done.stderr).isascii()
        assert "Fl\\" in done.stdout + done.stderr
