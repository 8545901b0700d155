from dataclasses import replace

import numpy as np
import pytest

from dynslam_env import Layout, Task
from dynslam_env.simulation.task import TaskProgress
from slam import InputError, Pose2

LAYOUT = Layout(np.empty((0, 4)), (), Pose2(), np.array([(0.0, 0), (5, 0), (0, 0)]))


class Judged:
    """The judge of one robot in LAYOUT."""

    def __init__(self, task, start=Pose2()):  # noqa: B008
        self._task, self._judge = task, TaskProgress(task, 1)
        self._judge.reset(0, LAYOUT, np.array(start))

    def __call__(self, x, y=0.0, collided=False):
        """Reward, its terms, and ends, by name, after a step of 0.1 s to (x, y)."""
        judge, task = self._judge, self._task
        judge.update(
            np.zeros(1, dtype=np.int64), np.array([(x, y, 0.0)]), np.array([collided]), 0.1
        )
        terms = dict(zip(task.reward, judge.terms[0].tolist(), strict=True))
        return float(judge.rewards[0]), terms, dict(zip(task.ends, judge.ends[0], strict=True))


def drive(task, xs, collided=False):
    judged = Judged(task)
    return [judged(x, collided=collided) for x in xs]


def test_there_and_back_pays_the_length_of_the_path_once():
    xs = [*np.arange(0.5, 5.1, 0.5), *np.arange(4.5, -0.1, -0.5)]
    results = drive(Task(reward={"progress": 2.0}, reach=0.1), xs)
    assert sum(reward for reward, _, _ in results) == pytest.approx(2 * 10.0, abs=0.2)
    assert [ends["arrived"] for _, _, ends in results] == [False] * (len(xs) - 1) + [True]


def test_arrival_is_paid_once_and_stays_an_end():
    task = Task(reward={"arrived": 5.0}, reach=0.1)
    results = drive(task, [4.95, 0.05, 0.0, 0.05, 1.0, 0.0])
    assert [reward for reward, _, _ in results] == [0.0, 5.0, 0.0, 0.0, 0.0, 0.0]
    assert [ends["arrived"] for _, _, ends in results] == [False] + [True] * 5


def test_arrival_is_paid_again_in_the_next_episode():
    judged = Judged(Task(reward={"arrived": 5.0}))
    for _ in range(2):
        assert [judged(x)[0] for x in (5.0, 0.0, 0.0)] == [0.0, 5.0, 0.0]
        judged._judge.reset(0, LAYOUT, np.zeros(3))


def test_going_back_and_forth_pays_nothing():
    results = drive(Task(reward={"progress": 1.0}), [1, 2, 1, 2, 1, 0])
    assert sum(reward for reward, _, _ in results) == pytest.approx(0.0)


def test_no_step_pays_more_than_was_driven():
    out, back = np.arange(0.05, 5.0, 0.05), np.arange(4.95, -0.1, -0.05)
    for turn in (4.72, 4.9, 5.0):  # anywhere within reach of the waypoint
        xs = [*out[out < turn], *back[back < turn]]
        results = drive(Task(reward={"progress": 1.0}), xs)
        pays = np.array([reward for reward, _, _ in results])
        driven = np.abs(np.diff([0.0, *xs]))
        assert (np.abs(pays) <= driven + 1e-9).all()
        assert 9.3 < pays.sum() < 10.0
        assert results[-1][2]["arrived"]


def test_way_aside_of_the_path_pays_nothing():
    judged = Judged(Task(reward={"progress": 1.0}))
    assert [judged(2.0, y)[0] for y in (0.5, -2.0, 0.0)] == [2.0, 0.0, 0.0]


def test_every_waypoint_counts_even_from_a_start_beside_the_path():
    judged = Judged(Task(reward={"progress": 1.0}), Pose2(0.0, 3.0, 0.0))
    results = [judged(*place) for place in ((0.0, 2.0), (0.0, 0.0), (5.0, 0.0), (0.0, 0.0))]
    assert [reward for reward, _, _ in results] == pytest.approx([1.0, 2.0, 5.0, 5.0])
    assert [ends["arrived"] for _, _, ends in results] == [False, False, False, True]


def test_the_reward_is_the_sum_of_its_named_terms():
    task = Task(reward={"progress": 1.0, "collision": -3.0, "time": -1.0})
    ((reward, terms, _),) = drive(task, [0.5], collided=True)
    assert terms == pytest.approx({"progress": 0.5, "collision": -3.0, "time": -0.1})
    assert reward == pytest.approx(sum(terms.values()))


def test_ends_are_those_that_were_asked_for():
    ((_, _, ends),) = drive(Task(ends=("crashed",)), [0.5], collided=True)
    assert ends == {"crashed": True}
    ((_, _, ends),) = drive(Task(ends=()), [0.5], collided=True)
    assert ends == {}


def test_robots_of_one_judge_do_not_meet():
    """Many robots with paths of their own, each as if it were alone."""
    rng, task, n = np.random.default_rng(0), Task(), 5
    layouts = [replace(LAYOUT, path=rng.uniform(-2, 2, (rng.integers(1, 6), 2))) for _ in range(n)]
    together, alone = TaskProgress(task, n), [TaskProgress(task, 1) for _ in range(n)]
    poses = np.zeros((n, 3))
    for i, layout in enumerate(layouts):
        together.reset(i, layout, poses[i])
        alone[i].reset(0, layout, poses[i])
    for _ in range(50):
        which = np.flatnonzero(rng.random(n) < 0.7)
        poses[which] += rng.normal(0, 0.3, (len(which), 3))
        hits = rng.random(n) < 0.5
        together.update(which, poses, hits, 0.1)
        for i in which:
            alone[i].update(np.zeros(1, dtype=np.int64), poses[i : i + 1], hits[i : i + 1], 0.1)
        for i, judge in enumerate(alone):
            assert (together.terms[i] == judge.terms[0]).all()
            assert together.rewards[i] == judge.rewards[0]
            assert (together.ends[i] == judge.ends[0]).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"reward": {"fame": 1.0}}, "'progress', 'collision', 'time', 'arrived', got 'fame'"),
        ({"reward": {"time": float("nan")}}, "finite"),
        ({"ends": ("bored",)}, "'arrived', 'crashed', got 'bored'"),
        ({"reach": 0}, "Task.reach"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Task(**wrong)
