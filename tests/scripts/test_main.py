# pyright: reportMissingImports=false
import subprocess
import sys

import pytest
from dynslam_cli import main


def test_a_mistake_is_one_line_and_status_2(capsys, tmp_path):
    assert main.status(["run", str(tmp_path / "none.log"), "--out", str(tmp_path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("dynslam: ")
    assert "none.log" in lines[0]


def test_an_unknown_variant_lists_the_known_ones(capsys, log, tmp_path):
    assert main.status(["run", str(log), "--slam", "nonsense", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "nonsense" in error
    assert "dynamic-ml" in error


def test_a_place_that_cannot_be_written_is_told_at_once(capsys, log, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert main.status(["run", str(log), "--out", str(tmp_path / "file")]) == 2
    assert "can be written" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--seeds", "0"], ["--jobs", "0"]])
def test_demo_refuses_senseless_numbers(capsys, tmp_path, arguments):
    assert main.status(["demo", "--out", str(tmp_path), *arguments]) == 2
    assert "seeds >= 1 and jobs >= 1" in capsys.readouterr().err


def test_interrupt_is_no_traceback(capsys, monkeypatch):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "_run", interrupted)
    assert main.status([]) == 130
    assert capsys.readouterr().err == "dynslam: interrupted\n"


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


def test_help_names_the_commands(capsys):
    with pytest.raises(SystemExit) as left:
        main.status(["--help"])
    assert left.value.code == 0
    out = capsys.readouterr().out
    assert "demo" in out
    assert "run" in out
