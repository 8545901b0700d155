"""Physics, laser and doors of running worlds, in thousands of cases drawn by hypothesis."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st
from scipy import stats

from dynslam_env import (
    Corridor,
    Door,
    Doors,
    Exponential,
    Fixed,
    Laser,
    Odometry,
    People,
    Robot,
    Scripted,
    Uniform,
)
from dynslam_env.simulation.world import CONTROL_DT
from slam import InputError, Pose2
from tests.dynslam_env import naive
from tests.dynslam_env.driven import NIMBLE, SHUT, Driven, Track, place

CM = 0.01  # m: the robot never gets further into anything
PIONEER = Robot()
SPEED, TURN, RADIUS = PIONEER.max_speed, PIONEER.max_turn, PIONEER.radius


def cases(count):
    """So many cases, always the same ones."""
    checks = [HealthCheck.filter_too_much, HealthCheck.too_slow, HealthCheck.data_too_large]
    return settings(max_examples=count, derandomize=True, suppress_health_check=checks)


def real(low, high):
    return st.floats(low, high, allow_nan=False, width=64)


def began(*args, **parameters):
    """Driven, unless the robot cannot stand where it would begin."""
    try:
        return Driven(*args, **parameters)
    except InputError:
        reject()


# -- walls -----------------------------------------------------------------------------------------


def chain(*points):
    points = np.array(points)
    return np.hstack([points[:-1], points[1:]])


def turned(walls, angle, shift=(0.0, 0.0)):
    c, s = math.cos(angle), math.sin(angle)
    return (walls.reshape(-1, 2) @ np.array([(c, s), (-s, c)]) + shift).reshape(-1, 4)


@st.composite
def obstacles(draw, kind):
    """What the robot runs into when it comes along x: walls (n, 4) near the origin."""
    turn, aside, size = draw(real(-1.5, 1.5)), draw(real(-0.25, 0.25)), draw(real(0.0, 1.0))
    c, s = 4 * math.cos(0.1 + 0.6 * size), 4 * math.sin(0.1 + 0.6 * size)
    if kind == "wall":
        return turned(chain((0, -5), (0, 5)), turn)
    if kind == "corner":
        return turned(chain((-4, -4), (0, 0), (-4, 4)), turn / 2)
    if kind == "wedge":  # in which the robot gets stuck
        return chain((-c, -s), (0, 0), (-c, s))
    if kind == "nose":
        return turned(chain((c, -s), (0, 0), (c, s)), turn, (0, aside))
    if kind == "end":
        return turned(chain((0, 0), (4, 0)), turn, (0, aside))
    if kind == "post":  # millimetres to centimetres thick
        half = 0.0005 + 0.02 * size
        return turned(chain((-half, 0), (half, 0)), turn, (0, aside))
    if kind == "pillar":
        h = 0.01 + 0.14 * size
        return turned(chain((-h, -h), (h, -h), (h, h), (-h, h), (-h, -h)), turn, (0, aside))
    gap = RADIUS - 0.06 + 0.08 * size  # "slot": half as wide as the robot needs, or a little more
    return np.vstack([chain((-0.2, gap), (3, gap)), chain((-0.2, -gap), (3, -gap))])


@st.composite
def drives(draw, steps, sharp):
    """Full speed ahead or backwards, perhaps turning; then whatever comes."""
    v = SPEED * draw(st.sampled_from([1.0, -1.0]))
    bend = draw(st.sampled_from([0.0, 0.0, 1.0])) * draw(real(-2, 2)) * sharp
    then, spin = draw(real(-SPEED, SPEED)), draw(real(-TURN, TURN))
    half = steps // 2
    return [(v, bend)] * half + [(then, spin)] * (steps - half)


ROBOTS = {"nimble": (NIMBLE, 24, 120), "pioneer": (PIONEER, 60, 75)}
KINDS = ("wall", "corner", "wedge", "nose", "end", "post", "pillar", "slot")


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_walls_hold_the_robot(kind, robot):
    body, steps, count = ROBOTS[robot]
    bearings, farthest = (0.1 if kind in ("slot", "wedge") else 0.6), 1.0 if body is NIMBLE else 1.6
    worst, hits = -math.inf, 0

    @cases(count)
    @given(obstacles(kind), drives(steps, body is NIMBLE), real(0.45, farthest), real(-1, 1))
    def check(walls, commands, away, side):
        nonlocal worst, hits
        bearing = bearings * side
        x, y = -away * math.cos(bearing), -away * math.sin(bearing)
        heading = bearing if commands[0][0] > 0 else bearing + math.pi
        track = Track(began(place(walls, (), Pose2(x, y, heading)), body), commands)
        assert track.dent() <= CM
        assert not track.tunnelled()
        worst, hits = max(worst, track.dent()), hits + track.collided.any()

    check()
    assert hits > 0.4 * count
    assert worst > -0.001  # m: it did touch (drawn cases change with the modules that are loaded)


# -- doors -----------------------------------------------------------------------------------------

WIDTH, HALF = 0.9, 0.1  # m, of the opening; half of the thickness of its wall
DOORWAY = np.vstack(
    [
        chain((-3, -HALF), (0, -HALF), (0, HALF), (-3, HALF)),
        chain((4, -HALF), (WIDTH, -HALF), (WIDTH, HALF), (4, HALF)),
    ]
)
LEFT = Door((0.0, 0.02), 0.0, 1, WIDTH - 0.002, 0.04)  # both open to the north
RIGHT = Door((WIDTH, 0.02), math.pi, -1, WIDTH - 0.002, 0.04)


@st.composite
def flips(draw):
    times = np.cumsum(draw(st.lists(real(0.1, 2.5), min_size=4, max_size=4)))
    return Scripted(tuple((float(time), 0) for time in times))


@st.composite
def pushes(draw, steps):
    """Five commands of so many steps each."""
    pairs = draw(st.lists(st.tuples(real(-1, 1), real(-1, 1)), min_size=5, max_size=5))
    first = draw(st.sampled_from([1.0, -1.0]))
    commands = [(first, 0.0), *((v, omega) for v, omega in pairs[1:])]
    return [(SPEED * v, TURN * omega) for v, omega in commands for _ in range(steps)]


BEGINNINGS = {
    "from both sides": (real(-0.3, 1.2), st.one_of(real(-1.3, -0.35), real(0.35, 1.3))),
    "in the doorway": (real(0.23, 0.67), real(-0.3, 1.2)),
}


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("begin", BEGINNINGS)
@pytest.mark.parametrize("law", ["flipping", "pushed", "static"])
def test_doors_hold_the_robot(law, begin, robot):
    body, count = ROBOTS[robot][0], (80 if law == "flipping" else 40)
    laws = {"flipping": flips(), "pushed": st.just(Scripted()), "static": st.just(Fixed())}
    commands, worst, on_leaf = pushes(8 if body is NIMBLE else 16), -math.inf, 0

    @cases(count)
    @given(
        laws[law],
        commands,
        *BEGINNINGS[begin],
        real(-0.9, 0.9),
        st.booleans(),
        st.booleans(),
    )
    def check(law, commands, x, y, turn, left, is_open):
        nonlocal worst, on_leaf
        heading = turn - math.copysign(math.pi / 2, y)
        if commands[0][0] < 0:
            heading += math.pi
        layout = place(DOORWAY, [LEFT if left else RIGHT], Pose2(x, y, heading))
        driven = began(layout, body, Doors(law=law, open_share=float(is_open)))
        track = Track(driven, commands)
        assert track.dent() <= CM
        assert not track.tunnelled()
        assert track.openings.min() > -0.05
        assert track.openings.max() < math.pi / 2 + 0.05
        worst = max(worst, track.dent())
        on_leaf += track.dent(slice(len(DOORWAY), None)) > -0.02

    check()
    assert on_leaf > 0.1 * count


@pytest.mark.parametrize("late", np.linspace(0.0, 0.09, 19))
def test_even_where_a_robot_at_full_speed_meets_a_leaf_at_full_speed(late):
    opening = Doors(law=Scripted(((0.0, 0),)), open_share=0.0)
    for x in (0.4, 0.6, 0.8):
        start = Pose2(x, 1.5 + late, -math.pi / 2)
        track = Track(Driven(place(DOORWAY, [LEFT], start), NIMBLE, opening), [(SPEED, 0.0)] * 15)
        assert track.collided.any()
        assert track.dent() <= CM
        assert not track.tunnelled()


@cases(150)
@given(real(0.35, 0.8), real(0.25, 0.75), st.booleans(), st.booleans(), real(-3.1, 3.1))
def test_a_moving_door_stops_at_a_robot_that_stands(r, phi, left, opens, at):
    """The robot stands at r m from the hinge, at phi of the way that the leaf has to swing."""
    reach = math.asin((RADIUS + 0.03) / r) if r > RADIUS + 0.03 else math.inf
    if 2 * reach > math.pi / 2:  # near the hinge, it would stand in the leaf
        reject()
    phi = reach + phi * (math.pi / 2 - 2 * reach)
    x, y = r * math.cos(phi), 0.02 + r * math.sin(phi)
    start = Pose2(x if left else WIDTH - x, y, at)
    doors = Doors(law=Scripted(((0.3, 0),)), open_share=float(not opens))
    driven = began(place(DOORWAY, [LEFT if left else RIGHT], start), PIONEER, doors)
    track = Track(driven, [(0.0, 0.0)] * 50)
    angles = track.openings[:, 0]
    assert track.collided[-1]
    assert np.ptp(angles[-10:]) < 1e-3  # it stands
    assert abs(angles[-1] - (math.pi / 2 if opens else 0.0)) > 0.02  # before its end
    shoved = np.linalg.norm(track.centres - start[:2], axis=1)
    assert shoved.max() < 0.15
    assert np.ptp(shoved[-10:]) < 1e-3
    assert track.dent() <= CM


@cases(100)
@given(real(0.4, 1.3), real(0.3, SPEED), st.booleans())
def test_a_door_that_is_ajar_can_be_pushed_and_swings_back(ajar, speed, left):
    """From the side to which it opens, the robot shuts it a bit; let go, it is ajar again."""
    door = LEFT if left else RIGHT
    doors = Doors(law=Scripted(), open_share=1.0, open_angle=ajar)
    middle = 0.6 * WIDTH * np.array([math.cos(ajar), math.sin(ajar)])
    away = RADIUS + 0.1
    x, y = middle + away * np.array([-math.sin(ajar), math.cos(ajar)])
    heading = ajar - math.pi / 2
    start = Pose2(x, y + 0.02, heading) if left else Pose2(WIDTH - x, y + 0.02, math.pi - heading)
    driven = began(place(DOORWAY, [door], start), NIMBLE, doors)
    steps = math.ceil(0.35 / speed / CONTROL_DT)
    pushed = Track(driven, [(speed, 0.0)] * steps)
    assert pushed.collided.any()
    assert pushed.openings.min() < ajar - 0.1
    assert pushed.dent() <= CM
    back = Track(driven, [(-speed, 0.0)] * (steps + 4) + [(0.0, 0.0)] * 20)
    assert back.openings[-1, 0] == pytest.approx(ajar, abs=0.02)
    assert back.dent() <= CM


# -- people ----------------------------------------------------------------------------------------


@cases(60)
@given(st.lists(real(0.15, 1.4), min_size=1, max_size=3), real(0.0, 0.1), real(-3.1, 3.1))
def test_people_who_walk_into_the_robot_do_not_press_it_into_a_corner(bearings, away, heading):
    corner = chain((4.0, 0.0), (0.0, 0.0), (0.0, 4.0))
    stands = np.array([1.0, 1.0]) * (RADIUS + 0.005 + away)
    routes = [
        np.array([stands + (1.5 + 0.6 * i) * np.array([math.cos(b), math.sin(b)]), stands])
        for i, b in enumerate(bearings)
    ]
    people = People(pause_min=0.0, pause_max=0.1, patience=1e3)
    start = Pose2.of((*stands, heading))
    track = Track(Driven(place(corner, (), start, routes), PIONEER, SHUT, people), [(0, 0)] * 60)
    assert track.dent(slice(2)) <= CM
    assert track.dent() <= 2 * CM  # people give way to the robot no better than walls


@cases(60)
@given(drives(40, True), real(-3.1, 3.1), st.integers(0, 1000))
def test_people_hold_the_robot_too(commands, heading, seed):
    room = chain((0, 0), (4, 0), (4, 4), (0, 4), (0, 0))
    ways = np.random.default_rng(seed).uniform(0.5, 3.5, (3, 2, 2))
    start = Pose2(2.0, 2.0, heading)
    layout = place(room, (), start, [way for way in ways if np.abs(way[0] - 2).max() > 0.6])
    people = People(pause_min=0.0, pause_max=0.1)
    track = Track(Driven(layout, NIMBLE, SHUT, people), commands)
    assert track.dent(slice(4)) <= CM
    assert track.dent() <= 2 * CM
    assert not track.tunnelled()


# -- wheels ----------------------------------------------------------------------------------------

ROOM = chain((0, 0), (6, 0), (6, 6), (0, 6), (0, 0))


@cases(60)
@given(
    st.lists(st.tuples(real(-1, 1), real(-1, 1)), min_size=6, max_size=6),
    real(-3, 3),
    st.sampled_from([1, 4, 20]),
)
def test_wheels_and_accelerations_are_a_pioneers(wanted, heading, held):
    commands = [(SPEED * v, TURN * omega) for v, omega in wanted for _ in range(held)]
    track = Track(Driven(place(ROOM, (), Pose2(3, 3, heading)), PIONEER), commands)
    v, omega = track.velocities.T
    free = ~track.collided
    wheels = np.stack([v - omega * PIONEER.wheel_base / 2, v + omega * PIONEER.wheel_base / 2])
    assert np.abs(wheels[:, free]).max() <= SPEED + 1e-6
    faster = np.abs(np.diff(track.velocities, axis=0, prepend=0.0))[free]
    assert faster[:, 0].max() <= PIONEER.acceleration * CONTROL_DT + 1e-6
    assert faster[:, 1].max() <= PIONEER.turn_acceleration * CONTROL_DT + 1e-6


# -- what the laser sees ---------------------------------------------------------------------------


def solids(world):
    """(n, 4) the edges of all leaves and people, from the shapes that physics itself has."""
    edges = []
    for shape in world.mechanics.in_space().space.shapes:
        if hasattr(shape, "get_vertices"):
            x, y = shape.body.position
            corners = np.array([v.rotated(shape.body.angle) + (x, y) for v in shape.get_vertices()])
            edges.append(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    return np.concatenate(edges)


@pytest.mark.parametrize("law", [Uniform(1.0, 4.0), Fixed()])
@pytest.mark.parametrize("seed", range(3))
def test_the_laser_sees_doors_and_people_where_physics_has_them(law, seed):
    laser = Laser(beams=361, field_of_view=math.tau, sigma=0.0)
    driven = Driven(Corridor(people=2), PIONEER, Doors(law=law), seed=seed, laser=laser)
    batch, rng, seen = driven.batch, np.random.default_rng(seed), 0
    for _ in range(60):
        driven.step(rng.uniform(0, 1), rng.uniform(-1, 1))
        real = np.concatenate([batch.layouts[0].walls, solids(driven.world)])
        ranges, sure = naive.meetings(*driven.pose, laser.angles, real)
        expected = np.where((sure > 0) & (ranges > 0) & (ranges < 8.0), ranges, math.inf)
        clear = np.abs(sure).min(1) > 1e-6  # of all corners
        assert batch.ranges[0][clear] == pytest.approx(expected.min(1)[clear], abs=1e-4)
        seen += int((expected.argmin(1) >= len(batch.layouts[0].walls)).sum())
    assert seen > 60 * 10


# -- odometry of a drive ---------------------------------------------------------------------------


def test_the_odometry_of_a_drive_errs_as_configured():
    """Along a straight drive of the batch: bias and variances of every step of 6 cm."""
    odometry, n = Odometry(bias=0.5, alpha1=0.0, alpha2=0.004, alpha3=0.01, alpha4=0.0), 2000
    setup = place(chain((-500, -3), (500, -3)), (), Pose2())
    driven = Driven(setup, NIMBLE, odometry=odometry)
    batch, motions, moved = driven.batch, [], []
    driven.step(0.6, 0.0)
    for _ in range(n):
        before = driven.pose
        driven.step(0.6, 0.0)
        motions.append(batch.displacements[0].copy())
        moved.append(before.between(driven.pose))
    way = np.array(moved)[:, 0]
    assert way == pytest.approx(0.06, abs=1e-9)
    motions = np.array(motions)
    turns, lengths = motions[:, 2], np.hypot(*motions[:, :2].T)
    for errors, mean, deviation in (
        (turns, 0.5 * 0.06, math.sqrt(2 * 0.004) * 0.06),
        (lengths, 0.06, math.sqrt(0.01) * 0.06),
    ):
        assert abs(errors.mean() - mean) < 4 * deviation / math.sqrt(n)
        statistic = ((errors - mean) ** 2).sum() / deviation**2
        assert 1e-4 < stats.chi2(n).cdf(statistic) < 1 - 1e-4


# -- the doors' times in a running world -----------------------------------------------------------


MANY = [Door((3.0 * i, 9.0), 0.0, 1, WIDTH, 0.04) for i in range(40)]


@pytest.mark.parametrize(
    ("law", "times"),
    [
        (Uniform(3.0, 9.0), stats.uniform(3.0, 6.0)),
        (Exponential(30.0), stats.expon(0.0, 30.0)),
    ],
    ids=["uniform", "exponential"],
)
def test_dwell_times_follow_their_law(law, times):
    """Kolmogorov and Smirnov, of the times at which leaves leave their ends, told to 0.1 s."""
    quick = Doors(law=law, swing_time=0.5, torque=100.0)
    world = Driven(place([], MANY), PIONEER, quick).world
    steps = round(60 * times.mean() / CONTROL_DT)
    openings = np.empty((steps, len(MANY)))
    for i in range(steps):
        world.step(0.0, 0.0, 0.0)
        openings[i] = world.openings
    at_end = np.minimum(openings, math.pi / 2 - openings) < 0.1
    left = at_end[:-1] & ~at_end[1:]
    dwells = np.concatenate([np.diff(np.flatnonzero(each)) * CONTROL_DT for each in left.T])
    assert len(dwells) > 0.9 * 59 * len(MANY)
    finer = np.random.default_rng(0).triangular(-CONTROL_DT, 0.0, CONTROL_DT, len(dwells))
    assert stats.kstest(dwells + finer, times.cdf).pvalue > 1e-3
