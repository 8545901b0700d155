import math

import numpy as np
import pytest
from evo.core import metrics as evo
from evo.core.trajectory import PosePath3D
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import compose
from slam.metrics import trajectory as scores

moderate = st.floats(-20, 20)


def walk(n: int, seed: int, step: float = 0.1) -> np.ndarray:
    """Poses `step` m apart, the heading along the way."""
    heading = np.cumsum(np.random.default_rng(seed).normal(0, 0.1, n))
    moves = step * np.column_stack([np.cos(heading), np.sin(heading)])
    xy = np.concatenate([[[0, 0]], np.cumsum(moves, axis=0)[:-1]])
    return np.column_stack([xy, heading])


def noisy(poses: np.ndarray, seed: int) -> np.ndarray:
    drift = np.cumsum(np.random.default_rng(seed).normal(0, 0.01, poses.shape), axis=0)
    return poses + drift


def as_evo(poses: np.ndarray) -> PosePath3D:
    matrices = []
    for x, y, theta in poses:
        c, s = math.cos(theta), math.sin(theta)
        matrices.append(np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]]))
    return PosePath3D(poses_se3=matrices)


@pytest.mark.parametrize("seed", range(3))
def test_ate_agrees_with_evo_as_is_and_aligned(seed: int) -> None:
    truth = walk(80, seed)
    estimate = noisy(truth, seed + 10)
    result = scores.score_trajectory(estimate, truth)

    plain = evo.APE(evo.PoseRelation.translation_part)
    plain.process_data((as_evo(truth), as_evo(estimate)))
    assert result.ate == pytest.approx(plain.get_statistic(evo.StatisticsType.rmse), rel=1e-9)

    moved = as_evo(estimate)
    moved.align(as_evo(truth))
    aligned = evo.APE(evo.PoseRelation.translation_part)
    aligned.process_data((as_evo(truth), moved))
    assert result.ate_aligned == pytest.approx(
        aligned.get_statistic(evo.StatisticsType.rmse), rel=1e-6
    )


def test_rpe_agrees_with_evo_on_equal_steps() -> None:
    truth = walk(80, 1)
    estimate = noisy(truth, 2)
    for relation, found in zip(
        (evo.PoseRelation.translation_part, evo.PoseRelation.rotation_angle_rad),
        scores.rpe(estimate, truth, 1.0),
        strict=True,
    ):
        oracle = evo.RPE(relation, 1.0, evo.Unit.meters, all_pairs=True, pairs_from_reference=True)
        oracle.process_data((as_evo(truth), as_evo(estimate)))
        assert len(oracle.error) == 70
        assert found == pytest.approx(oracle.get_statistic(evo.StatisticsType.rmse), rel=1e-6)


@given(moderate, moderate, st.floats(-math.pi, math.pi))
def test_scores_after_alignment_and_anchoring_ignore_a_rigid_motion(
    x: float, y: float, theta: float
) -> None:
    truth = walk(30, 4)
    moved = compose((x, y, theta), truth)
    assert np.allclose(scores.anchored(moved, truth)[:, :2], truth[:, :2], atol=1e-9)
    back = compose(scores.alignment(moved, truth), moved)
    assert scores.ate(back, truth) < 1e-9
    assert scores.rpe(moved, truth, 1.0) == pytest.approx((0, 0), abs=1e-6)


def test_no_rigid_motion_beats_the_alignment() -> None:
    truth = walk(50, 5)
    estimate = noisy(truth, 6)
    best = scores.alignment(estimate, truth)
    least = scores.ate(compose(best, estimate), truth)
    for change in np.random.default_rng(0).normal(0, 0.01, (50, 3)):
        assert scores.ate(compose(np.add(best, change), estimate), truth) >= least


def test_scores_by_hand() -> None:
    truth = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, math.pi]])
    estimate = np.array([[0.0, 0, 0], [1, 0.3, 0.2], [2, 0.4, -math.pi + 0.1]])
    result = scores.score_trajectory(estimate, truth)
    assert result.ate == pytest.approx(math.sqrt((0.3**2 + 0.4**2) / 3))
    assert result.heading_max == pytest.approx(0.2)
    assert result.heading_rms == pytest.approx(math.sqrt((0.2**2 + 0.1**2) / 3))
    assert result.end_position == pytest.approx(0.4)
    assert result.end_heading == pytest.approx(0.1)
    assert not result.failed
    assert scores.score_trajectory(estimate + (0, 0.3, 0), truth).failed


def test_a_path_too_short_for_rpe_is_none_in_json() -> None:
    result = scores.score_trajectory(np.zeros((3, 3)), np.zeros((3, 3))).as_dict("_x")
    assert result["rpe_translation_x"] is None
    assert result["ate_x"] == 0.0


def test_mismatched_poses_are_refused() -> None:
    with pytest.raises(InputError, match="same scans"):
        scores.score_trajectory(np.zeros((3, 3)), np.zeros((4, 3)))
    with pytest.raises(InputError, match="at least one"):
        scores.ate(np.zeros((0, 3)), np.zeros((0, 3)))
