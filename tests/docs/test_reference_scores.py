"""The reward thresholds are those of the tables of reference scores."""

import json
import re

import gymnasium as gym
import pytest

from docs.making.cards import PAGE
from docs.making.goal_scores import RULES
from docs.making.patrol_scores import table
from dynslam_env import WORLDS

TEXT = (PAGE.parent / "splits.md").read_text(encoding="utf-8")
INTERVAL = r"-?[\d.]+ \((-?[\d.]+) to -?[\d.]+\)"


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_is_solved_from_the_low_end_of_the_scripted_paths_return(name):
    row = re.search(rf"\| `{name}` \| its own \| scripted path \| [^|]+\| {INTERVAL}", TEXT)
    assert row
    assert gym.spec(name).reward_threshold == float(row[1])


def test_a_patrol_is_solved_from_the_low_end_of_the_lookouts_return():
    row = re.search(rf"\| lookout \| {INTERVAL}", TEXT)
    assert row
    assert gym.spec("DoorPatrol-v0").reward_threshold == float(row[1])


def test_a_patrol_of_goals_is_solved_from_the_highest_low_end_of_a_rule():
    assert gym.spec("DoorPatrolGoals-v0").reward_threshold == max(
        float(re.search(rf"\| {name} \| {INTERVAL}", TEXT)[1])  # type: ignore[index]
        for name in RULES
    )


def test_a_long_patrol_is_solved_from_the_highest_low_end_of_an_agent_that_knows_no_truth():
    long = TEXT[TEXT.index("`DoorPatrol-v1` (office") :]
    rows = re.findall(rf"^\| ([a-z-]+) \| {INTERVAL}", long, flags=re.MULTILINE)
    lows = {agent: float(low) for agent, low in rows}
    for other in ("scripted-path", "planning-oracle", "ppo"):  # the true path, doors; learned
        del lows[other]
    assert len(lows) == 13
    assert gym.spec("DoorPatrol-v1").reward_threshold == max(lows.values())


def test_regret_is_a_column_where_it_was_scored(tmp_path):
    scores = {"door_brier": 0.1, "coverage": 0.5, "contact": 0.0, "ate": 0.01, "regret_s": 1.25}
    row = {"variant": "a", "seed": 0, "reward": 3.0, "error": None} | scores
    (tmp_path / "results.jsonl").write_text(json.dumps(row))
    _, head, _, only = table(tmp_path)
    assert "| regret, s |" in head
    assert "| 1.25 (1.25 to 1.25) |" in only


def test_the_table_counts_only_episodes_that_all_agents_finished(tmp_path):
    scores = {"door_brier": 0.1, "coverage": 0.5, "contact": 0.0, "ate": 0.01}
    rows = [("a", 0, 1.0), ("b", 0, 3.0), ("a", 1, 2.0), ("b", 1, 5.0), ("a", 2, 900.0)]
    lines = [
        json.dumps({"variant": agent, "seed": seed, "reward": reward, "error": None} | scores)
        for agent, seed, reward in rows
    ]
    (tmp_path / "results.jsonl").write_text("\n".join(lines))
    title, head, _, first, second = table(tmp_path)
    assert "0 to 1, 2 of them" in title
    assert head.startswith("| agent | return |")
    assert first.startswith("| a | 1.5 (")
    assert second.startswith("| b | 4.0 (")
