# pyright: reportMissingImports=false
"""`--config FILE`: options from TOML, and what was used, as TOML."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import tyro
from dynslam_cli import main
from dynslam_cli.console.config_file import options_of, with_config, write_config
from dynslam_cli.mapping.map import MapCommand
from dynslam_cli.mapping.run import RunCommand

from slam.errors import InputError

EVERY = """
file = "drive.npz"
laser = ["/front", "/back"]
odometry = "/odom"
mount = [0.2, 0.0, -180.0]
clock = "-0.1,end"
from = 2
to = 8.5
min-range = 0.3
max_range = 12
slam = "static-ml"
start = [1, 2, -3]
onto = "old/session.npz"
resolution = 0.1
keep = "none"
mask = "mask.yaml"
align = true
localise = false
robot-radius = 0.2
seed = 4
"""


def parsed(*arguments: str) -> MapCommand:
    config = (tyro.conf.FlagCreatePairsOff,)
    return tyro.cli(MapCommand, args=with_config(MapCommand, arguments), config=config)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    (tmp_path / "c.toml").write_text(EVERY)
    return tmp_path / "c.toml"


def test_every_entry_becomes_its_option(config: Path) -> None:
    made = parsed("--config", str(config))
    assert made.file == config.parent / "drive.npz"
    assert made.laser == ("/front", "/back")
    assert made.mount == (0.2, 0.0, -180.0)
    assert made.clock == "-0.1,end"
    assert (made.begin, made.end) == (2.0, 8.5)
    assert (made.min_range, made.max_range) == (0.3, 12.0)
    assert made.start == (1.0, 2.0, -3.0)
    assert made.onto == config.parent / "old" / "session.npz"
    assert made.mask == config.parent / "mask.yaml"
    assert made.align
    assert not made.localise
    assert (made.keep, made.resolution, made.robot_radius, made.seed) == ("none", 0.1, 0.2, 4)


def test_options_of_the_command_line_go_before(config: Path) -> None:
    more = ["--laser", "/left", "--mount", "1", "2", "3", "--to=9", "--clock", "auto"]
    made = parsed("other.npz", *more, "--config", str(config), "--robot-radius", "0.5")
    assert made.file == Path("other.npz")
    assert made.laser == ("/left",)
    assert made.mount == (1.0, 2.0, 3.0)
    assert (made.begin, made.end, made.clock) == (2.0, 9.0, "auto")
    assert made.robot_radius == 0.5


def test_what_was_used_is_read_again_as_it_was(config: Path, tmp_path: Path) -> None:
    made = parsed("--config", str(config))
    write_config(made, ("out", "live", "json"), "a head", tmp_path / "used.toml")
    again = parsed("--config", str(tmp_path / "used.toml"))
    again.config = made.config
    assert again == made
    text = (tmp_path / "used.toml").read_text()
    assert text.startswith("# a head\n")
    assert "not set: truth" in text


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("resolutoin = 0.1", "unknown entry 'resolutoin'; did you mean resolution?"),
        ("config = 'other.toml'", "unknown entry 'config'"),
        ("align = 1", "align must be true or false"),
        ("mount = [1, 2]", "mount must be a list of 3 numbers"),
        ("mount = 1", "mount must be a list of 3 numbers"),
        ("keep = {once = true}", "keep must be a number or a text"),
        ("seed = [1, 2]", "seed must be a number or a text"),
        ("laser = [true]", "laser must be"),
        ("seed = ", "not a TOML file"),
    ],
)
def test_a_wrong_file_is_told_in_one_line(tmp_path: Path, text: str, why: str, capsys) -> None:
    (tmp_path / "c.toml").write_text(text)
    assert main.status(["map", "drive.npz", "--config", str(tmp_path / "c.toml")]) == 2
    err = capsys.readouterr().err
    assert why in err
    assert "c.toml" in err
    assert err.count("\n") == 1


def test_a_value_of_the_wrong_kind_is_refused_by_its_option(tmp_path: Path, capsys) -> None:
    (tmp_path / "c.toml").write_text('resolution = "fine"')
    with pytest.raises(SystemExit):
        main.status(["map", "drive.npz", "--config", str(tmp_path / "c.toml")])
    assert "--resolution" in capsys.readouterr().err


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        with_config(MapCommand, ["--config", str(tmp_path / "none.toml")])


def test_a_command_without_config_keeps_its_arguments() -> None:
    arguments = ["drive.npz", "--config", "c.toml"]
    assert with_config(RunCommand, arguments) == arguments
    assert "config" not in options_of(RunCommand)
    assert with_config(MapCommand, ["drive.npz", "--seed", "3"]) == ["drive.npz", "--seed", "3"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders")
def test_what_never_ends_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match=r"pipe\.toml: a file was expected, this is a device"):
        with_config(MapCommand, ["--config", str(tmp_path / "pipe.toml")])


def test_a_long_entry_is_told_in_a_short_line(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text("x" * 5000 + " = 1\n")
    with pytest.raises(InputError, match=r"long\.toml: unknown entry 'xxx") as refused:
        with_config(MapCommand, ["--config", str(tmp_path / "long.toml")])
    assert len(str(refused.value)) < 500 + len(str(tmp_path))
