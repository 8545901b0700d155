import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import wrap_angle
from slam.graph.links import Links
from tests.slam.rings import way


def test_each_keyframe_is_compared_with_those_soon_before_it() -> None:
    poses = np.zeros((40, 3))
    poses[:, 0] = 10.0 * np.arange(40)  # no two are near each other
    found = Links()(poses)
    expected = {
        (later - k, later)
        for k, every in Links().before
        for later in range(k, 40)
        if later % every == 0
    }
    assert {tuple(pair) for pair in found.tolist()} == expected


def test_and_with_those_near_by_at_other_times() -> None:
    poses, links = way(3.0), Links(others=4, within=1.0, apart=6)
    soon = max(k for k, _ in links.before)
    pairs = links(poses)
    assert (pairs[:, 0] < pairs[:, 1]).all()
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    others = pairs[pairs[:, 1] - pairs[:, 0] > soon]
    off = poses[others[:, 0]] - poses[others[:, 1]]
    assert np.hypot(off[:, 0], off[:, 1]).max() <= 1.0
    assert np.median(np.abs(wrap_angle(off[:, 2]))) < 0.1  # most of these look the same way
    for here in np.unique(others[:, 1]).tolist():
        chosen = np.sort(others[others[:, 1] == here, 0])
        assert len(chosen) <= 4
        assert (np.diff(chosen) >= 6).all()
    third = len(poses) // 3
    last = others[others[:, 1] >= 2 * third + soon]
    for before in (last[:, 0] < third, (last[:, 0] >= third) & (last[:, 0] < 2 * third)):
        assert len(np.unique(last[before, 1])) > 0.9 * len(np.unique(last[:, 1]))  # both laps


@pytest.mark.parametrize("n", [1, 2, 33])
def test_a_few_keyframes(n: int) -> None:
    pairs = Links()(way(1.0)[:n])
    assert pairs.shape == (len(pairs), 2)
    assert (len(pairs) > 0) == (n > 1)


@pytest.mark.parametrize(
    "wrong", [{"within": 0.0}, {"per_rad": -1.0}, {"others": -1}, {"apart": 0}]
)
def test_parts_are_checked(wrong) -> None:
    with pytest.raises(InputError):
        Links(**wrong)
