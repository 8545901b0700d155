"""The code and commands of README and documentation run, and their links lead somewhere."""

# pyright: reportMissingImports=false
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium as gym
import matplotlib
import pytest
import tyro
from dynslam_cli import main
from dynslam_cli.bench.weeks import LAYERED
from dynslam_cli.console import config_file
from dynslam_cli.outside.adapter import known_outside

import agents.registry
import dynslam_env
import slam
from dynslam_env.simulation.registry import NAMED_LAWS, NAMED_WORLDS
from slam import registry
from slam.io import formats
from tests.docs.pages import DOCS, PAGES, ROOT, arguments, blocks, commands, lines, name

matplotlib.use("Agg")
WITH_PYTHON = [page for page in PAGES if any(b.language == "python" for b in blocks(page))]
RUN_IN_FULL = [DOCS / "tutorial.md"]  # the others' commands take minutes: they are parsed only
CARDS = ["env.py", "goals.py"]  # their docstrings are docs/environments.md
DOCSTRINGS = [
    path
    for folder in ("slam", "dynslam_env", "agents")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "```python" in path.read_text(encoding="utf-8") and path.name not in CARDS
]
PLACEHOLDERS = ("NAME", "a,b")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
SAID = {"docs/benchmark.md": "8 runs, 0 without a result"}


@pytest.fixture
def elsewhere(tmp_path, monkeypatch) -> Path:
    """An empty folder to run in, registries of its own, and no training that takes minutes."""
    from sb3_contrib import MaskablePPO
    from stable_baselines3 import PPO

    for algorithm in (PPO, MaskablePPO):
        monkeypatch.setattr(algorithm, "learn", lambda self, total_timesteps: self)
    for module in (registry, agents.registry):
        monkeypatch.setattr(module, "_BUILDERS", dict(module._BUILDERS))
    for table in (NAMED_WORLDS, NAMED_LAWS):
        monkeypatch.setattr(table, "_parts", dict(table._parts))
    monkeypatch.setattr(formats, "_READERS", dict(formats._READERS))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def status(words: list[str]) -> int | str | None:
    """Exit status of `dynslam WORDS`; for help and for errors the parser itself exits."""
    try:
        return main.status(words)
    except SystemExit as left:
        return left.code


def words_and_numbers(line: str) -> tuple[str, list[float]]:
    """Of a printed line; without times and sizes of memory, which differ from run to run, and
    without what compiling took, which only a first run tells."""
    uncompiled = re.sub(r", and \d+ s of compiling, this once", "", line.strip())
    untimed = re.sub(r"[\d.]+ (s|MB)\b", r"\1", uncompiled)
    return NUMBER.sub("#", untimed), [float(number) for number in NUMBER.findall(untimed)]


def is_told(line: str, told: list[str]) -> bool:
    """Whether a line was printed, with about the same numbers: the last digits depend on the
    processor."""
    words, numbers = words_and_numbers(line)
    return words == "..." or any(
        words == other and numbers == pytest.approx(values, rel=0.03)
        for other, values in map(words_and_numbers, told)
    )


def test_a_first_run_is_told_as_any_other():
    first = "792 scans in 9.1 s, 14.0 s with all files, and 62 s of compiling, this once; 404 MB"
    assert is_told("792 scans in 2.2 s, 14.2 s with all files; 391 MB", [first])
    assert not is_told("892 scans in 2.2 s, 14.2 s with all files; 391 MB", [first])


@pytest.mark.parametrize("page", WITH_PYTHON + DOCSTRINGS, ids=name)
def test_the_code_runs(page: Path, elsewhere, capsys):
    """All blocks of a page, one after the other, in one namespace; examples in docstrings assume
    `import dynslam_env` and `import gymnasium as gym`."""
    assumed = {"dynslam_env": dynslam_env, "gym": gym} if page in DOCSTRINGS else {}
    namespace: dict[str, Any] = dict(assumed)
    told: list[str] = []
    for block in blocks(page):
        if block.language == "python":
            exec(compile(block.text, name(page), "exec"), namespace)
            printed = capsys.readouterr().out
            assert bool(printed.strip()) == ("print(" in block.text or name(page) in SAID)
            assert SAID.get(name(page), "") in printed
        elif page in RUN_IN_FULL:
            for line in lines(block):
                assert main.status(arguments(line.removeprefix("dynslam "))) == 0, line
                told += capsys.readouterr().out.splitlines()
            if block.language == "text":
                assert [one for one in block.text.splitlines() if not is_told(one, told)] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_the_commands_are_understood(page: Path, monkeypatch, capsys):
    """By the parser itself, which rejects an option that was renamed. No command is run."""
    parse = tyro.cli

    def parsed_only(*given: Any, **options: Any) -> Any:
        parse(*given, **options)
        return lambda: 0

    def of_no_file(kind: type, words: list[str]) -> list[str]:
        return ["recording", *words] if words[:1] == ["--config"] else words

    monkeypatch.setattr(tyro, "cli", parsed_only)
    monkeypatch.setattr(config_file, "with_config", of_no_file)  # which need not be there
    for command in commands(page):
        words = arguments(command)
        bare = len(words) == 1  # the command's name, in running text
        for option, value in pairwise(words):
            if option in ("--slam", "--variants") and value not in PLACEHOLDERS:
                named = {one for one in value.split(",") if not one.endswith(".toml")}
                assert named <= {*slam.variants(), *known_outside(), LAYERED}, command
        left = status([*words, "--help"] if bare else words)
        assert left == 0, f"{command}\n{capsys.readouterr().err}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_what_make_and_pip_are_asked_for_is_there(page: Path):
    shown = [line for block in blocks(page) for line in lines(block)]
    makefile = (ROOT / "Makefile").read_text()
    project = (ROOT / "pyproject.toml").read_text()
    for line in shown:
        for target in re.findall(r"^make (\w+)$", line):
            assert re.search(rf"^{target}:", makefile, re.MULTILINE), line
        for extras in re.findall(r"\.\[([\w,]+)\]", line):
            for extra in extras.split(","):
                assert re.search(rf"^{extra} = \[", project, re.MULTILINE), line


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_suites_are_suites(page: Path, tmp_path):
    from dynslam_cli.bench.user_suite import read_suite

    for block in blocks(page):
        if block.language == "toml" and "[[case]]" in block.text:
            (tmp_path / "suite.toml").write_text(block.text)
            assert len(read_suite(tmp_path / "suite.toml").cases) >= 2


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_each_link_leads_somewhere(page: Path):
    """To a file, so that a page reads in a checkout too; the site's builder checks anchors."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    linked = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text) + re.findall(r'src="([^":]+)"', text)
    for target in linked:
        assert (page.parent / target).exists(), target


def test_the_checks_see_something():
    assert len(WITH_PYTHON) >= 6
    assert DOCSTRINGS
    assert sum(len(commands(page)) for page in PAGES) > 40
    assert arguments("train [--algo ppo|recurrent-ppo] [--seed S]") == [
        "train", "--algo", "ppo", "--seed", "1",
    ]  # fmt: skip
