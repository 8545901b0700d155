import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynslam_env import Corridor, Laser
from dynslam_env.sensors.laser import Scanner
from dynslam_env.simulation.polygons import Polygons, regular
from slam import InputError, Pose2
from tests.dynslam_env import naive

SQUARE = np.array([(-2.0, -1, 3, -1), (3, -1, 3, 1), (3, 1, -2, 1), (-2, 1, -2, -1)])
EXACT = Laser(sigma=0.0)


def scanner(laser=EXACT, seed=0):
    return Scanner(laser, np.random.default_rng(seed))


class Looking:
    """A scanner that looks from robots' poses at walls, or at solids."""

    def __init__(self, laser, seed=0):
        self.laser, self.scanner = laser, scanner(laser, seed)

    def __call__(self, pose, segments):
        """What a SLAM takes, and what is in the observation."""
        ranges, observed = np.empty(self.laser.beams), np.empty(self.laser.beams, dtype=np.float32)
        self.scanner.look(np.array(pose), segments, len(segments), ranges, observed)
        return ranges, observed


def worlds():
    rng = np.random.default_rng(0)
    for seed in range(4):
        layout = Corridor().layout(np.random.default_rng(seed))
        leaves = [naive.leaf(d, d.closed + d.swing * rng.uniform(0, 1.5)) for d in layout.doors]
        segments = np.concatenate([layout.walls, *leaves])
        yield Pose2(rng.uniform(0.5, 11.5), rng.uniform(-0.9, 0.9), rng.uniform(-4, 4)), segments
    for _ in range(8):
        yield Pose2.of(rng.uniform(-3, 3, 3)), rng.uniform(-9, 9, (40, 4))


@pytest.mark.parametrize(("pose", "segments"), list(worlds()))
def test_ranges_agree_with_the_naive_reference(pose, segments):
    x, y, theta = pose
    expected = naive.cast(x, y, theta, EXACT.angles, segments, EXACT.max_range)
    ranges = scanner().exact(pose, segments)
    assert (np.isinf(ranges) == np.isinf(expected)).all()
    hit = np.isfinite(expected)
    assert np.abs(ranges[hit] - expected[hit]).max() < 1e-4


# -- thousands of scans ----------------------------------------------------------------------------

SURE = 1e-6  # rad: nearer than this to an end of a segment, single precision decides


def check_ranges(scanner, ranges, pose, segments):
    """Every range is that of a segment which is there, and nothing that is there is nearer."""
    laser = scanner.laser
    x, y, theta = pose @ laser.mount
    real, sure = naive.meetings(x, y, theta, laser.angles, segments)
    near = (real > 0) & (real < laser.max_range + 1e-4)
    there = near & (sure > -SURE) & (np.abs(real - ranges[:, None]) <= 1e-4)
    finite = np.isfinite(ranges)
    assert there[finite].any(axis=1).all()
    nearest = np.where(near & (sure > SURE) & (real < laser.max_range - 1e-4), real, math.inf)
    assert (ranges <= nearest.min(axis=1, initial=math.inf) + 1e-4).all()
    rows = np.flatnonzero(finite)
    assert np.abs(real[rows, scanner.hits[rows]] - ranges[rows]).max(initial=0.0) < 1e-4
    assert (scanner.hits[~finite] == -1).all()


def soup(rng, pose, angles, kind, n):
    """Segments (n, 4) of one kind."""
    at = np.array(pose[:2])
    if kind == "long":
        return rng.uniform(-9, 9, (n, 4))
    if kind == "tiny":
        first = rng.uniform(-9, 9, (n, 2))
        sizes = 10.0 ** rng.uniform(-6, 0, (n, 1))
        return np.hstack([first, first + sizes * rng.normal(0, 1, (n, 2))])
    if kind == "star":  # a closed one around the sensor
        turns = np.sort(rng.uniform(0, math.tau, n))
        points = at + rng.uniform(0.1, 7, (n, 1)) * np.column_stack([np.cos(turns), np.sin(turns)])
        return np.hstack([points, np.roll(points, -1, axis=0)])
    if kind == "along beams":  # seen edge-on, from as near to their lines as it gets
        nearly = 10.0 ** rng.uniform(-9, -3, n) * rng.normal(0, 1, n)
        turns = pose.theta + rng.choice(angles, n) + nearly
        start, stop, aside = *rng.uniform(0.1, 6, (2, n)), 10.0 ** rng.uniform(-12, -2, n)
    else:  # "close by": lines that pass the sensor, or have it nearly on them
        turns = rng.uniform(-4, 4, n)
        start, stop, aside = *rng.uniform(-6, 6, (2, n)), 10.0 ** rng.uniform(-8, 0, n)
    ahead = np.column_stack([np.cos(turns), np.sin(turns)])
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * (aside * rng.choice([-1, 1], n))[:, None]
    return np.hstack([at + left + start[:, None] * ahead, at + left + stop[:, None] * ahead])


FANS = st.tuples(
    st.one_of(st.sampled_from([1, 2, 3, 181, 361]), st.integers(1, 2000)),
    st.one_of(st.sampled_from([math.pi, math.tau, 1.5 * math.pi, 0.001]), st.floats(0.001, 6.28)),
    st.sampled_from([2.0, 8.0, 30.0]),
)


@pytest.mark.parametrize("kind", ["long", "tiny", "star", "close by", "along beams"])
def test_ranges_agree_with_exact_geometry(kind):
    @settings(max_examples=600, derandomize=True)
    @given(FANS, st.integers(0, 2**32), st.integers(1, 50), st.booleans())
    def check(fan, seed, n, straight):
        beams, field_of_view, max_range = fan
        rng = np.random.default_rng(seed)
        laser = Laser(beams, field_of_view, max_range, sigma=0.0)
        pose = Pose2.of((*rng.uniform(-3, 3, 2), 0.0 if straight else rng.uniform(-4, 4)))
        segments = soup(rng, pose, laser.angles, kind, n)
        looking = scanner(laser)
        check_ranges(looking, looking.exact(pose, segments), pose, segments)

    check()


@settings(max_examples=300, derandomize=True)
@given(st.integers(0, 2**32), st.integers(1, 12), st.booleans())
def test_far_sides_of_solids_are_hidden_by_their_near_sides(seed, count, mounted):
    """Seen from outside, polygons whose far sides are left out look the same."""
    rng = np.random.default_rng(seed)
    mount = Pose2.of(rng.uniform(-0.3, 0.3, 3)) if mounted else Pose2()
    laser = Laser(361, math.tau, sigma=0.0, mount=mount)
    pose = Pose2.of(rng.uniform(-3, 3, 3))
    shapes = [regular(rng.uniform(0.05, 1), int(rng.integers(3, 9))) for _ in range(count)]
    polygons = Polygons(shapes)
    walls, edges = rng.uniform(-9, 9, (5, 4)), np.empty((polygons.count, 4))
    sizes = np.array([np.linalg.norm(shape[0]) for shape in shapes])
    turns, sensor = rng.uniform(0, math.tau, count), pose @ mount
    away = sizes + rng.uniform(0.001, 5, count)
    x, y = sensor.x + away * np.cos(turns), sensor.y + away * np.sin(turns)
    polygons.outline(np.column_stack([x, y, rng.uniform(-4, 4, count)]), edges)
    segments, one_sided = np.concatenate([walls, edges]), scanner(laser)
    ranges = one_sided.exact(pose, segments, first_edge=len(walls))
    check_ranges(one_sided, ranges, pose, segments)
    assert ranges == pytest.approx(scanner(laser).exact(pose, segments), abs=1e-6)


def test_a_far_side_is_not_seen_from_inside():
    polygons = Polygons([regular(1.0, 5)])
    edges = np.empty((5, 4))
    polygons.outline(np.zeros((1, 3)), edges)
    assert np.isinf(scanner().exact(Pose2(), edges, first_edge=0)).all()
    assert np.isfinite(scanner().exact(Pose2(), edges)).all()


def test_a_wall_that_a_beam_runs_along_hides_nothing_and_is_no_ghost():
    """Beams exactly along a wall, from within a hair of its line: on to what is behind it."""
    behind = (6.0, -3.0, 6.0, 3.0)
    for aside in (0.0, 1e-17, 1e-15, 1e-13, 1e-10, 1e-8):
        for heading in np.linspace(-math.pi, math.pi, 361):
            pose, laser = Pose2(0.0, aside, heading), Laser(361, math.tau, sigma=0.0)
            walls = np.array([(1.0, 0.0, 3.0, 0.0), behind])
            at = np.argmin(np.abs(np.angle(np.exp(1j * (laser.angles + heading)))))
            ranges = scanner(laser).exact(pose, walls)
            assert ranges[at] == pytest.approx(6.0, abs=1e-3) or 1.0 <= ranges[at] <= 3.0 + 1e-9


def test_a_room_by_hand():
    ranges = scanner(Laser(beams=5, sigma=0)).exact(Pose2(), SQUARE)
    assert ranges == pytest.approx([1, math.sqrt(2), 3, math.sqrt(2), 1])


def test_no_echo_beyond_the_range():
    ranges = scanner(Laser(beams=3, sigma=0, max_range=2.5)).exact(Pose2(), SQUARE)
    assert ranges.tolist() == [pytest.approx(1), math.inf, pytest.approx(1)]


def test_nothing_slips_through_where_two_walls_meet():
    turned = np.linspace(0, math.tau, 2000)
    laser = scanner(Laser(beams=361, sigma=0, field_of_view=math.tau, max_range=100))
    for theta in turned[::20]:
        assert np.isfinite(laser.exact(Pose2(0.3, 0.2, theta), SQUARE)).all()


@pytest.mark.parametrize("fan", [(1, 1.0), (2001, 1e-3), (2000, 1e-4)])
def test_nor_between_narrow_beams(fan):
    """Beams closer together than the angles of corners are known to the kernel."""
    laser, rng = scanner(Laser(*fan, sigma=0.0)), np.random.default_rng(0)
    for _ in range(200):
        x, y = rng.uniform((-1.9, -0.9), (2.9, 0.9))
        corner = SQUARE[rng.integers(4), :2]
        theta = math.atan2(corner[1] - y, corner[0] - x) + rng.choice([0.0, 1e-6, -1e-5])
        assert np.isfinite(laser.exact(Pose2(x, y, theta), SQUARE)).all()


def test_the_mount_moves_the_sensor():
    mounted = scanner(Laser(beams=1, sigma=0, mount=Pose2(0.5, 0.2, math.pi / 2)))
    assert mounted.exact(Pose2(1, 0, 0), SQUARE) == pytest.approx([0.8])


def test_noise_has_the_configured_deviation_and_no_bias():
    noisy, truth = Looking(Laser()), scanner().exact(Pose2(), SQUARE)
    errors = np.array([noisy(Pose2(), SQUARE)[0] - truth for _ in range(200)])
    n = errors.size
    assert abs(errors.mean()) < 5 * 0.01 / math.sqrt(n)
    assert errors.std() == pytest.approx(0.01, abs=5 * 0.01 / math.sqrt(2 * n))


def test_noise_is_independent_from_scan_to_scan_and_beam_to_beam():
    noisy, truth = Looking(Laser()), scanner().exact(Pose2(), SQUARE)
    errors = np.array([noisy(Pose2(), SQUARE)[0] - truth for _ in range(200)]) / 0.01
    for shifts in ((1, 0), (0, 1), (32, 0), (32, 1)):  # 32: scans whose noise is drawn at once
        products = errors * np.roll(errors, shifts, axis=(0, 1))
        assert abs(products.mean()) < 5 / math.sqrt(errors.size)


def test_dropouts_are_no_reading_at_all():
    dropping = Looking(Laser(dropout=0.2))
    looks = [dropping(Pose2(), SQUARE) for _ in range(100)]
    ranges, observed = (np.array(each) for each in zip(*looks, strict=True))
    assert np.isnan(ranges).mean() == pytest.approx(0.2, abs=0.02)
    assert not dropping.scanner.scan(ranges[0], 0.0).hit[np.isnan(ranges[0])].any()
    assert (observed[np.isnan(ranges)] == 0).all()
    assert (observed[~np.isnan(ranges)] == ranges[~np.isnan(ranges)].astype(np.float32)).all()


def test_a_reading_nearer_than_the_minimum_is_none_at_all():
    near = Looking(Laser(beams=3, sigma=0.0, min_range=0.5))
    ranges, observed = near(Pose2(0.0, 0.7, 0.0), SQUARE)  # the wall on the left is 0.3 m away
    assert ranges == pytest.approx([1.7, 3.0, math.nan], nan_ok=True)
    assert observed == pytest.approx([1.7, 3.0, 0.0])
    assert near.scanner.scan(ranges, 0.0).hit.tolist() == [True, True, False]


def test_noise_gives_no_reading_below_zero():
    ranges, observed = Looking(Laser(sigma=2.0, min_range=0.0))(Pose2(), SQUARE)
    assert np.isnan(ranges).any()
    assert observed.min() == 0.0


def test_no_echo_is_infinite_in_the_scan_and_the_range_in_the_observation():
    laser = Looking(Laser())
    ranges, observed = laser(Pose2(), np.empty((0, 4)))
    assert laser.scanner.scan(ranges, 0.0).no_echo.all()
    assert (observed == 8.0).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"beams": 0},
        {"beams": 1.5},
        {"field_of_view": 7.0},
        {"sigma": -0.1},
        {"dropout": 1.1},
        {"max_range": math.inf},
        {"min_range": 9.0},
        {"mount": (0, 0, 0)},
    ],
)
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(InputError, match=f"Laser.*{next(iter(wrong))}"):
        Laser(**wrong)


def test_scanners_of_one_laser_share_nothing_that_can_be_written_to():
    one, other = scanner(seed=0), scanner(seed=1)
    one.fan[:] = 0.0
    assert np.array_equal(other.fan, [np.cos(EXACT.angles), np.sin(EXACT.angles)])
    with pytest.raises(ValueError, match="read-only"):
        one.angles[0] = 0.0
