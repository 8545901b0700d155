"""Each effect does what it says; without effects nothing has changed."""

import copy
import math
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import (
    WORLDS,
    CarriedAway,
    DoorWorldEnv,
    EchoLoss,
    Laser,
    Latency,
    MixedPixels,
    Quantisation,
    RangeNoise,
    Recorder,
    Surfaces,
    Sweep,
)
from dynslam_env.sensors.effect_scanner import EffectScanner, scanner_of
from dynslam_env.sensors.effects import MAX_AGE
from dynslam_env.sensors.laser import Scanner
from dynslam_env.sensors.materials import panels_of
from dynslam_env.simulation import world_batch
from dynslam_env.simulation.world import CONTROL_DT
from slam import InputError, Pose2

from .former_scanner import FormerScanner

SQUARE = np.array([(-2.0, -1, 3, -1), (3, -1, 3, 1), (3, 1, -2, 1), (-2, 1, -2, -1)])
ROOM = np.array([(-7.0, -4, 9, -4), (9, -4, 9, 5), (9, 5, -7, 5), (-7, 5, -7, -4)])
ALL = (
    RangeNoise(0.001, 0.0001),
    Quantisation(0.005),
    MixedPixels(),
    EchoLoss(reach=10.0),
    Surfaces(glass=0.2, dark=0.2),
    Sweep(0.06),
    Latency(0.03),
)


def laser_with(*effects, sigma=0.0, **parts: Any):
    return Laser(effects=effects, sigma=sigma, **parts)


class Looking:
    """A scanner that looks from robots' poses at segments, the first `walls` of which stand."""

    def __init__(self, laser, seed=0):
        self.scanner = scanner_of(laser, np.random.default_rng(seed))

    def __call__(self, pose, segments, walls=None):
        beams = self.scanner.laser.beams
        ranges, observed = np.empty(beams), np.empty(beams, dtype=np.float32)
        first_edge = len(segments) if walls is None else walls
        self.scanner.look(np.array(pose), segments, first_edge, ranges, observed)
        return ranges


def exact(laser, pose, segments, walls=None):
    scanner = Scanner(Laser(laser.beams, laser.field_of_view, laser.max_range, mount=laser.mount),
                      np.random.default_rng(0))  # fmt: skip
    return scanner.exact(Pose2.of(pose), segments, walls)


# -- without effects ---------------------------------------------------------------------------


def driven(laser=None, steps=80, name="DoorCorridor-v0", seed=4, **parts):
    env: Any = gym.make(name, laser=laser, **parts)
    observation, _ = env.reset(seed=seed)
    kept = [observation]
    for k in range(steps):
        kept.append(env.step(np.array([0.6, 0.3 * math.sin(k / 9)], dtype=np.float32))[0])
    return {key: np.array([row[key] for row in kept]) for key in observation}


@pytest.mark.parametrize("dropout", [0.0, 0.2])
@pytest.mark.parametrize("name", WORLDS)
def test_worlds_without_effects_measure_as_before_to_the_byte(name, dropout, monkeypatch):
    now = driven(Laser(dropout=dropout), name=name)
    assert world_batch.scanner_of(Laser(), np.random.default_rng(0)).__class__ is Scanner
    monkeypatch.setattr(world_batch, "scanner_of", FormerScanner)
    before = driven(Laser(dropout=dropout), name=name)
    for key, rows in now.items():
        assert rows.tobytes() == before[key].tobytes()


def test_effects_leave_doors_odometry_and_range_noise_as_they_were():
    plain, other = driven(), driven(laser_with(Quantisation(1e-9), sigma=0.01))
    assert plain["odometry"].tobytes() == other["odometry"].tobytes()
    assert plain["velocity"].tobytes() == other["velocity"].tobytes()
    assert np.abs(plain["scan"] - other["scan"]).max() < 1e-6


# -- range noise and rounding ------------------------------------------------------------------


def test_noise_grows_with_the_range():
    laser = laser_with(RangeNoise(0.004, 0.0005), beams=3, sigma=0.002, max_range=30.0)
    look, truth = Looking(laser), exact(laser, Pose2(), ROOM)
    errors = np.array([look(Pose2(), ROOM) - truth for _ in range(4000)])
    expected = 0.002 + 0.004 * truth + 0.0005 * truth**2
    assert errors.std(axis=0) == pytest.approx(expected, rel=0.06)
    assert np.abs(errors.mean(axis=0)).max() < 5 * expected.max() / math.sqrt(4000)


def test_ranges_are_whole_steps():
    laser = laser_with(Quantisation(0.05), sigma=0.01)
    ranges = Looking(laser)(Pose2(0.3, 0.2, 0.5), SQUARE) / 0.05
    assert ranges == pytest.approx(np.rint(ranges), abs=1e-9)
    assert len(np.unique(ranges)) > 10


# -- mixed pixels ------------------------------------------------------------------------------

DEEP = np.array([(4.0, -9.0, 4.0, 9.0), (3.2, 0.0, 3.2, 9.0)])  # a wall; before its left half one


def test_a_beam_over_an_edge_gives_a_range_between():
    laser = laser_with(MixedPixels(0.02, 1.0), beams=1)
    ranges = [Looking(laser)((0.0, 0.0, turn), DEEP)[0] for turn in np.linspace(-0.01, 0.01, 81)]
    inside = np.array(ranges)
    assert inside[0] == pytest.approx(4.0, abs=1e-3)
    assert inside[-1] == pytest.approx(3.2, abs=1e-3)
    assert (np.diff(inside) < 1e-4).all()
    assert set(np.round(inside, 2)) == {4.0, 3.84, 3.68, 3.52, 3.36, 3.2}  # 0 to 5 of 5 rays


def test_farther_surfaces_are_echoes_of_their_own():
    laser = laser_with(MixedPixels(0.02, 0.7), beams=1)
    ranges = [Looking(laser)((0.0, 0.0, turn), DEEP)[0] for turn in np.linspace(-0.01, 0.01, 81)]
    assert set(np.round(ranges, 2)) == {4.0, 3.2}
    assert ranges.index(min(ranges)) < 40  # the nearer one is seen by a part of the beam


def test_away_from_edges_a_beam_is_as_thin_as_before():
    laser = laser_with(MixedPixels(0.005, 5.0))
    pose = (0.3, 0.2, 0.7)
    ranges, truth = Looking(laser)(pose, SQUARE), exact(laser, pose, SQUARE)
    corners = np.arctan2(SQUARE[:, 1] - 0.2, SQUARE[:, 0] - 0.3) - 0.7
    apart = np.abs(np.angle(np.exp(1j * (laser.angles[:, None] - corners)))).min(axis=1)
    assert np.abs(ranges - truth)[apart > 0.003].max() < 1e-12
    assert (apart <= 0.003).sum() < 4


# -- lost echoes, glass and dark walls ---------------------------------------------------------


def chances(laser, pose, segments, scans=4000):
    look = Looking(laser)
    return np.mean([np.isinf(look(pose, segments)) for _ in range(scans)], axis=0)


def test_echoes_are_lost_by_range_and_incidence_as_the_formula_says():
    loss = EchoLoss(reach=6.0, reflectivity=0.6, sharpness=2.0, share=0.1)
    laser = laser_with(loss, beams=7, max_range=50.0)
    lost = chances(laser, (0.0, 0.0, 0.3), ROOM)
    truth = exact(laser, (0.0, 0.0, 0.3), ROOM)
    x, y = truth * np.cos(laser.angles + 0.3), truth * np.sin(laser.angles + 0.3)
    upright = np.isclose(x, 9.0)
    cosine = np.abs(np.where(upright, x, y)) / truth
    q = (6.0 / truth) ** 2 * 0.6 * cosine
    expected = 1.0 - 0.9 * (1.0 - 1.0 / (1.0 + q**2))
    assert np.ptp(expected) > 0.4
    assert lost == pytest.approx(expected, abs=5 * 0.5 / math.sqrt(4000))


PANE = np.array([(2.0, -6.0, 2.0, 6.0), (5.0, -30.0, 5.0, 30.0)])


def test_glass_is_seen_at_right_angles_only_and_what_is_behind_it_else():
    laser = laser_with(Surfaces(glass=(0,), visible=0.1), beams=101, field_of_view=2.0)
    ranges = Looking(laser)((0.0, 0.0, 0.0), PANE)
    ahead = np.abs(laser.angles) <= 0.1
    assert ranges[ahead] == pytest.approx(2.0 / np.cos(laser.angles[ahead]))
    beyond = 5.0 / np.cos(laser.angles[~ahead])
    seen = beyond < laser.max_range
    assert ranges[~ahead][seen] == pytest.approx(beyond[seen])
    assert np.isinf(ranges[~ahead][~seen]).all()
    assert 0 < seen.sum() < len(seen)


def test_behind_glass_there_may_be_nothing_or_what_moves():
    laser = laser_with(Surfaces(glass=(0,), visible=0.0), beams=2, field_of_view=0.4)
    assert np.isinf(Looking(laser)((0.0, 0.0, 0.0), PANE[:1])).all()
    leaf = np.array([(4.0, 3.0, 4.0, -3.0)])
    turned = np.array([(4.0, -3.0, 4.0, 3.0)])
    seen = [Looking(laser)((0.0, 0.0, 0.0), np.vstack([PANE[:1], e]), 1)[0] for e in (leaf, turned)]
    assert sorted(seen) == [pytest.approx(4.0 / math.cos(0.2)), math.inf]  # one is its far side


def test_glass_weakens_what_is_behind_it():
    loss, pane = EchoLoss(reach=5.0, reflectivity=0.8), Surfaces(glass=(0,), visible=0.0)
    behind = chances(laser_with(loss, pane, beams=1), (0.0, 0.0, 0.05), PANE)
    bare = chances(laser_with(loss, beams=1), (0.0, 0.0, 0.05), PANE[1:])
    q = 0.8 * math.cos(0.05) ** 3
    assert bare == pytest.approx(1 / (1 + q**4), abs=0.04)
    assert behind == pytest.approx(1 / (1 + (0.7 * q) ** 4), abs=0.04)


def test_dark_walls_are_lost_where_others_are_seen():
    loss = EchoLoss(reach=20.0)
    laser = laser_with(loss, Surfaces(dark=(0, 2), reflectivity=0.02), beams=4,
                       field_of_view=1.5 * math.pi, max_range=12.0)  # fmt: skip
    lost = chances(laser, (0.0, 0.0, math.pi / 4), ROOM, 500)  # right, ahead, left, behind
    assert (lost > 0.1).tolist() == [True, False, True, False]


def test_a_share_of_the_walls_is_of_glass_and_it_covers_them():
    laser = laser_with(EchoLoss(), Surfaces(glass=0.3, dark=0.2, panel=0.5))
    kinds, lengths = np.zeros(3), []
    for seed in range(60):
        look = Looking(laser, seed)
        look(Pose2(), ROOM)
        scanner: Any = look.scanner
        panels = scanner.panels
        size = np.hypot(*(panels.segments[:, 2:] - panels.segments[:, :2]).T)
        lengths.append(size.sum())
        assert size.max() <= 0.5 + 1e-9
        assert (np.flatnonzero(panels.codes == 2) >= panels.opaque).all()
        kinds += np.bincount(panels.codes, minlength=3) / 60 / len(size)
    assert lengths == pytest.approx([50.0] * 60)
    assert kinds == pytest.approx([0.5, 0.2, 0.3], abs=0.03)


@pytest.mark.parametrize("turn", [0.0, 0.4, math.pi / 2, 2.9])
def test_both_faces_of_a_wall_are_of_glass(turn):
    c, s = math.cos(turn), math.sin(turn)
    faces = np.array([(0.3, 2.0, 5.9, 2.0), (6.1, 2.2, 0.3, 2.2), (0.3, 3.0, 5.9, 3.0)])
    turned = np.hstack([faces[:, k : k + 2] @ np.array([(c, s), (-s, c)]) for k in (0, 2)])
    alike = apart = 0
    for seed in range(40):
        panels = panels_of(turned, Surfaces(glass=0.5), np.random.default_rng(seed))
        middle = (panels.segments[:, :2] + panels.segments[:, 2:]) / 2
        across = -middle[:, 0] * s + middle[:, 1] * c
        along = np.round(middle[:, 0] * c + middle[:, 1] * s, 2)
        codes = [dict(zip(along[np.isclose(across, n)], panels.codes[np.isclose(across, n)],
                          strict=True)) for n in (2.0, 2.2, 3.0)]  # fmt: skip
        common = codes[0].keys() & codes[1].keys()
        assert len(common) >= 4
        alike += sum(codes[0][k] != codes[1][k] for k in common)
        apart += sum(codes[0][k] != codes[2][k] for k in codes[0].keys() & codes[2].keys())
    assert alike == 0
    assert apart > 40


def test_panels_are_those_of_the_episode():
    env: Any = gym.make("DoorCorridor-v0", laser=laser_with(Surfaces(glass=0.5))).unwrapped
    first = [env.reset(seed=seed)[0]["scan"] for seed in (1, 2, 1)]
    assert (first[0] == first[2]).all()
    panels = env.scanner.panels
    env.step(np.zeros(2, dtype=np.float32))
    assert env.scanner.panels is panels


def test_a_wall_that_is_not_there_is_refused():
    env = DoorWorldEnv(laser=laser_with(Surfaces(glass=(1, 999))))
    with pytest.raises(InputError, match="names wall 999, and the layout has"):
        env.reset(seed=0)


# -- the sweep and its delay -------------------------------------------------------------------


def test_the_step_of_the_laser_is_that_of_the_world():
    assert MAX_AGE == CONTROL_DT


@pytest.mark.parametrize(("duration", "delay"), [(0.1, 0.0), (0.06, 0.03), (0.0, 0.05), (0.02, 0)])
def test_each_beam_is_measured_from_where_the_laser_was(duration, delay):
    effects = [Sweep(duration)] if duration else []
    effects += [Latency(delay)] if delay else []
    mount = Pose2(0.1, -0.05, 0.4)
    laser = laser_with(*effects, beams=181, mount=mount, max_range=30.0)
    before, now = np.array((0.2, 0.1, 3.0)), np.array((0.31, 0.06, 3.4))
    leaf = np.array([(1.0, -2.0, 1.5, 2.0), (-2.0, 2.0, -3.0, -2.0)])
    moved = leaf + np.array([(0.0, 0.0, 0.2, 0.1), (0.0, 0.0, 0.1, 0.0)])
    look = Looking(laser)
    look(before, np.vstack([ROOM, leaf]), 4)
    ranges = look(now, np.vstack([ROOM, moved]), 4)
    ages = delay + duration * (1 - np.arange(181) / 180)
    for b in range(0, 181, 5):
        share = 1 - ages[b] / CONTROL_DT
        pose = before + share * (now - before)
        segments = np.vstack([ROOM, leaf + share * (moved - leaf)])
        expected = exact(laser, pose, segments, 4)[b]
        assert ranges[b] == pytest.approx(expected, abs=0.003)  # cast in groups of 2 ms
        if not duration:
            assert ranges[b] == pytest.approx(expected, abs=1e-9)


def test_a_late_scan_of_a_whole_step_is_that_of_the_step_before():
    on_time, late = driven(laser_with(beams=61)), driven(laser_with(Latency(0.1), beams=61))
    assert np.abs(late["scan"][1:] - on_time["scan"][:-1]).max() < 0.02
    assert np.abs(on_time["scan"][1:] - on_time["scan"][:-1]).max() > 0.05


@pytest.mark.parametrize(
    "effects", [(Latency(0.06),), (Sweep(0.08),), (Sweep(0.06), Latency(0.03))]
)
def test_in_a_recording_the_true_pose_is_that_of_the_middle_beam(effects):
    laser = laser_with(*effects, beams=61, mount=Pose2(0.05, 0.0, 0.0))
    env: Any = gym.make("DoorCorridor-v0", laser=laser, doors="static").unwrapped
    env.reset(seed=4)
    recorder = Recorder(env)
    for k in range(60):
        env.step(np.array([0.6, 0.3 * math.sin(k / 9)], dtype=np.float32))
        recorder.step()
    episode = recorder.episode({})
    truth = episode.known_truth("a test")
    off = []
    for k in (30, 45, 60):
        segments = np.vstack([truth.walls, truth.doors[k]])
        middle = exact(laser, truth.poses[k], segments, len(truth.walls))[30]
        off.append(abs(middle - episode.scans[k].ranges[30]))
        late = exact(laser, env.pose, segments, len(truth.walls))[30]
    assert max(off) < 0.004
    assert abs(late - episode.scans[60].ranges[30]) > 0.01


def test_a_standing_robot_sees_no_distortion():
    laser = laser_with(Sweep(0.1))
    look = Looking(laser)
    ranges = [look((0.3, 0.2, 0.5), SQUARE) for _ in range(3)][-1]
    assert ranges == pytest.approx(exact(laser, (0.3, 0.2, 0.5), SQUARE), abs=1e-9)


def test_a_robot_that_is_carried_does_not_sweep_on_the_way():
    laser = laser_with(Sweep(0.1))
    look = Looking(laser)
    look((-1.5, 0.0, 0.0), SQUARE)
    look.scanner.carried()
    assert look((2.0, 0.3, 1.0), SQUARE) == pytest.approx(
        exact(laser, (2.0, 0.3, 1.0), SQUARE), abs=1e-9
    )
    fault = CarriedAway(distance=0.5, at=2.0)
    env: Any = gym.make("DoorCorridor-v0", laser=laser, faults=[fault], doors="static").unwrapped
    env.reset(seed=0)
    carried = False
    while not carried:
        *_, info = env.step(np.array([0.6, 0.0], dtype=np.float32))
        carried = info["faults"]["CarriedAway"]
        assert info["time"] < 10.0
    truth = exact(laser, env.pose, env.physics.segments, env.physics.first_edge)
    heard = np.isfinite(truth) & np.isfinite(env.scan.ranges)
    assert np.median(np.abs(env.scan.ranges[heard] - truth[heard])) < 0.01


# -- the same everywhere -----------------------------------------------------------------------


@pytest.mark.parametrize("laser", [Laser(effects=ALL), "SICK-LMS200"])
@pytest.mark.parametrize("threads", [1, 2])
def test_vector_and_single_environments_see_the_same_to_the_byte(laser, threads):
    native = gym.make_vec("DoorCorridor-v0", 3, laser=laser, threads=threads)
    singles = [gym.make("DoorCorridor-v0", laser=laser) for _ in range(3)]
    seen, _ = native.reset(seed=5)
    alone = [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)]
    rng = np.random.default_rng(0)
    for _ in range(40):
        for i in range(3):
            assert seen["scan"][i].tobytes() == alone[i]["scan"].tobytes()
        actions = rng.uniform(-1, 1, (3, 2)).astype(np.float32)
        seen = native.step(actions)[0]
        alone = [env.step(action)[0] for env, action in zip(singles, actions, strict=True)]


def test_the_same_seed_gives_the_same_bytes():
    a, b = driven(Laser(effects=ALL)), driven(Laser(effects=ALL))
    assert a["scan"].tobytes() == b["scan"].tobytes()
    assert (a["scan"] != driven(Laser(effects=ALL), seed=5)["scan"]).any()


@pytest.mark.parametrize(
    "clone", [copy.deepcopy, lambda scanner: pickle.loads(pickle.dumps(scanner))]
)
def test_a_copy_of_a_scanner_goes_on_as_the_original(clone):
    look = Looking(Laser(effects=ALL))
    for k in range(5):
        look((0.1 * k, 0.0, 0.2 * k), SQUARE)
    other = Looking(Laser())
    other.scanner = clone(look.scanner)
    for k in range(40):
        pose = (0.5 - 0.01 * k, 0.1, 0.9)
        assert look(pose, SQUARE).tobytes() == other(pose, SQUARE).tobytes()


def test_a_scanner_holds_nothing_of_others():
    look, segments = Looking(Laser(effects=ALL)), ROOM.copy()
    pose = np.array((0.0, 0.0, 0.0))
    look(pose, segments)
    held = look.scanner.__dict__
    for value in (held["_segments"], held["_pose"], held["panels"].segments):
        assert not np.shares_memory(value, segments)
        assert not np.shares_memory(value, pose)


# -- wrong parameters --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (MixedPixels(), "must be a tuple of effects"),
        ((MixedPixels,), "must be one of RangeNoise, Quantisation"),
        (("glass",), "must be one of RangeNoise, Quantisation"),
        ((Sweep(), Sweep()), "each kind of effect once, got two Sweep"),
        ((Sweep(0.08), Latency(0.03)), r"at most 0\.1 s together"),
        ((Surfaces(dark=0.1),), "need an EchoLoss"),
    ],
)
def test_wrong_effects_are_refused(effects, message):
    with pytest.raises(InputError, match=message):
        Laser(effects=effects)


def test_a_slow_beam_is_refused():
    with pytest.raises(InputError, match="less than 10 rad/s"):
        Laser(field_of_view=0.5, effects=(Sweep(0.1),))


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (RangeNoise, {"linear": -0.1}),
        (Quantisation, {"step": 0.0}),
        (MixedPixels, {"rays": 4}),
        (MixedPixels, {"width": 1.0}),
        (EchoLoss, {"reflectivity": 1.2}),
        (EchoLoss, {"share": -0.1}),
        (Surfaces, {"glass": 1.5}),
        (Surfaces, {"glass": (0, -1)}),
        (Surfaces, {"panel": 0.0}),
        (Sweep, {"duration": 0.2}),
        (Latency, {"delay": 0.0}),
    ],
)
def test_wrong_parameters_are_refused(kind, wrong):
    with pytest.raises(InputError, match=f"{kind.__name__}.{next(iter(wrong))}"):
        kind(**wrong)


def test_shares_are_at_most_the_whole():
    with pytest.raises(InputError, match="at most 1 together"):
        Surfaces(glass=0.6, dark=0.6)


def test_a_list_of_effects_becomes_a_tuple():
    effects: Any = [MixedPixels(), Sweep()]
    assert Laser(effects=effects) == Laser(effects=(MixedPixels(), Sweep()))
    assert isinstance(scanner_of(Laser(effects=effects), np.random.default_rng(0)), EffectScanner)


def test_the_bound_is_not_known_with_effects():
    env = DoorWorldEnv(laser=Laser(effects=(MixedPixels(),)))
    env.reset(seed=0)
    with pytest.raises(InputError, match="not known for a laser with effects"):
        env.bound()
