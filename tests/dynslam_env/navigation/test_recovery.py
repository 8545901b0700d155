import numpy as np

from dynslam_env.navigation.follower import State
from dynslam_env.navigation.recovery import BACK_UP, STUCK_TIME, Recovery
from slam import Pose2


def test_recovery_backs_off_then_turns_then_ends():
    recovery, pose = Recovery(np.random.default_rng(0)), Pose2()
    assert not recovery.stuck(0.0, pose, State.DRIVING)
    assert not recovery.stuck(STUCK_TIME, pose, State.DRIVING)
    assert recovery.stuck(STUCK_TIME + 0.1, pose, State.DRIVING)
    assert recovery.begin(5.0) == BACK_UP
    commands = [recovery.command(t) for t in np.arange(5.0, 10.0, 0.1)]
    kinds = ["back" if c == BACK_UP else "turn" if c else "over" for c in commands]
    assert list(dict.fromkeys(kinds)) == ["back", "turn", "over"]


def test_who_stands_still_on_purpose_or_turns_is_not_stuck():
    recovery = Recovery(np.random.default_rng(0))
    assert not any(recovery.stuck(t, Pose2(), State.STANDING) for t in range(20))
    turning = (Pose2(0.0, 0.0, 0.2 * t) for t in range(40))
    assert not any(recovery.stuck(t, pose, State.TURNING) for t, pose in enumerate(turning))
