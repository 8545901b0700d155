import numpy as np

from slam.geometry import Pose2
from slam.graph.echoes import echoes_of
from slam.maps.outline import LINE, outline
from slam.maps.static import Static
from tests.slam.worlds import scan_at

WALL = np.array([[2.0, -5.0, 2.0, 5.0]])
BOARD = np.array([[1.0, -0.3, 1.0, 0.3]])


def along(n: int) -> np.ndarray:
    """(n, 3) poses beside the wall, which they face."""
    return np.column_stack([np.zeros(n), np.linspace(-0.5, 0.5, n), np.zeros(n)])


def drawn(scans, poses) -> Static:
    grid = Static()
    for scan, pose in zip(scans, poses, strict=True):
        grid.integrate(scan, Pose2.of(pose))
    return grid


def test_a_surface_that_is_gone_counts_for_less() -> None:
    poses = along(20)
    boards = [BOARD] * 2 + [np.empty((0, 4))] * 18
    scans = [
        scan_at(Pose2.of(pose), walls=np.vstack([WALL, board]))
        for pose, board in zip(poses, boards, strict=True)
    ]
    echoes = echoes_of(scans, poses, drawn(scans, poses))
    on_board = echoes.points[:, 0] < 1.5
    assert on_board.sum() > 20
    assert echoes.weights[on_board].max() < 0.5
    assert np.median(echoes.weights[~on_board]) > 0.9
    assert (echoes.weights <= 1.0).all()


def test_the_tangents_are_surer_than_those_of_single_scans() -> None:
    rng, poses = np.random.default_rng(0), along(30)
    scans = [scan_at(Pose2.of(pose), walls=WALL, rng=rng) for pose in poses]
    echoes = echoes_of(scans, poses, drawn(scans, poses))
    single = np.concatenate(
        [one.tangents[one.kind == LINE] for one in (outline(scan.points) for scan in scans)]
    )
    assert np.square(echoes.tangents[:, 0]).mean() < 0.25 * np.square(single[:, 0]).mean()


def test_each_keyframe_has_its_echoes_by_bearing_the_sensor_on_their_left() -> None:
    mount, poses = Pose2(0.1, -0.2, 0.3), along(3)
    scans = [scan_at(Pose2.of(pose), walls=WALL, mount=mount) for pose in poses]
    echoes = echoes_of(scans, poses, drawn(scans, poses))
    assert echoes.begins[-1] == len(echoes.points) > 30
    for n, (begin, end) in enumerate(zip(echoes.begins, echoes.begins[1:], strict=False)):
        assert (np.diff(echoes.bearings[begin:end]) >= 0.0).all()
        x, y = (echoes.points[begin:end] - echoes.sensors[n]).T
        tx, ty = echoes.tangents[begin:end].T
        assert (ty * x - tx * y > 0.0).all()
        np.testing.assert_allclose(echoes.bearings[begin:end], np.arctan2(y, x), atol=1e-6)
