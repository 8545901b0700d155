import math
import warnings
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import Doors, DoorWorldEnv, FinalScores, Gap, Laser, Odometry, SlamWrapper, Uniform
from dynslam_env.drawing.render import Viewer
from dynslam_env.slam_run import crop_map, crop_points
from slam import Estimate, GridSpec, InputError, OccupancyGrid, Pose2, Truth
from slam.algorithms.dead_reckoning import DeadReckoning
from slam.interface import Sampled
from slam.metrics.change import TrueOccupancy
from tests.dynslam_env.test_vector import same

FORWARD = np.array([0.5, 0.02], dtype=np.float32)
PERFECT = Odometry(bias=0.0, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
SPEC = GridSpec(0.05, -64, -64, 128, 128)


class Fixed:
    """A SLAM that believes its odometry and has always the same map."""

    def __init__(self, start, rng):
        self.pose, self.updates = start, []
        self.drawn = rng.random()

    def update(self, motion, scan):
        self.updates.append((motion, scan))
        self.pose = self.pose @ motion
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, True)

    def map(self):
        occupied, observed = np.full(SPEC.shape, 0.5), np.zeros(SPEC.shape, dtype=bool)
        occupied[:, :74], observed[:, :74] = 0.0, True  # free and seen up to x = 0.5 m
        occupied[:, 73] = 1.0
        return OccupancyGrid(SPEC, occupied, observed)


def wrapped(slam: Any = "odometry", env: Any = None, **parameters: Any) -> SlamWrapper:
    return SlamWrapper(env or DoorWorldEnv(), slam, **parameters)


def test_perfect_odometry_makes_dead_reckoning_perfect():
    env = wrapped(env=DoorWorldEnv(odometry=PERFECT))
    _, info = env.reset(seed=0)
    for _ in range(50):
        _, _, _, _, info = env.step(FORWARD)
    assert info["slam"]["position_error"] == pytest.approx(0.0, abs=1e-9)
    assert info["slam"]["heading_error"] == pytest.approx(0.0, abs=1e-9)
    assert info["slam"]["pose"] == pytest.approx(info["pose"])


def test_errors_are_those_of_the_pose():
    env = wrapped()
    _, info = env.reset(seed=0)
    for _ in range(40):
        _, _, _, _, info = env.step(FORWARD)
    estimate, truth = info["slam"]["pose"], info["pose"]
    assert info["slam"]["position_error"] == pytest.approx(math.dist(estimate[:2], truth[:2]))
    assert info["slam"]["heading_error"] == pytest.approx(
        math.remainder(estimate[2] - truth[2], math.tau)
    )
    assert info["slam"]["position_error"] > 0.1  # the bias bends the way


def test_what_the_slam_tells_of_itself_is_in_the_information(monkeypatch):
    update = DeadReckoning.update
    monkeypatch.setattr(
        DeadReckoning, "update", lambda *given: update(*given)._replace(lost=0.7, drift=0.4)
    )
    env = wrapped()
    env.reset(seed=0)
    info = env.step(FORWARD)[4]
    assert (info["slam"]["lost"], info["slam"]["drift"]) == (0.7, 0.4)


def test_the_map_is_scored_at_the_interval_and_at_the_end():
    env = wrapped(env=gym.make("DoorCorridor-v0", max_episode_steps=8), score_every=3)
    _, info = env.reset(seed=0)
    scored = ["f1_5cm" in info["slam"]]
    for _ in range(8):
        info = env.step(FORWARD)[4]
        scored.append("f1_5cm" in info["slam"])
    assert scored == [True, False, False, True, False, False, True, False, True]
    expected = {"f1_5cm", "f1_10cm", "adnn_map_to_truth", "adnn_truth_to_map"}
    expected |= {"brier_now_all", "brier_share_all"}
    assert expected <= set(info["slam"])


@pytest.mark.parametrize("slam", ["static-ml", "static-graph"])
def test_finish_gives_the_final_scores_where_a_limit_is_outside(slam):
    """As an episode of the same length whose end the wrapper sees."""
    parts: Any = {"score_every": 5, "scan_every": 3, "slam": slam}
    inside = wrapped(env=gym.make("DoorCorridor-v0", max_episode_steps=8), **parts)
    outside = gym.wrappers.TimeLimit(wrapped(env=DoorWorldEnv(), **parts), 8)
    infos = []
    for env in (inside, outside):
        env.reset(seed=0)
        for _ in range(7):
            env.step(FORWARD)
        *_, over, info = env.step(FORWARD)
        assert over
        infos.append(info["slam"])
    assert "f1_5cm" not in infos[1]
    around = FinalScores(outside)
    around.reset(seed=0)
    told = [around.step(FORWARD)[-1]["slam"] for _ in range(8)]
    assert ["f1_5cm" in one for one in told] == [k in (4, 7) for k in range(8)]
    same(told[-1], infos[0])
    for _ in range(2):
        same(outside.get_wrapper_attr("finish")(), infos[0])


def test_scores_of_the_change_are_those_of_all_that_was():
    env = wrapped(score_every=10, env=DoorWorldEnv(doors=Doors(Uniform(0.5, 2.0))))
    _, info = env.reset(seed=0)
    for episode in range(2):
        if episode:
            _, info = env.reset()
        world = env.unwrapped
        assert isinstance(world, DoorWorldEnv)
        walls, outlines = world.layout.walls, [world.outline()]
        for step in range(1, 41):
            info = env.step(FORWARD)[4]
            outlines.append(world.outline())
            if step % 10 == 0:
                truth = Truth(np.empty((0, 3)), walls, np.array(outlines))
                expected = TrueOccupancy(truth).score(env.slam.map()).as_dict()
                assert expected.items() <= info["slam"].items()


def test_each_moment_of_the_doors_is_rasterised_once(monkeypatch):
    moments, add = [], TrueOccupancy.add
    monkeypatch.setattr(
        TrueOccupancy, "add", lambda self, doors: moments.append(len(doors)) or add(self, doors)
    )
    env = wrapped(score_every=3)
    env.reset(seed=0)
    for _ in range(9):
        env.step(FORWARD)
    assert moments == [1, 3, 3, 3]


def test_never_scored_if_not_asked_for():
    env = wrapped(score_every=0)
    env.reset(seed=0)
    assert "f1_5cm" not in env.step(FORWARD)[4]["slam"]


def test_a_good_map_scores_well():
    perfect = DoorWorldEnv(odometry=PERFECT, doors="static", laser=Laser(sigma=0.001))
    env = wrapped(env=perfect, score_every=60)
    _, info = env.reset(seed=0)
    for _ in range(60):
        info = env.step(FORWARD)[4]
    assert info["slam"]["f1_10cm"] > 0.8
    assert info["slam"]["adnn_map_to_truth"] < 0.05


def test_a_builder_of_ones_own_sees_every_scan_from_the_true_start():
    env = wrapped(Fixed, seed=7)
    env.reset(seed=0)
    for _ in range(4):
        env.step(FORWARD)
    fixed = env.slam
    assert isinstance(fixed, Fixed)
    assert [scan.time for _, scan in fixed.updates] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert fixed.updates[0][0] == Pose2()
    assert fixed.drawn == np.random.default_rng(7).random()


TURNING = np.array([0.6, 0.4], dtype=np.float32)


def every_second(limit=7):
    """An episode of which the SLAM takes in every second scan; what it was told after each step."""
    env = wrapped(Fixed, gym.make("DoorCorridor-v0", max_episode_steps=limit), scan_every=2,
                  score_every=0)  # fmt: skip
    infos = [env.reset(seed=0)[1]]
    infos += [env.step(TURNING)[4] for _ in range(limit)]
    fixed = env.slam
    assert isinstance(fixed, Fixed)
    return fixed, infos


def test_of_scans_that_are_left_out_the_slam_knows_nothing_but_of_the_last():
    fixed, _ = every_second()
    times = [scan.time for _, scan in fixed.updates]
    assert times == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.7])


def test_the_way_between_two_scans_is_all_that_the_wheels_told():
    fixed, _ = every_second()
    alone, moved, ways = DoorWorldEnv(), Pose2(), [Pose2()]
    alone.reset(seed=0)
    for step in range(1, 8):
        alone.step(TURNING)
        moved = moved @ alone.displacement
        if step % 2 == 0 or step == 7:
            ways.append(moved)
            moved = Pose2()
    assert [motion for motion, _ in fixed.updates] == ways
    assert min(motion.x for motion, _ in fixed.updates[1:]) > 0.0
    assert fixed.updates[3][0].theta > 0.01


def test_between_two_scans_the_estimate_is_the_last_one():
    _, infos = every_second()
    poses = [info["slam"]["pose"].tolist() for info in infos]
    errors = [info["slam"]["position_error"] for info in infos]
    same = [a == b for a, b in pairwise(poses)]
    assert same == [True, False, True, False, True, False, False]
    assert errors[2] == errors[3]


def test_the_estimate_is_that_of_the_last_scan_that_was_taken_in():
    env = wrapped(Fixed, scan_every=3)
    with pytest.raises(gym.error.ResetNeeded):
        _ = env.estimate
    env.reset(seed=0)
    poses = []
    for _ in range(4):
        env.step(TURNING)
        poses.append(env.estimate.pose)
    assert poses[0] == poses[1] != poses[2] == poses[3] == env.slam.pose


def test_a_new_episode_forgets_the_way_of_the_one_before():
    env = wrapped(Fixed, scan_every=2)
    env.reset(seed=0)
    env.step(TURNING)
    env.reset(seed=0)
    fixed = env.slam
    assert isinstance(fixed, Fixed)
    env.step(TURNING)
    assert len(fixed.updates) == 1
    assert fixed.updates[0][0] == Pose2()


def test_a_new_episode_has_a_new_slam():
    env = wrapped(Fixed)
    env.reset(seed=0)
    first = env.slam
    env.reset(seed=0)
    assert env.slam is not first


def test_the_wrapper_changes_nothing_of_the_episode():
    alone, env = DoorWorldEnv(), wrapped()
    for seed in (0, None):
        a, b = alone.reset(seed=seed), env.reset(seed=seed)
        assert a[0]["scan"].tobytes() == b[0]["scan"].tobytes()
        for _ in range(5):
            a, b = alone.step(FORWARD), env.step(FORWARD)
            assert a[0]["scan"].tobytes() == b[0]["scan"].tobytes()
            assert a[1:4] == b[1:4]


def test_the_observation_carries_map_and_pose_if_asked():
    env = wrapped(map_crop=4.0, pose_estimate=True)
    observation, _ = env.reset(seed=0)
    assert observation["map"].shape == (1, 80, 80)
    assert observation["pose_estimate"] == pytest.approx([0.8, 0.0, 0.0])
    observation = env.step(FORWARD)[0]
    assert observation in env.observation_space
    assert set(observation) == {"scan", "odometry", "velocity", "map", "pose_estimate"}


def test_in_the_crop_ahead_is_up_and_left_is_left():
    points = crop_points(2.0, 0.05)
    assert points.shape == (40, 40, 2)
    grid = Fixed(Pose2(), np.random.default_rng(0)).map()
    ahead = crop_map(grid, Pose2(0, 0, 0), points)  # the wall at x = 0.45 .. 0.5 m is 9 cells ahead
    assert (ahead[10] == 255).all()
    assert (ahead[:10] == 128).all()
    assert (ahead[11:] == 0).all()
    left = crop_map(grid, Pose2(0, 0, -math.pi / 2), points)
    assert (left[:, 10] == 255).all()
    assert (left[:, :10] == 128).all()


@pytest.mark.parametrize(
    "slam", ["odometry", "static-ml", "dynamic-ml", "dynamic-graph", "static-pf"]
)
def test_the_crop_is_that_of_the_whole_map(slam):
    env = wrapped(slam, map_crop=6.0, pose_estimate=True)
    observation, _ = env.reset(seed=0)
    for _ in range(6):
        observation = env.step(FORWARD)[0]
    assert isinstance(env.slam, Sampled)
    expected = crop_map(env.slam.map(), env.slam.pose, crop_points(6.0, 0.05))
    assert (expected != 128).mean() > 0.1
    assert (observation["map"][0] == expected).mean() > 0.999  # points on the borders of cells


def test_checkers_have_no_complaint():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(wrapped(map_crop=4.0, pose_estimate=True))


def test_an_unknown_variant_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"unknown SLAM variant 'magic'; known: odometry"):
        wrapped("magic")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"slam": 3}, "slam must be a builder"),
        ({"score_every": -1}, "score_every must be a whole number of at least 0"),
        ({"score_every": math.nan}, "score_every must be a whole number of at least 0"),
        ({"scan_every": 0}, "scan_every must be a whole number of at least 1"),
        ({"scan_every": 1.5}, "scan_every must be a whole number of at least 1"),
        ({"map_crop": 0.0}, "map_crop must be a finite number above 0"),
        ({"map_crop": -1}, "map_crop must be a finite number above 0"),
        ({"map_crop": math.inf}, "map_crop must be a finite number above 0"),
        ({"map_cell": 0}, "map_cell must be a finite number above 0"),
        ({"map_crop": 4.0, "map_cell": math.nan}, "map_cell must be a finite number above 0"),
        ({"map_crop": 1.0}, "at least 36 cells"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrapped(**wrong)


def test_another_environment_is_refused():
    with pytest.raises(InputError, match="needs an environment of dynslam_env"):
        SlamWrapper(gym.make("CartPole-v1"), "odometry")  # type: ignore[arg-type]


def test_a_window_shows_the_map_after_the_step(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    drawn, draw = [], Viewer.draw

    def spied(self, scene, belief=None, view=None):
        drawn.append((scene, belief))
        return draw(self, scene, belief, view)

    monkeypatch.setattr(Viewer, "draw", spied)
    env = wrapped(score_every=0, env=DoorWorldEnv(render_mode="human"))
    world: Any = env.unwrapped
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.array([1.0, 0.2], dtype=np.float32))
        scene, belief = drawn[-1]
        assert belief.pose == env.slam.pose
        assert scene.pose == world.pose
    assert len(drawn) == 4
    env.close()


class Revised(Fixed):
    """Believes at every third scan that all it said was a metre too far to the right."""

    def __init__(self, start, rng):
        super().__init__(start, rng)
        self.said, self.shift, self.finished = [], 0, 0

    def update(self, motion, scan):
        estimate = super().update(motion, scan)
        self.said.append(estimate.pose)
        revised = len(self.said) % 3 == 0
        self.shift += revised
        return estimate._replace(revised=revised)

    def trajectory(self):
        return np.array(self.said) + (0.0, float(self.shift), 0.0)

    def finish(self):
        self.finished += 1
        self.shift += 10


def test_the_trail_is_what_is_believed_now():
    env = wrapped(Revised, env=gym.make("DoorCorridor-v0", max_episode_steps=7), score_every=0)
    _, info = env.reset(seed=0)
    revised, trails = [info["slam"]["revised"]], [np.array(env._begun.trail)]
    for _ in range(7):
        info = env.step(FORWARD)[4]
        revised.append(info["slam"]["revised"])
        trails.append(np.array(env._begun.trail))
    robot: Any = env.slam
    said = np.array(robot.said)
    assert revised == [False, False, True, False, False, True, False, False]
    assert robot.finished == 1
    for k, trail in enumerate(trails[:-1]):
        at = 3 * ((k + 1) // 3)  # until where the shift of then is known
        np.testing.assert_allclose(trail[:at, 1] - said[:at, 1], at // 3)
        np.testing.assert_allclose(trail[at:], said[at : k + 1])
    np.testing.assert_allclose(trails[-1][:, 1] - said[:, 1], 12.0)
    assert all(isinstance(pose, Pose2) for pose in env._begun.trail)


@pytest.mark.parametrize("variant", ["static-graph", "dynamic-pf"])
def test_a_slam_that_revises_runs_an_episode(variant):
    env = wrapped(variant, env=gym.make("DoorCorridor-v0", max_episode_steps=40), score_every=20)
    _, info = env.reset(seed=0)
    keys = {"pose", "position_error", "heading_error", "matched", "revised"}
    assert keys <= set(info["slam"])
    for _ in range(40):
        info = env.step(FORWARD)[4]
        assert keys <= set(info["slam"])
        assert isinstance(info["slam"]["revised"], bool)
        assert info["slam"]["position_error"] < 0.2
    robot: Any = env.slam
    np.testing.assert_allclose(np.array(env._begun.trail), robot.trajectory())
    assert len(env._begun.trail) == 41
    assert "f1_5cm" in info["slam"]


@pytest.mark.parametrize("scan_every", [1, 3])
def test_a_slam_waits_for_the_next_scan_and_gets_the_whole_displacement(scan_every):
    slams = []

    def build(start, rng):
        slams.append(Fixed(start, rng))
        return slams[-1]

    world = DoorWorldEnv(odometry=PERFECT, faults=[Gap(1.0, at=1.5)])
    env = wrapped(build, world, scan_every=scan_every, score_every=0)
    env.reset(seed=0)
    poses = [world.pose]
    for _ in range(40):
        env.step(FORWARD)
        poses.append(world.pose)
    steps = [k for k in range(0, 41, scan_every) if not 15 <= k < 25]
    updates = slams[-1].updates
    assert [round(10 * scan.time) for _, scan in updates] == steps
    for (motion, scan), (a, b) in zip(updates[1:], pairwise(steps), strict=True):
        assert np.array(motion) == pytest.approx(np.array(poses[a].between(poses[b])), abs=1e-9)
        assert np.isfinite(scan.ranges).any()


class Doubtful(Fixed):
    def update(self, motion, scan):
        return super().update(motion, scan)._replace(lost=0.25 * len(self.updates))


def test_info_tells_how_probably_it_is_lost():
    env = wrapped(Doubtful)
    told = [env.reset(seed=0)[1]["slam"]["lost"]]
    told += [env.step(FORWARD)[4]["slam"]["lost"] for _ in range(2)]
    assert told == [0.25, 0.5, 0.75]
