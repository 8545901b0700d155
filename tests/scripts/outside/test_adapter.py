# pyright: reportMissingImports=false
"""Adapters: what may stand in them, and where they are found."""

import importlib.metadata
import sys

import pytest
from dynslam_cli.outside import adapter
from dynslam_cli.outside.adapter import find_adapter, known_outside, read_adapter

from slam.errors import InputError

SMALL = 'commands = ["{MINE} {log} {out}"]\n[programs]\nMINE = "{python}"\n'


def test_the_ready_made_ones_are_found_by_name_and_can_be_read():
    assert {"outside:yag-slam", "outside:mrpt-icp-slam", "outside:mrpt-rbpf-slam"} <= {
        *known_outside()
    }
    for name in known_outside():
        assert find_adapter(name).about


def test_words_are_those_of_a_shell_with_the_places_filled_in(tmp_path, monkeypatch):
    path = tmp_path / "mine.toml"
    path.write_text(SMALL.replace("{out}", "'a b' {out}"))
    made = read_adapter(path)
    command = made.commands[0]
    places = {"log": "x y.log", "out": "t.tum"}
    assert made.words(command, places) == [sys.executable, "x y.log", "a b", "t.tum"]
    monkeypatch.setenv("MINE", "/opt/mine")
    assert made.words(command, places)[0] == "/opt/mine"
    assert made.name == "mine"
    assert made.folder == tmp_path


def test_a_folder_of_ones_own_goes_before_an_entry_point_and_that_before_ours(
    tmp_path, monkeypatch
):
    class Entry:
        def load(self):
            return tmp_path / "package"

    for folder in ("own", "package"):
        (tmp_path / folder).mkdir()
        for name in ("yag-slam", "mine", folder):
            text = f'about = "{folder}"\n{SMALL}'
            (tmp_path / folder / f"{name}.toml").write_text(text)
    monkeypatch.setenv("DYNSLAM_OUTSIDE", str(tmp_path / "own"))
    monkeypatch.setattr(adapter, "entry_points", lambda group: [Entry()])
    assert find_adapter("outside:mine").about == "own"
    assert find_adapter("outside:yag-slam").about == "own"
    assert find_adapter("outside:package").about == "package"
    assert find_adapter("outside:mrpt-icp-slam").columns == "stamp x y theta"
    assert find_adapter(f"outside:{tmp_path}/package/mine.toml").about == "package"
    assert importlib.metadata.entry_points is not adapter.entry_points


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "commands must be a list of texts"),
        ('commands = "run"', "commands must be a list of texts"),
        ('comands = ["run"]', "did you mean 'commands'"),
        ('commands = ["run {lgo}"]', r"\{lgo\} in 'run \{lgo\}'; known: "),
        ("commands = ['run \"']", "No closing quotation"),
        ('commands = ["run"]\nlog = "bag"', "log must be one of"),
        ('commands = ["run"]\nstamps = "frames"', "stamps must be one of"),
        ('commands = ["run"]\ncolumns = "x y theta"', "columns must be `tum` or name"),
        ('commands = ["run"]\ncolumns = "time x y theta"', "a name in columns must be one of"),
        ('commands = ["run"]\nmemory_mb = -1', "memory_mb must be"),
        ('commands = ["run"]\nmax_beams = 1', "max_beams must be"),
        ("commands = [", "not a TOML file"),
    ],
)
def test_mistakes_in_one_are_told_with_the_file(tmp_path, text, told):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=told) as raised:
        read_adapter(path)
    assert "mine.toml" in str(raised.value)


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(InputError, match="did you mean outside:yag-slam"):
        find_adapter("outside:yagslam")
