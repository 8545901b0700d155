# pyright: reportMissingImports=false
"""Whose code a variant is, and what a bench makes of a change of it."""

import json
import sys
from pathlib import Path

import pytest
from dynslam_cli.trials import code
from dynslam_cli.trials.batch import missing
from dynslam_cli.trials.code import Code, code_of, our_code
from dynslam_cli.trials.jobs import Trial
from dynslam_cli.trials.sources import SimulatedDrive

from slam import Histogram, maximum_likelihood, registry
from slam.errors import InputError

from ..results import SMALL

MINE = """
from slam import Histogram, maximum_likelihood
class Mine(Histogram):
    pass
builder = maximum_likelihood(lambda: Mine())
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch):
    """A module of the user's, and a variant made in it."""
    path = tmp_path / "mine_of_code.py"
    path.write_text(MINE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    import mine_of_code  # pyright: ignore[reportMissingImports]

    registry.register("mine", mine_of_code.builder)
    yield path
    sys.modules.pop("mine_of_code")


def test_a_variant_of_the_users_names_its_module_and_a_digest_of_its_file(mine):
    before = code_of("mine")
    assert before.package == "mine_of_code"
    assert before.digest != our_code().digest
    assert code_of("mine") == before
    mine.write_text(MINE + "# another one\n")
    assert code_of("mine").digest != before.digest


def test_ours_is_ours_with_any_parameters(monkeypatch):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    registry.register("short", maximum_likelihood(Histogram))
    assert code_of("dynamic-ml") == code_of("mapping-only") == code_of("short") == our_code()
    assert our_code().version


def test_a_package_that_is_installed_names_its_version(monkeypatch):
    import scipy.stats

    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    registry.register("theirs", scipy.stats.norm.pdf)  # pyright: ignore[reportArgumentType]
    assert code_of("theirs")[:2] == ("scipy", scipy.__version__)


def trials(digest: str) -> list[Trial]:
    source = SimulatedDrive("DoorCorridor-v0", 5000)
    made = Code("dynslam", "1", digest)._asdict()
    return [Trial("s", {"k": "v"}, source, name, code=made) for name in ("a", "b")]


def test_results_of_two_codes_are_not_mixed_unless_told(tmp_path):
    path = tmp_path / "results.jsonl"
    path.write_text("".join(json.dumps(trial.row()) + "\n" for trial in trials("one")[:1]))
    assert [t.variant for t in missing(trials("one"), path, resume=True)] == ["b"]
    with pytest.raises(InputError, match=r"a: 1 run of dynslam 1 one, now dynslam 1 two.*--mixed"):
        missing(trials("two"), path, resume=True)
    assert [t.variant for t in missing(trials("two"), path, True, mixed=True)] == ["b"]
    assert missing(trials("two")[1:], path, resume=True)  # `a` is not to run: it may stay


def test_a_bench_is_resumed_after_a_change_only_if_told(bench, small, monkeypatch, capsys):
    monkeypatch.setattr(code, "our_code", lambda: Code("dynslam", "9", "another"))
    before = (small / "results.jsonl").read_bytes()
    assert bench(*SMALL, "--resume") == 2
    assert "static-ml: 4 runs of dynslam" in capsys.readouterr().err
    assert bench(*SMALL, "--resume", "--mixed") == 0
    assert (small / "results.jsonl").read_bytes() == before


def test_failed_runs_are_tried_again_and_count_once(bench, small, capsys):
    path = small / "results.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    for row in rows[:3]:
        row |= {"error": "the machine was switched off", "failed": True}
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert bench(*SMALL, "--resume") == 0
    assert "8 runs, 3 without a result" in capsys.readouterr().out
    assert bench(*SMALL, "--retry-failed") == 0
    told = capsys.readouterr()
    assert "8 runs, 0 without a result" in told.out
    assert "again" not in told.err
    assert len(path.read_text().splitlines()) == 11
