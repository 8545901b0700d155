import math

import numpy as np
import pytest
from scipy import stats

from dynslam_env import Corridor
from slam import InputError, Pose2
from slam.geometry import compose
from slam.metrics.cramer_rao import (
    MIN_COSINE,
    bound,
    information,
    ray_gradient,
    tracked,
    transition,
)

ANGLES = np.radians(np.arange(-90.0, 91.0))
AROUND = np.radians(np.arange(-180.0, 180.0, 2.0))
SQUARE = np.array([(-1.0, -1, 1, -1), (1, -1, 1, 1), (1, 1, -1, 1), (-1, 1, -1, -1)])
SIGMA = 0.01
CENTRE = Pose2()
BEYOND = Pose2(0.35, -0.2, 0.7)  # a sensor off the robot's centre


def seen(pose, angles, segments, mount=CENTRE, max_range=math.inf):
    """Ranges, unit normals and numbers of the segments that are hit; slow and obvious.

    o + r d = p + t (q - p) is solved for r and t by Cramer's rule, each beam and segment by itself.
    """
    o = pose @ mount
    ranges, numbers = np.full(len(angles), np.inf), np.full(len(angles), -1)
    for b, angle in enumerate(o.theta + angles):
        dx, dy = math.cos(angle), math.sin(angle)
        for i, (px, py, qx, qy) in enumerate(segments.tolist()):
            ex, ey, wx, wy = px - qx, py - qy, px - o.x, py - o.y
            det = dx * ey - dy * ex
            if det == 0:
                continue
            r, t = (wx * ey - wy * ex) / det, (dx * wy - dy * wx) / det
            if 0 < r < min(ranges[b], max_range) and 0 <= t <= 1:
                ranges[b], numbers[b] = r, i
    along = (segments[:, 2:] - segments[:, :2])[numbers]
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    normals[numbers < 0] = np.nan
    return ranges, normals, numbers


def scan_information(pose, segments, angles=ANGLES, mount=CENTRE, max_range=math.inf):
    ranges, normals, _ = seen(pose, angles, segments, mount, max_range)
    return information(ray_gradient(pose, angles, ranges, normals, mount), SIGMA)


def box(half):
    return half * SQUARE


def random_room(rng):
    """Twelve walls that cross each other at random in a closed box of 10 x 10 m."""
    return np.concatenate([box(5.0), rng.uniform(-5, 5, (12, 4))])


def random_pose(rng):
    return Pose2.of(rng.uniform((-4, -4, -3), (4, 4, 3)))


def random_psd(rng, rank=3):
    roots = rng.normal(size=(3, rank))
    return roots @ roots.T


# -- the gradient ----------------------------------------------------------------------------------


def compared(seed, mount, step=1e-6):
    """Gradients by formula and by central differences, of beams that stay on one segment."""
    rng = np.random.default_rng(seed)
    room, pose = random_room(rng), random_pose(rng)
    ranges, normals, numbers = seen(pose, ANGLES, room, mount)
    formula = ray_gradient(pose, ANGLES, ranges, normals, mount)
    same, columns = np.ones(len(ANGLES), dtype=bool), []
    for delta in step * np.eye(3):
        (more, _, a), (less, _, b) = (
            seen(Pose2.of(np.array(pose) + d), ANGLES, room, mount) for d in (delta, -delta)
        )
        same &= (a == numbers) & (b == numbers)
        columns.append((more - less) / (2 * step))
    at = (pose @ mount).theta + ANGLES
    cosine = np.abs(normals[:, 0] * np.cos(at) + normals[:, 1] * np.sin(at))
    kept = same & (cosine > MIN_COSINE)
    return formula[kept], np.stack(columns, axis=1)[kept]


@pytest.mark.parametrize("mount", [Pose2(), BEYOND, Pose2(-0.5, 0.4, 3.0)], ids=str)
def test_gradient_agrees_with_central_differences(mount):
    """Truncation is of order step^2, rounding of 1e-16 r / (step cos b): both below 1e-8."""
    pairs = [compared(seed, mount) for seed in range(10)]
    formula, differences = (np.concatenate(each) for each in zip(*pairs, strict=True))
    assert len(formula) > 1700
    scale = 1 + np.abs(differences)
    assert (np.abs(formula - differences) / scale).max() < 1e-8


def test_the_sign_of_a_normal_does_not_matter():
    rng = np.random.default_rng(0)
    room, pose = random_room(rng), random_pose(rng)
    ranges, normals, _ = seen(pose, ANGLES, room)
    flipped = normals * rng.choice([-1.0, 1.0], (len(normals), 1))
    a, b = (ray_gradient(pose, ANGLES, ranges, n, BEYOND) for n in (normals, flipped))
    assert np.array_equal(a, b)


@pytest.mark.parametrize("nothing", [math.inf, math.nan])
def test_no_echo_says_nothing(nothing):
    ranges, normals, _ = seen(Pose2(), ANGLES, SQUARE)
    full = ray_gradient(Pose2(), ANGLES, ranges, normals)
    ranges[::3], normals[::3] = nothing, math.nan
    some = ray_gradient(Pose2(), ANGLES, ranges, normals)
    assert (some[::3] == 0).all()
    rest = np.arange(len(ANGLES)) % 3 > 0
    assert np.array_equal(some[rest], full[rest])


def test_grazing_beams_count_as_if_they_met_the_wall_less_flatly():
    """A wall along x, hit at a cosine of 0.001 and at one of exactly 0."""
    along = np.array([math.asin(0.001), 0.0])
    normals = np.array([(0.0, 1.0), (0.0, 1.0)])
    gradient = ray_gradient(Pose2(), along, np.array([2.0, 2.0]), normals)
    assert np.abs(gradient[:, 1]) == pytest.approx(1 / MIN_COSINE)
    assert np.abs(gradient[:, 2]) == pytest.approx(2 / MIN_COSINE, rel=1e-5)
    just = ray_gradient(Pose2(), np.arcsin([0.0501]), np.array([2.0]), normals[:1])
    assert np.abs(just[0, 1]) == pytest.approx(1 / 0.0501)


def test_a_lever_arm_by_hand():
    """The sensor is half a metre ahead and looks left at a wall 1 m away: turning left nears it."""
    mount = Pose2(0.5, 0.0, math.pi / 2)
    gradient = ray_gradient(Pose2(), np.zeros(1), np.ones(1), np.array([(0.0, 1.0)]), mount)
    assert gradient == pytest.approx(np.array([(0.0, -1.0, -0.5)]))


# -- information and bound -------------------------------------------------------------------------


def test_a_square_room_by_hand():
    """Eight beams from the centre, atan(1/2) left and right of each wall's middle.

    Each has cos b = 2 / sqrt(5): (dr/dn)^2 = 5/4, four of them for x and four for y, and
    (dr/dtheta)^2 = (r tan b)^2 = 5/4 * 1/4, eight of them. All mixed terms cancel.
    """
    middles = math.pi / 2 * np.arange(4)
    angles = (middles[:, None] + math.atan(0.5) * np.array([-1, 1])).ravel()
    found = scan_information(Pose2(), SQUARE, angles)
    assert found == pytest.approx(np.diag([5, 5, 2.5]) / SIGMA**2, abs=1e-8)
    limit = bound(found)
    assert limit[:3] == pytest.approx((SIGMA / math.sqrt(5),) * 2 + (SIGMA / math.sqrt(2.5),))
    assert limit.covariance == pytest.approx(np.diag([1 / 5, 1 / 5, 1 / 2.5]) * SIGMA**2)


@pytest.mark.parametrize("seed", range(20))
def test_information_is_symmetric_and_positive_and_the_bound_its_inverse(seed):
    rng = np.random.default_rng(seed)
    found = scan_information(random_pose(rng), random_room(rng), mount=BEYOND)
    assert (found == found.T).all()
    assert np.linalg.eigvalsh(found).min() > 0
    limit = bound(found)
    assert limit.covariance @ found == pytest.approx(np.eye(3), abs=1e-6)
    assert limit[:3] == pytest.approx(np.sqrt(np.diag(limit.covariance)))


def test_information_of_one_beam_has_no_negative_part():
    ranges, normals, _ = seen(Pose2(0.1, 0.2, 0.3), np.zeros(1), SQUARE)
    gradient = ray_gradient(Pose2(0.1, 0.2, 0.3), np.zeros(1), ranges, normals)
    values = np.linalg.eigvalsh(information(gradient, 1.0))
    assert values[:2] == pytest.approx([0, 0], abs=1e-12)
    assert values[2] == pytest.approx((gradient**2).sum())


def test_more_beams_and_less_noise_say_more():
    rng = np.random.default_rng(0)
    room, pose = random_room(rng), random_pose(rng)
    ranges, normals, _ = seen(pose, ANGLES, room)
    gradient = ray_gradient(pose, ANGLES, ranges, normals)
    gained = information(gradient, SIGMA) - information(gradient[::2], SIGMA)
    assert np.linalg.eigvalsh(gained).min() > 0
    assert information(gradient, 2 * SIGMA) == pytest.approx(information(gradient, SIGMA) / 4)


@pytest.mark.parametrize("turn", [0.3, 2.0])
def test_a_turned_and_moved_world_turns_the_bound(turn):
    rng = np.random.default_rng(2)
    room, pose, moved = random_room(rng), random_pose(rng), Pose2(30.0, -7.0, turn)
    there = np.concatenate([compose(moved, np.c_[room[:, k : k + 2], np.zeros(len(room))])[:, :2]
                            for k in (0, 2)], axis=1)  # fmt: skip
    here = bound(scan_information(pose, room, mount=BEYOND)).covariance
    c, s = math.cos(turn), math.sin(turn)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    found = bound(scan_information(moved @ pose, there, mount=BEYOND)).covariance
    assert found == pytest.approx(rotation @ here @ rotation.T, rel=1e-6, abs=1e-12)


# -- what cannot be known --------------------------------------------------------------------------


def endless(heading):
    """A corridor 2 m wide along `heading`, longer than any laser can see."""
    c, s = math.cos(heading), math.sin(heading)
    walls = np.array([(-100.0, -1, 100, -1), (-100, 1, 100, 1)]).reshape(-1, 2)
    return (walls @ np.array([[c, s], [-s, c]])).reshape(-1, 4)


@pytest.mark.parametrize("mount", [Pose2(), BEYOND], ids=str)
def test_an_endless_corridor_bounds_nothing_along_it(mount):
    known = bound(scan_information(Pose2(), endless(0.0), AROUND, mount, 8.0))
    assert known.std_x == math.inf
    assert 0 < known.std_y < 0.002
    assert 0 < known.std_theta < 0.001
    assert np.isfinite(known.covariance[1:, 1:]).all()
    upright = bound(scan_information(Pose2(), endless(math.pi / 2), AROUND, mount, 8.0))
    assert upright.std_y == math.inf
    assert 0 < upright.std_x < 0.002


@pytest.mark.parametrize("heading", [0.2, 1.0, 2.5])
def test_an_endless_corridor_askew_leaves_only_the_heading(heading):
    straight = bound(scan_information(Pose2(), endless(0.0), AROUND, max_range=8.0))
    askew = bound(scan_information(Pose2(0, 0, heading), endless(heading), AROUND, max_range=8.0))
    assert askew.std_x == askew.std_y == math.inf
    assert askew.std_theta == pytest.approx(straight.std_theta)
    assert askew.covariance[0, 1] == math.copysign(math.inf, math.tan(heading))


def test_an_end_in_sight_bounds_all():
    closed = np.concatenate([endless(0.0), [(5.0, -1, 5, 1)]])
    known = bound(scan_information(Pose2(), closed, max_range=8.0))
    assert all(math.isfinite(std) for std in known[:3])


def test_a_round_room_says_nothing_of_the_heading_at_its_centre():
    """A polygon about the centre that each beam meets in the middle of a side."""
    gradient = ray_gradient(
        Pose2(), AROUND, np.full(len(AROUND), 3.0), np.stack([np.cos(AROUND), np.sin(AROUND)], 1)
    )
    known = bound(information(gradient, SIGMA))
    assert known.std_theta == math.inf
    assert known[:2] == pytest.approx((SIGMA / math.sqrt(len(AROUND) / 2),) * 2)


def test_no_echo_at_all_bounds_nothing():
    known = bound(np.zeros((3, 3)))
    assert known[:3] == (math.inf, math.inf, math.inf)
    assert (known.covariance[~np.eye(3, dtype=bool)] == 0).all()


# -- it bounds: maximum likelihood reaches it ------------------------------------------------------

ROOM = np.array([(-3.0, -2, 4, -1.5), (4, -1.5, 3, 2.5), (3, 2.5, -2, 3), (-2, 3, -3, -2)])
TRUTH = Pose2(0.4, -0.2, 0.5)


def maximum_likelihood(measured, mount):
    """Gauss-Newton on exact ranges, from the truth: the global maximum with so little noise."""
    pose = np.array(TRUTH)
    for _ in range(4):
        ranges, normals, _ = seen(Pose2.of(pose), AROUND[::3], ROOM, mount)
        gradient = ray_gradient(Pose2.of(pose), AROUND[::3], ranges, normals, mount)
        pose = pose + np.linalg.lstsq(gradient, measured - ranges)[0]
    return pose


@pytest.mark.parametrize("mount", [Pose2(), BEYOND], ids=str)
def test_maximum_likelihood_reaches_the_bound_and_does_not_pass_it(mount):
    trials, rng = 300, np.random.default_rng(0)
    exact, _, _ = seen(TRUTH, AROUND[::3], ROOM, mount)
    noisy = exact + SIGMA * rng.standard_normal((trials, len(exact)))
    errors = np.array([maximum_likelihood(z, mount) for z in noisy]) - TRUTH
    limit = bound(scan_information(TRUTH, ROOM, AROUND[::3], mount))
    ratios = errors.std(axis=0) / limit[:3]
    assert np.abs(ratios - 1).max() < 4 / math.sqrt(2 * trials)
    assert np.abs(errors.mean(axis=0) / limit[:3]).max() < 4 / math.sqrt(trials)
    whitened = errors @ np.linalg.cholesky(np.linalg.inv(limit.covariance))
    p = stats.chi2.cdf((whitened**2).sum(), 3 * trials)
    assert 0.001 < p < 0.999
    wrong = stats.chi2.cdf((whitened**2).sum() / 1.15**2, 3 * trials)
    assert wrong < 0.001  # a bound wrong by 15 % would be noticed


# -- tracking --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
def test_tracking_agrees_with_the_formula(seed):
    rng = np.random.default_rng(seed)
    before, Q, measured = (random_psd(rng) for _ in range(3))
    F = transition(random_pose(rng), random_pose(rng))
    formula = measured + np.linalg.inv(Q + F @ np.linalg.inv(before) @ F.T)
    found = tracked(before, F, Q, measured)
    assert found == pytest.approx(formula)
    assert (found == found.T).all()


def test_tracking_agrees_with_the_bound_of_the_whole_drive():
    """The last block of the inverse of the information about all poses of a drive together."""
    rng, steps = np.random.default_rng(0), 6
    scans = [random_psd(rng) for _ in range(steps)]
    moves = [(transition(random_pose(rng), random_pose(rng)), random_psd(rng)) for _ in scans[1:]]
    together = np.zeros((3 * steps, 3 * steps))
    for t, scan in enumerate(scans):
        together[3 * t : 3 * t + 3, 3 * t : 3 * t + 3] += scan
    for t, (F, Q) in enumerate(moves):
        residual = np.concatenate([-F, np.eye(3)], axis=1)
        both = slice(3 * t, 3 * t + 6)
        together[both, both] += residual.T @ np.linalg.inv(Q) @ residual
    J = scans[0]
    for (F, Q), scan in zip(moves, scans[1:], strict=True):
        J = tracked(J, F, Q, scan)
    assert bound(J).covariance == pytest.approx(np.linalg.inv(together)[-3:, -3:])


def test_scans_at_rest_add_up():
    scan, rest = random_psd(np.random.default_rng(0)), np.zeros((3, 3))
    J = scan
    for _ in range(9):
        J = tracked(J, np.eye(3), rest, scan)
    assert pytest.approx(10 * scan) == J


def test_a_steady_drive_by_hand():
    """One direction: j = i + 1 / (q + 1 / j), so j = (i + sqrt(i^2 + 4 i / q)) / 2."""
    i, q = np.array([4e4, 1e4, 1e6]), np.array([1e-4, 1e-6, 1e-5])
    J = np.zeros((3, 3))
    for _ in range(200):
        J = tracked(J, np.eye(3), np.diag(q), np.diag(i))
    assert pytest.approx(np.diag((i + np.sqrt(i**2 + 4 * i / q)) / 2)) == J


def test_a_blind_drive_by_hand():
    """2 m along x with heading known to 0.1 rad: 0.2 m more of doubt across, and none along."""
    before = np.linalg.inv(np.diag([0.01, 0.02, 0.01]))
    zeros = np.zeros((3, 3))
    after = tracked(before, transition(Pose2(1, 1, 0), Pose2(3, 1, 1)), zeros, zeros)
    expected = np.array([[0.01, 0, 0], [0, 0.02 + 4 * 0.01, 2 * 0.01], [0, 2 * 0.01, 0.01]])
    assert bound(after).covariance == pytest.approx(expected)


@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_what_is_not_known_stays_so_until_it_is_seen(heading):
    start = Pose2(0, 0, heading)
    corridor = scan_information(start, endless(heading), AROUND, max_range=8.0)
    F, Q, J = transition(start, start @ Pose2(0.1)), 1e-6 * np.eye(3), np.zeros((3, 3))
    for _ in range(300):
        J = tracked(J, F, Q, corridor)
    assert bound(J).std_x == math.inf
    assert bound(J).std_theta < bound(corridor).std_theta
    post = bound(J + np.diag([1e4, 0, 0]))
    assert post.std_x == pytest.approx(0.01)
    assert math.isfinite(post.std_y)


def test_transition_agrees_with_central_differences():
    before, u, step = Pose2(1.0, 2.0, 0.7), Pose2(0.3, -0.1, 0.4), 1e-6
    columns = [
        np.subtract(Pose2.of(before + d) @ u, Pose2.of(before - d) @ u) / (2 * step)
        for d in step * np.eye(3)
    ]
    assert transition(before, before @ u) == pytest.approx(np.stack(columns, axis=1), abs=1e-8)


# -- the corridor of section 5 of the theory -------------------------------------------------------


def leaf(door, opening):
    """(4, 4) edges of a door's leaf."""
    angle = door.closed + door.swing * opening
    c, s = math.cos(angle), math.sin(angle)
    corners = door.corners @ np.array([[c, s], [-s, c]]) + door.hinge
    return np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)


def corridor_bounds(opening):
    """Medians over places in eight corridors: along, across, m, and heading, degrees."""
    found = []
    for seed in range(8):
        layout = Corridor().layout(np.random.default_rng(seed))
        leaves = [leaf(door, opening) for door in layout.doors]
        world = np.concatenate([layout.walls, *leaves])
        for x in (2.0, 6.0, 10.0):
            found.append(bound(scan_information(Pose2(x), world, max_range=8.0))[:3])
    x, y, theta = np.median(found, axis=0)
    return x, y, math.degrees(theta)


def test_open_doors_tell_where_along_the_corridor_one_is():
    closed, opened = corridor_bounds(0.0), corridor_bounds(math.pi / 2)
    assert 0.001 < closed[0] < 0.003
    assert 0.0005 < opened[0] < 0.0015
    assert closed[0] > 1.5 * opened[0]
    for _, y, theta in (closed, opened):
        assert 0.0005 < y < 0.0015
        assert 0.005 < theta < 0.04


def test_frames_of_closed_doors_are_all_that_tells_it_out_of_sight_of_the_ends():
    bare = Corridor(doors_per_side=0).layout(np.random.default_rng(0)).walls
    assert bound(scan_information(Pose2(6.0), bare, max_range=5.0)).std_x == math.inf
    layout = Corridor().layout(np.random.default_rng(0))
    framed = np.concatenate([layout.walls, *(leaf(door, 0.0) for door in layout.doors)])
    assert bound(scan_information(Pose2(6.0), framed, max_range=5.0)).std_x < 0.005


# -- refusals --------------------------------------------------------------------------------------

FINE = {"angles": np.zeros(2), "ranges": np.ones(2), "normals": np.array([(1.0, 0), (0, 1)])}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"ranges": np.ones(3)}, r"shapes \(n,\), \(n,\) and \(n, 2\), got \(2,\), \(3,\)"),
        ({"normals": np.ones((2, 3))}, r"shapes .* got \(2,\), \(2,\) and \(2, 3\)"),
        ({"normals": np.ones((2, 2))}, "normals must be unit vectors wherever a beam hits"),
        ({"normals": np.full((2, 2), math.nan)}, "normals must be unit vectors"),
    ],
)
def test_wrong_beams_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        ray_gradient(Pose2(), **(FINE | wrong))


def test_wrong_informations_are_refused():
    with pytest.raises(InputError, match="sigma must be a finite number above 0, got 0"):
        information(np.zeros((4, 3)), 0.0)
    with pytest.raises(InputError, match=r"gradient must have shape \(n, 3\), got \(4, 2\)"):
        information(np.zeros((4, 2)), 1.0)
    with pytest.raises(InputError, match="information must be positive semi-definite"):
        bound(np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(InputError, match="information must be symmetric"):
        bound(np.triu(np.ones((3, 3))))
    with pytest.raises(InputError, match=r"information must have shape \(3, 3\), got \(2, 2\)"):
        bound(np.eye(2))
    with pytest.raises(InputError, match="information must hold finite numbers only"):
        bound(np.diag([1.0, math.inf, 1.0]))
    with pytest.raises(InputError, match=r"F must have shape \(3, 3\), got \(3, 4\)"):
        tracked(np.eye(3), np.ones((3, 4)), np.eye(3), np.eye(3))
    with pytest.raises(InputError, match="Q must be symmetric"):
        tracked(np.eye(3), np.eye(3), np.triu(np.ones((3, 3))), np.eye(3))
