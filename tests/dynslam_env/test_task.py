import numpy as np
import pytest

from dynslam_env import Layout, Task
from dynslam_env.task import Event
from slam import InputError, Pose2

LAYOUT = Layout(np.empty((0, 4)), (), Pose2(), np.array([(0.0, 0), (5, 0), (0, 0)]))


def drive(task, xs, collided=False):
    judge = task.judge(LAYOUT, Pose2())
    return [judge(Event(Pose2(x, 0.0, 0.0), collided, 0.1)) for x in xs]


def test_there_and_back_pays_the_length_of_the_path_once():
    xs = [*np.arange(0.5, 5.1, 0.5), *np.arange(4.5, -0.1, -0.5)]
    results = drive(Task(reward={"progress": 2.0}, reach=0.1), xs)
    assert sum(reward for reward, _, _ in results) == pytest.approx(2 * 10.0, abs=0.2)
    assert [ends["arrived"] for _, _, ends in results] == [False] * (len(xs) - 1) + [True]


def test_going_back_and_forth_pays_nothing():
    results = drive(Task(reward={"progress": 1.0}), [1, 2, 1, 2, 1, 0])
    assert sum(reward for reward, _, _ in results) == pytest.approx(0.0)


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
