import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose2, compose
from slam.graph.path import INITIAL_UPDATES, Path

seeds = st.integers(0, 2**32 - 1)


def random_path(rng, n: int, maps: int) -> tuple[Path, np.ndarray, np.ndarray]:
    """A path, the frames of its local maps, and the poses that it should have."""
    path, frames = Path(), rng.uniform(-3, 3, (maps, 3))
    numbers, within = np.sort(rng.integers(0, maps, n)), rng.uniform(-3, 3, (n, 3))
    for number, pose in zip(numbers.tolist(), within, strict=True):
        path.append(number, Pose2.of(pose))
    return path, frames, compose(frames[numbers], within)


def same(found, expected) -> None:
    off = np.asarray(found) - expected
    off[..., 2] = np.angle(np.exp(1j * off[..., 2]))
    np.testing.assert_allclose(off, 0.0, atol=1e-9)


@given(seeds, st.sampled_from([0, 1, 30, INITIAL_UPDATES, 2 * INITIAL_UPDATES + 3]))
def test_a_path_is_what_was_appended(seed: int, n: int) -> None:
    path, frames, expected = random_path(np.random.default_rng(seed), n, 5)
    assert len(path) == n
    assert path.poses(frames).shape == (n, 3)
    same(path.poses(frames), expected)
    if n:
        same(np.array(path.last(frames)), expected[-1])


@given(seeds, st.integers(0, 4), st.integers(0, 4))
def test_poses_given_to_another_map_stay_where_they_are(seed: int, number: int, into: int) -> None:
    path, frames, expected = random_path(np.random.default_rng(seed), 40, 5)
    if into == number:
        into = (number + 1) % 5
    path.forget(number, into, Pose2.of(frames[into]).between(Pose2.of(frames[number])))
    left = np.delete(frames, number, axis=0)
    same(path.poses(left), expected)
    left[into - (into > number)] = compose((1.0, 2.0, 0.5), left[into - (into > number)])
    assert np.abs(path.poses(left) - expected).max() > 0.4  # they move with the other map


@given(seeds, st.integers(0, 40))
def test_a_part_given_to_a_new_frame_stays_where_it_is(seed: int, since: int) -> None:
    rng = np.random.default_rng(seed)
    path = Path()
    within = rng.uniform(-3, 3, (40, 3))
    for pose in within:
        path.append(0, Pose2.of(pose))
    frame = Pose2.of(rng.uniform(-3, 3, 3))
    path.rebase(since, 1, frame)
    frames = np.array([(1.0, -2.0, 0.3), compose((1.0, -2.0, 0.3), frame)])
    same(path.poses(frames), compose(frames[0], within))


@given(seeds, st.integers(1, 60))
def test_whatever_is_forgotten_while_it_grows_every_pose_stays_where_it_was(
    seed: int, updates: int
) -> None:
    """A local map that poses were given to has several runs of them."""
    rng = np.random.default_rng(seed)
    path, frames, expected = Path(), rng.uniform(-3, 3, (1, 3)), []
    for _ in range(updates):
        within = rng.uniform(-3, 3, 3)
        path.append(len(frames) - 1, Pose2.of(within))
        expected.append(compose(frames[-1], within))
        if rng.random() < 0.4:
            frames = np.vstack([frames, rng.uniform(-3, 3, 3)])
        elif len(frames) > 2 and rng.random() < 0.5:
            number, into = rng.choice(len(frames) - 1, 2, replace=False).tolist()
            moved = Pose2.of(frames[into]).between(Pose2.of(frames[number]))
            path.forget(number, into, moved)
            frames = np.delete(frames, number, axis=0)
        same(path.poses(frames), np.array(expected))
        same(np.array(path.last(frames)), expected[-1])


@given(seeds, st.integers(1, 4))
def test_poses_at_keyframes_move_with_them(seed: int, keyframes: int) -> None:
    rng = np.random.default_rng(seed)
    path, frames, expected = random_path(rng, 40, 3)
    number = 1
    before = path._within[:40][path._of(number)][:keyframes].copy()
    if not len(before):
        return
    after = compose(before, rng.uniform(-0.1, 0.1, before.shape))
    own = path._of(number)
    path.realign(number, before, after)
    expected[own[: len(before)]] = compose(frames[number], after)
    found = path.poses(frames)
    same(found[own[: len(before)]], expected[own[: len(before)]])
    others = np.setdiff1d(np.arange(40), own)
    same(found[others], expected[others])


def test_between_two_keyframes_a_pose_moves_with_both() -> None:
    path, frames = Path(), np.zeros((1, 3))
    for k in range(5):
        path.append(0, Pose2(0.1 * k))
    before = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]])
    path.realign(0, before, before + np.array([[0.0, 0.0, 0.0], [0.0, 0.04, 0.0]]))
    np.testing.assert_allclose(path.poses(frames)[:, 1], [0.0, 0.01, 0.02, 0.03, 0.04], atol=1e-12)
