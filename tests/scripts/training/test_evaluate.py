# pyright: reportMissingImports=false
import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.training.patrol_jobs import Patrol
from dynslam_cli.training.patrol_scorer import PatrolScorer, coverage
from dynslam_cli.training.summary import print_summary
from dynslam_cli.training.worlds import parse_worlds
from PIL import Image

import agents
from agents import registry
from dynslam_env import Corridor, Layout
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.simulation.registry import NAMED_WORLDS, register_world
from slam import GridSpec, OccupancyGrid, Pose2

SMALL = ("random", "scripted-path", "--steps", "20", "--first", "7000", "--jobs", "1")


def evaluate(out: Path, *arguments: str) -> int:
    return main.status(["evaluate", *arguments, "--out", str(out)])


def rows_of(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("evaluated")
    assert evaluate(out, *SMALL, "--episodes", "2", "--no-films") == 0
    return out


def test_a_row_for_each_agent_and_seed(done):
    rows = rows_of(done)
    runs = {(row["variant"], row["seed"]) for row in rows}
    assert runs == {(name, seed) for name in ("random", "scripted-path") for seed in (7000, 7001)}
    assert len({row["run"] for row in rows}) == 4
    for row in rows:
        assert row["error"] is None
        assert (row["world"], row["slam"], row["suite"]) == ("corridor", "hmm-ml", "evaluate")
        assert row["duration"] == 8.0
        assert 0 < row["coverage"] < 1
        assert 0 <= row["door_brier"] <= 1


def test_a_place_without_doors_is_refused(tmp_path, capsys):
    path = tmp_path / "room.json"
    replace(Corridor().layout(np.random.default_rng(0)), doors=()).save(path)
    assert evaluate(tmp_path / "out", *SMALL, "--worlds", str(path)) == 2
    assert "room.json has no doors, which agents are scored by" in capsys.readouterr().err


def test_agents_are_judged_on_the_same_episodes(done):
    episodes = {(row["variant"], row["seed"]): row["episode"] for row in rows_of(done)}
    for seed in (7000, 7001):
        assert episodes["random", seed] == episodes["scripted-path", seed]
    assert len(set(episodes.values())) == 2


def test_a_page_is_written_and_no_film_that_nobody_asked_for(done):
    page = (done / "report.html").read_text()
    assert "scripted-path" in page
    assert "<h1>dynslam evaluate</h1>" in page
    assert "4 runs of 2 agents on 2 episodes" in page
    assert "variant" not in page.partition("<body>")[2].partition("<script")[0]
    assert not (done / "films").exists()


def test_what_is_there_is_not_run_again(done, monkeypatch, capsys):
    before = (done / "results.jsonl").read_bytes()
    assert evaluate(done, *SMALL, "--episodes", "2", "--no-films") == 2
    assert "go on with it by --resume" in capsys.readouterr().err
    assert evaluate(done, *SMALL, "--episodes", "2", "--no-films", "--resume") == 0
    assert (done / "results.jsonl").read_bytes() == before


def test_what_is_there_is_not_mixed_with_other_patrols(done, tmp_path, capsys):
    before = (done / "results.jsonl").read_bytes()
    longer = ("random", "--steps", "30", "--first", "7001", "--episodes", "1", "--resume")
    assert evaluate(done, *longer) == 2
    assert "another episode as world corridor, slam hmm-ml, seed 7001" in capsys.readouterr().err
    assert (done / "results.jsonl").read_bytes() == before
    rows = [json.dumps({**row, "suite": "paper"}) + "\n" for row in rows_of(done)]
    (tmp_path / "results.jsonl").write_text("".join(rows))
    assert evaluate(tmp_path, "random", "--resume") == 2
    assert "holds the suite paper" in capsys.readouterr().err


def test_the_table_tells_whole_names(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    names = [f"out/train/DoorPatrol-v0-corridor-ppo-{k}/best.zip" for k in (1, 2)]
    rows = [Patrol("corridor", "hmm-ml", name, 7000, 20).row() for name in names]
    scores = ("door_brier", "f1_over_time", "ate", "slam_brier", "coverage", "path_length",
              "contact", "reward")  # fmt: skip
    print_summary([row | dict.fromkeys(scores, 0.1) for row in rows], names)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    first = "".join(words[0] for words in lines if words)
    assert all(name in first for name in names)


def test_the_tables_fit_80_columns(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    scores = ("door_brier", "regret_s", "f1_over_time", "ate", "slam_brier", "coverage",
              "path_length", "contact", "reward")  # fmt: skip
    names = ["look-ahead", "monte-carlo-entropy"]
    rows = [Patrol("office", "hmm-ml", name, k, 20).row() for name in names for k in range(3)]
    print_summary([row | dict.fromkeys(scores, 0.25) for row in rows], names)
    lines = capsys.readouterr().out.splitlines()
    assert max(len(line) for line in lines if "minus" not in line) <= 80
    assert any("monte-carlo-entropy" in line and "0.250 (0.250 to 0.250)" in line for line in lines)


def test_the_long_patrol_has_questions(tmp_path):
    arguments = ("greedy", "--env", "DoorPatrol-v1", "--worlds", "office", "--split", "train")
    short = ("--steps", "60", "--episodes", "1", "--no-films", "--jobs", "1")
    assert evaluate(tmp_path / "out", *arguments, *short) == 0
    (row,) = rows_of(tmp_path / "out")
    assert row["error"] is None
    assert row["env"] == "DoorPatrol-v1"
    assert row["questions"] >= 0
    assert row["regret_s"] is None or row["regret_s"] >= 0.0
    assert row["duration"] == 24.0


def test_a_row_is_what_the_job_gives_in_this_process(done):
    patrol = Patrol("corridor", "hmm-ml", "random", 7001, 20)
    row = next(row for row in rows_of(done) if row["run"] == patrol.name)
    mine = patrol().row
    for name in ("reward", "door_brier", "ate", "coverage", "path_length", "contact"):
        assert mine[name] == row[name], name


def test_the_run_that_is_pictured_is_the_one_that_was_judged():
    done = Patrol("corridor", "hmm-ml", "lookout", 7000, 20, pictured=True)()
    assert done.recorded is not None
    away = np.hypot(*(done.recorded.online - done.recorded.truth)[:, :2].T)
    assert len(away) == 1 + 2 * 20  # a scan each 0.2 s, of which every other ends a step
    assert np.sqrt(np.mean(away[2::2] ** 2)) == pytest.approx(done.row["ate"], abs=1e-9)


def test_an_unknown_agent_is_told_with_the_known_ones(tmp_path, capsys):
    assert evaluate(tmp_path / "out", "random", "wizard") == 2
    told = capsys.readouterr().err
    assert "unknown agent 'wizard'; known: random, scripted-path" in told
    assert "or a policy's file, or FILE.py:NAME" in told
    assert evaluate(tmp_path / "out", "random", "lookuot") == 2
    assert "unknown agent 'lookuot'; did you mean lookout?" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ("--worlds", "moon"),
            "unknown world 'moon'; known: corridor, loop, office, crowd, wings; or a",
        ),
        (("--worlds", "corridr"), "unknown world 'corridr'; did you mean corridor?"),
        (("--worlds", ","), "no world named; known: all, corridor"),
        (("--slam", "magic"), "unknown variant 'magic'"),
        (("--episodes", "0"), "episodes must be a whole number of at least 1"),
        (("--first", "-1"), "first must be a whole number"),
        (("--steps", "0"), "steps must be a whole number of at least 1"),
        (("--jobs", "0"), "jobs must be at least 1"),
        (("--limit", "0"), "limit must be a finite number"),
    ],
)
def test_mistakes_are_told_and_nothing_is_written(tmp_path, capsys, arguments, told):
    assert evaluate(tmp_path / "out", "random", *arguments) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


class Raises:
    def predict(self, *given, **named):
        raise ZeroDivisionError("nothing to divide by")


class Lost:
    def predict(self, *given, **named):
        return np.array([np.nan, 0.0], np.float32), None


@pytest.mark.parametrize(("agent", "told"), [(Raises, "nothing to divide by"), (Lost, "finite")])
def test_an_agent_that_fails_is_a_row(monkeypatch, agent, told):
    monkeypatch.setitem(registry._BUILDERS, "broken", lambda env, seed: agent())
    row = Patrol("corridor", "odometry", "broken", 7000, 5)().row
    assert row["failed"]
    assert told in row["error"]
    assert (row["variant"], row["seed"]) == ("broken", 7000)


def test_an_agent_that_fails_stops_nothing(tmp_path, capsys):
    path = tmp_path / "bad.py"
    path.write_text("def build(env, seed):\n    raise OSError('no such robot')\n")
    bad, out = f"{path}:build", tmp_path / "out"
    arguments = (bad, "random", "--steps", "5", "--episodes", "1", "--no-films", "--jobs", "1")
    assert evaluate(out, *arguments) == 0
    errors = {row["variant"]: row["error"] for row in rows_of(out)}
    assert "no such robot" in errors[bad]
    assert errors["random"] is None
    assert "failed: " in capsys.readouterr().err
    assert (out / "report.html").exists()


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_film_of_a_patrol(tmp_path, suffix):
    if suffix == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "films" / f"one{suffix}"
    row = Patrol("corridor", "odometry", "random", 7000, 4, film=path)().row
    assert row["error"] is None
    assert path.stat().st_size > 1000
    if suffix == ".gif":
        with Image.open(path) as image:
            assert getattr(image, "n_frames", 1) == 4


def test_films_are_of_the_best_and_the_worst_episode_and_no_two_have_one_name(tmp_path):
    from dynslam_cli.training.evaluate import EvaluateCommand
    from dynslam_cli.training.run_evaluation import films_of, patrols_of

    names = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "best.zip").touch()
        names.append(str(tmp_path / folder / "best.zip"))
    asked = EvaluateCommand(
        agents=(*names, "random"), worlds="all", slam="odometry,static-ml", episodes=3
    )
    patrols = patrols_of(asked, [*names, "random"])
    assert len({patrol.name for patrol in patrols}) == len(patrols)
    brier = {7000: 0.1, 7001: 0.3, 7002: 0.05}
    rows = [patrol.row() | {"door_brier": brier[patrol.seed]} for patrol in patrols]
    filmed = films_of(patrols, rows, tmp_path / "films")
    assert len(filmed) == 2 * 3 * len(parse_worlds("all"))
    assert {(patrol.seed, patrol.slam) for patrol in filmed} == {
        (7002, "odometry"), (7001, "odometry")
    }  # fmt: skip
    assert all(f"-best-{7002}" in str(p.film) for p in filmed if p.seed == 7002)
    assert len({patrol.film for patrol in filmed}) == len(filmed)


def boxed(width: float) -> Layout:
    walls = [(0, 0, width, 0), (width, 0, width, 2), (width, 2, 0, 2), (0, 2, 0, 0)]
    walls += [(10, 0, 11, 0), (11, 0, 11, 1), (11, 1, 10, 1), (10, 1, 10, 0)]  # nobody gets there
    return Layout(np.array(walls, float), (), Pose2(1.0, 1.0, 0.0), np.array([(1.0, 1.0)]))


def seen(left: float, right: float) -> OccupancyGrid:
    """A map that has seen all from x = left to right."""
    spec = GridSpec(0.05, -20, -20, 100, 300)
    x = (spec.col0 + np.arange(spec.cols) + 0.5) * spec.resolution
    observed = np.tile((x > left) & (x < right), (spec.rows, 1))
    return OccupancyGrid(spec, np.full(spec.shape, 0.5), observed)


@pytest.mark.parametrize(
    ("left", "right", "share"), [(-1, 14, 1.0), (0, 2, 0.5), (3, 4, 0.25), (9, 14, 0.0), (5, 5, 0)]
)
def test_coverage_is_the_share_of_the_floor_that_can_be_reached(left, right, share):
    assert coverage(seen(left, right), boxed(4.0)) == pytest.approx(share, abs=0.02)


def test_coverage_counts_what_a_small_map_holds():
    spec = GridSpec(0.05, 0, 0, 40, 40)  # of the first 2 m alone
    grid = OccupancyGrid(spec, np.zeros(spec.shape), np.ones(spec.shape, dtype=bool))
    assert coverage(grid, boxed(4.0)) == pytest.approx(0.5, abs=0.02)


def test_a_judge_adds_up():
    env = DoorPatrolEnv(slam="odometry")
    env.reset(seed=0)
    judge = PatrolScorer(env)
    for k, (brier, error) in enumerate([(0.1, 3.0), (0.3, 4.0)]):
        info = {"collision": 0.5 * k, "door_brier": brier, "slam": {"position_error": error}}
        judge.step(2.0, info)
    scores = judge.scores()
    assert scores["reward"] == 4.0
    assert scores["door_brier"] == pytest.approx(0.2)
    assert scores["ate"] == pytest.approx(12.5**0.5)
    assert scores["contact"] == pytest.approx(0.2)
    assert scores["failed"]
    assert scores["f1_over_time"] is None
    assert scores["path_length"] == 0.0


def test_a_place_without_doors_has_no_score_of_doors():
    env = DoorPatrolEnv(slam="odometry", world=boxed(4.0))
    _, info = env.reset(seed=0)
    judge = PatrolScorer(env)
    judge.step(0.0, {**info, "collision": 0.0})
    assert judge.scores()["door_brier"] is None
    json.dumps(judge.scores(), allow_nan=False)


OWN_WORLD = """
from dynslam_env import Corridor

class Narrow:
    def layout(self, rng):
        return Corridor(length=8.0, doors_per_side=2).layout(rng)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """An agent and a world registered in this process alone, and worlds in files."""
    corridor = Corridor(length=6.0, doors_per_side=2)

    class Short:
        def layout(self, rng):
            return corridor.layout(rng)

    class Still:
        def __init__(self, env, seed):
            pass

        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            return np.zeros(2, np.float32), state

    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    monkeypatch.setattr(NAMED_WORLDS, "_parts", dict(NAMED_WORLDS._parts))
    agents.register("still", Still)
    register_world("short", Short())
    (tmp_path / "own.py").write_text(OWN_WORLD)
    corridor.layout(np.random.default_rng(0)).save(tmp_path / "own.json")
    return ["short", f"{tmp_path}/own.json", f"{tmp_path}/own.py:Narrow"]


def test_agents_and_worlds_of_ones_own_reach_the_worker_processes(own, tmp_path):
    arguments = ("--worlds", ",".join(own), "--slam", "odometry", "--steps", "3", "--episodes", "1")
    out = tmp_path / "out"
    assert evaluate(out, "still", *arguments, "--jobs", "1") == 0
    rows = rows_of(out)
    assert [row["error"] for row in rows] == [None] * 3
    assert {row["world"] for row in rows} == set(own)
    assert {row["variant"] for row in rows} == {"still"}
    assert len({row["episode"] for row in rows}) == 3
    films = list((out / "films").iterdir())
    assert len(films) == 3  # the only episode is both the best and the worst


def test_another_text_of_a_world_file_is_another_episode(own):
    patrol = Patrol(own[1], "odometry", "random", 7000, 3)
    before = patrol.episode
    Corridor(length=7.0, doors_per_side=2).layout(np.random.default_rng(0)).save(own[1])
    assert patrol.episode != before


def test_what_cannot_be_sent_to_a_worker_is_told(own, monkeypatch, tmp_path, capsys):
    lock = threading.Lock()
    monkeypatch.setitem(registry._BUILDERS, "locked", lambda env, seed: lock)
    assert evaluate(tmp_path / "out", "locked") == 2
    assert "cannot be sent to another process" in capsys.readouterr().err
