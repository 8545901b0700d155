import numpy as np
import pytest

from dynslam_env import Robot
from dynslam_env.patrol.config import PatrolConfig
from slam import InputError

ROBOT = Robot()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"speed": 0.0}, "PatrolConfig.speed must be a finite number above 0"),
        ({"turn": -1.0}, "PatrolConfig.turn must be a finite number above 0"),
        ({"hold": 0}, "hold must be a whole number of at least 1"),
        ({"hold": 2.0}, "hold must be a whole number of at least 1"),
        ({"scan_every": 0}, "scan_every must be a whole number of at least 1"),
        ({"scan_every": 3}, "hold must be a multiple of scan_every, got 4 and 3"),
        ({"reward": {"pose": 1.0}}, "reward must be a RewardWeights"),
    ],
)
def test_wrong_orders_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        PatrolConfig(**wrong)


def test_an_action_of_one_is_the_speed_that_is_ordered():
    patrol_config = PatrolConfig(speed=0.6, turn=1.3)
    given = patrol_config.commands(np.array([[1.0, -1.0], [0.5, 0.0]]), ROBOT)
    driven = given * (ROBOT.max_speed, ROBOT.max_turn)
    assert driven == pytest.approx(np.array([[0.6, -1.3], [0.3, 0.0]]))


def test_actions_are_clipped():
    patrol_config = PatrolConfig()
    wild, tame = (patrol_config.commands(np.array([s, -s]), ROBOT) for s in (7.0, 1.0))
    assert (wild == tame).all()


@pytest.mark.parametrize("action", [0.5, [0.5], [0.1, 0.2, 0.3], ["left", "right"], [None, None]])
def test_what_is_no_action_is_refused(action):
    with pytest.raises(InputError, match="actions are numbers from -1 to 1"):
        PatrolConfig().commands(np.array(action), ROBOT)


def test_an_action_takes_its_time():
    assert PatrolConfig(hold=6).period == pytest.approx(0.6)
    assert PatrolConfig(speed=0.5, turn=2.0).limits == (0.5, 2.0)
