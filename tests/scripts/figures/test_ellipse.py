# pyright: reportMissingImports=false
import numpy as np
import pytest
from dynslam_cli.figures.ellipse import ellipses, outline


def test_an_ellipse_holds_the_position_with_95_percent() -> None:
    rng = np.random.default_rng(5)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    covariance = np.eye(3)
    covariance[:2, :2] = turn @ np.diag([4.0, 0.25]) @ turn.T
    draws = rng.multivariate_normal(np.zeros(2), covariance[:2, :2], 40_000)
    (half,), (heading,) = ellipses(covariance[None])
    c, s = np.cos(heading), np.sin(heading)
    x, y = c * draws[:, 0] + s * draws[:, 1], -s * draws[:, 0] + c * draws[:, 1]
    inside = (x / half[0]) ** 2 + (y / half[1]) ** 2 < 1
    assert inside.mean() == pytest.approx(0.95, abs=0.005)


def test_the_outline_lies_on_it_and_one_that_is_sure_is_a_point() -> None:
    covariance = np.array([[2.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    around = outline(covariance)
    squares = np.einsum("ki,ij,kj->k", around, np.linalg.inv(covariance[:2, :2]), around)
    assert squares == pytest.approx(np.full(len(around), 5.9915), rel=1e-3)
    assert np.abs(outline(np.zeros((3, 3)))).max() == 0.0
