"""Suites, hyperparameters, results and configurations: for what is none, one line, at once."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from agents.training.settings import read_settings
from agents.training.training_folder import CONFIG, find_checkpoint
from scripts.bench.user_suite import read_suite
from scripts.trials.results import read_rows
from slam.errors import InputError

READERS: dict[str, Callable[[Path], object]] = {
    "suite.toml": read_suite,
    "settings.yml": lambda path: read_settings("ppo", "DoorPatrol-v0", path),
    "results.jsonl": read_rows,
    CONFIG: lambda path: find_checkpoint({"steps": 1}, path.parent, True),
}
LEVELS = 12  # of aliases, nine in each
BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, LEVELS)
)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "missing"])
def test_what_is_no_file_is_not_waited_for(tmp_path: Path, name: str, kind: str) -> None:
    """A pipe hung, /dev/zero filled the memory."""
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    elif name == CONFIG:
        return  # a folder without a training
    told = {"missing": "no such file", "folder": "this is a directory"}
    expected = told.get(kind, "a device or a pipe")
    with pytest.raises(InputError, match=f"{name}: .*{expected}"):
        READERS[name](path)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "content",
    [
        "é".encode("latin-1") + b": 1\n", "a: 1".encode("utf-16") + b"\n", b"\0" * 100 + b"\n",
        b"[" * 100_000 + b"\n", b"{" * 100_000 + b"\n", b"a: " * 5_000 + b"\n",
        b'{"a":' * 5_000 + b"\n", b"x = " + b"[" * 60_000 + b"\n", b"- " * 30_000 + b"\n",
        b"1" * 5_000 + b"\n", b'{"seed": ' + b"1" * 5_000 + b"}\n", b"x" * (3 << 20) + b"\n",
    ],
)  # fmt: skip
def test_what_is_no_such_text_is_told_in_one_line(
    tmp_path: Path, name: str, content: bytes
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        READERS[name](path)
    told = str(refused.value)
    assert str(tmp_path) in told
    assert "\n" not in told
    assert len(told) < 600 + len(str(path))


@pytest.mark.parametrize(
    "text",
    [
        BOMB + f"DoorPatrol-v0: *a{LEVELS - 1}\n",
        BOMB + f"DoorPatrol-v0: {{x: *a{LEVELS - 1}}}\n",
        "DoorPatrol-v0: &a {x: *a}\n",
        "a: &a {k: 1}\n" + "DoorPatrol-v0:\n" + "  <<: *a\n" * 3,
        "a0: &a0 {k: 1}\n"
        + "".join(f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}\n" for k in range(1, 40))
        + "DoorPatrol-v0: *a39\n",
    ],
)
def test_references_in_yaml_do_not_make_a_small_file_a_huge_one(tmp_path: Path, text: str) -> None:
    """415 bytes filled the memory; rl_zoo3's own files do use references."""
    path = tmp_path / "settings.yml"
    path.write_text(text)
    if "k: 1}\nDoor" in text:
        assert READERS["settings.yml"](path) == {"k": 1}
        return
    with pytest.raises(InputError, match=r"settings\.yml: not YAML \(.*more than 10000 values"):
        READERS["settings.yml"](path)
