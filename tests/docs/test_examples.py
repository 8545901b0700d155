"""The examples run, with small numbers, and give the results that their pages state."""

import re
import shlex

import pytest
import tyro

from docs.examples import map_a_log
from slam import registry
from tests.docs.pages import DOCS, PAGES, ROOT, blocks, lines

EXAMPLES = {
    "map_a_log.py": "MapALog",
    "search_a_tree.py": "SearchATree",
    "train_an_explorer.py": "TrainAnExplorer",
}


@pytest.fixture
def without_doors(monkeypatch):
    """The example's variant is registered in this test alone."""
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))


def shown_on(page: str) -> str:
    """What a page shows as printed."""
    return next(block.text for block in blocks(DOCS / page) if block.language == "text")


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"\d+", text)]


def test_fewer_doors_are_left_in_the_map(tmp_path, capsys, without_doors):
    left = map_a_log.MapALog(seed=5000, out=tmp_path)()
    assert left["without-doors"] < 0.8 * left["static-ml"]
    assert left["without-doors"] < 0.8 * left["hmm-ml"]
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) == 3
    assert numbers(printed) == pytest.approx(numbers(shown_on("map-a-log.md")), rel=0.05, abs=1.0)
    for name in map_a_log.VARIANTS:
        assert (tmp_path / name / "map.yaml").exists()
        assert (tmp_path / name / "map.pgm").exists()


def test_the_pose_is_that_of_the_same_map(tmp_path, capsys, without_doors):
    map_a_log.MapALog(seed=3, out=tmp_path)()
    found = re.findall(r"([\w-]+): .* ATE (\d+) mm", capsys.readouterr().out)
    errors = {name: int(error) for name, error in found}
    assert errors["without-doors"] == errors["hmm-ml"]


def test_an_explorer_is_trained_and_judged(tmp_path, capsys):
    pytest.importorskip("stable_baselines3")
    from docs.examples.train_an_explorer import TrainAnExplorer

    scores = TrainAnExplorer(steps=100, worlds=2, episodes=1, length=5, out=tmp_path)()
    assert (tmp_path / "policy.zip").exists()
    assert set(scores) == {"this policy", "random", "nearest-frontier", "lookout", "ppo"}
    assert all(0 <= brier <= 1 for _, brier in scores.values())
    assert len(capsys.readouterr().out.splitlines()) == 5


def test_a_search_drives_better_than_straight_ahead(capsys):
    from docs.examples.search_a_tree import SearchATree

    rewards = SearchATree(seed=0, decisions=12, depth=2)()
    assert rewards["always ahead"] == pytest.approx(5.31, abs=0.01)  # as on the page
    assert rewards["search of depth 2"] > rewards["always ahead"] + 0.3
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_the_pages_give_the_examples_what_they_take():
    from importlib import import_module

    shown = [line for page in PAGES for block in blocks(page) for line in lines(block)]
    given = [line for line in shown if line.startswith("python docs/examples/")]
    assert len(given) == len(EXAMPLES)
    for line in given:
        _, path, *arguments = shlex.split(line)
        assert (ROOT / path).exists()
        file = path.rpartition("/")[2]
        module = import_module(f"docs.examples.{file.removesuffix('.py')}")
        tyro.cli(getattr(module, EXAMPLES[file]), args=arguments)


def test_the_examples_are_all_shown():
    assert {path.name for path in (DOCS / "examples").glob("*.py")} == set(EXAMPLES)
