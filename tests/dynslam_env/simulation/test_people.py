import math

import numpy as np
import pytest

from dynslam_env import Corridor, Door, Doors, Fixed, Loop, Office, People, Scripted, Uniform
from dynslam_env.simulation.people import Walkers
from dynslam_env.simulation.world import CONTROL_DT, World
from slam import InputError, Pose2
from tests.dynslam_env.driven import NIMBLE, SHUT, Driven, Track, dents, place

FAR_OFF = Pose2(-50.0, 0.0, 0.0)
BRISK = People(pause_min=0.0, pause_max=0.1)
INRADIUS = People().radius * math.cos(math.pi / 8)


def chain(*points):
    points = np.array(points, dtype=np.float64)
    return np.hstack([points[:-1], points[1:]])


def walked(walls, routes, seconds, doors=(), law=SHUT, people=BRISK, start=FAR_OFF, seed=0):
    """What people did while the robot stood still."""
    driven = Driven(place(walls, doors, start, [np.array(r) for r in routes]), doors=law,
                    people=people, seed=seed)  # fmt: skip
    return Track(driven, [(0.0, 0.0)] * round(seconds / CONTROL_DT))


def legs(track, person, route, near=0.3):
    """How often a person came from one end of the route to the other."""
    ends = np.array([route[0], route[-1]])
    at = np.linalg.norm(track.people[:, person, None] - ends, axis=2) < near
    visits = [0 if first else 1 for first, last in at if first or last]
    return int(np.abs(np.diff(visits)).sum())


def through_walls(track):
    """Somebody's centre went through a wall."""
    ways = np.concatenate([track.people[:-1], track.people[1:]], axis=2).reshape(-1, 4)
    return crossing(ways, track.walls).any()


def crossing(ways, walls):
    a, b, p, q = ways[:, None, :2], ways[:, None, 2:], walls[None, :, :2], walls[None, :, 2:]

    def side(u, v, w):
        return (v - u)[..., 0] * (w - u)[..., 1] - (v - u)[..., 1] * (w - u)[..., 0]

    return (side(a, b, p) * side(a, b, q) < 0) & (side(p, q, a) * side(p, q, b) < 0)


def in_walls(track):
    """How far anybody was inside of a wall, m: by the circle within the octagon."""
    return max(
        dents(places, np.broadcast_to(track.walls, (len(places), *track.walls.shape)), INRADIUS)
        .max()
        for places in track.people[::3].transpose(1, 0, 2)
    )  # fmt: skip


def closest(track):
    """The least distance of two people's centres, m."""
    apart = np.linalg.norm(track.people[:, :, None] - track.people[:, None], axis=3)
    return apart[:, *np.triu_indices(apart.shape[1], 1)].min()


# -- alone -----------------------------------------------------------------------------------------


def test_a_person_walks_to_and_fro_at_walking_speed():
    route = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)]
    track = walked([], [route], 60.0)
    assert legs(track, 0, route) >= 6  # 7 m take about 8 s
    speeds = np.linalg.norm(np.diff(track.people[:, 0], axis=0), axis=1) / CONTROL_DT
    assert speeds.max() < 1.05
    assert np.median(speeds) > 0.8
    line = np.array([(0.0, 0, 4, 0), (4, 0, 4, 3)])
    places = track.people[:, 0]
    off = -dents(places, np.broadcast_to(line, (len(places), 2, 4)), 0.0)
    assert off.max() < 0.2  # it hardly swings out of the corner


def test_a_person_stands_where_it_is_to_stand():
    """It brakes in time, as heavy as it is."""
    track = walked([], [[(0.0, 0.0), (4.0, 0.0)]], 15.5, people=People(pause_min=8, pause_max=8))
    assert np.abs(track.people[-5:, 0] - (4.0, 0.0)).max() < 0.2
    assert track.people[:, 0, 0].max() < 4.1


def test_rests_follow_their_law():
    people = People(pause_min=2.0, pause_max=5.0, mass=1.0, force=1e3)
    track = walked([], [[(0.0, 0.0), (1.0, 0.0)]], 900.0, people=people)
    still = np.linalg.norm(np.diff(track.people[:, 0], axis=0), axis=1) < 0.01
    begun, over = (np.flatnonzero(np.diff(still.astype(int)) == step) for step in (1, -1))
    rests = (over[1:] - begun[: len(over) - 1]) * CONTROL_DT  # the first began at the beginning
    assert len(rests) > 150
    assert 1.8 < rests.min() < 2.6
    assert 4.4 < rests.max() < 5.3
    assert rests.mean() == pytest.approx(3.5, abs=0.35)


# -- at doors --------------------------------------------------------------------------------------

WALL = chain((-3, 0), (0, 0)), chain((0.9, 0), (3, 0))
DOOR = Door((0.0, 0.02), 0.0, 1, 0.898, 0.04)
THROUGH = [(0.45, -1.2), (0.45, 1.5)]


def test_people_wait_at_a_closed_door_and_go_through_when_it_opens():
    opening = Doors(law=Scripted(((6.0, 0), (30.0, 0))), open_share=0.0)
    track = walked(np.vstack(WALL), [THROUGH], 60.0, [DOOR], opening)
    y = track.people[:, 0, 1]
    assert y[:60].max() < -1.0  # closed
    assert y.max() > 1.3
    assert legs(track, 0, THROUGH) >= 2
    shut = track.openings[330:, 0]
    assert shut.max() < 0.05
    assert np.ptp(y[340:]) < 0.3  # closed again: it stands and waits
    assert np.abs(y[340:]).min() > 0.9


def test_a_static_closed_door_is_never_passed():
    track = walked(np.vstack(WALL), [THROUGH], 20.0, [DOOR], Doors(law=Fixed(), open_share=0.0))
    assert track.people[:, 0, 1].max() < -1.0


def test_one_at_a_time_goes_through_a_door():
    """Two who want opposite ways, again and again: neither waits for ever."""
    always = Doors(law=Scripted(), open_share=1.0)
    ends = [[(0.45, -1.2), (0.45, 1.5)], [(0.5, 1.5), (0.5, -1.2)]]
    outer = [[(-1.5, -1.4), *ends[0], (-1.5, 1.8)], [(2.0, 1.8), *ends[1], (2.0, -1.4)]]
    track = walked(np.vstack(WALL), outer, 120.0, [DOOR], always)
    assert min(legs(track, i, route) for i, route in enumerate(outer)) >= 4
    passing = (track.people[:, :, 1] > -0.8) & (track.people[:, :, 1] < 1.1)
    assert passing.all(axis=1).mean() < 0.02
    assert not through_walls(track)


def test_who_was_shoved_steps_back():
    track_of = Driven(place([], (), FAR_OFF, [np.array([(0.0, 0.0), (4.0, 0.0)])]),
                      people=People(pause_min=1e3, pause_max=1e3))  # fmt: skip
    track_of.world.people[0] = 0.6, 0.3
    for _ in range(40):
        track_of.step()
    assert np.abs(track_of.world.people[0]).max() < 0.2


# -- each other, and the robot ---------------------------------------------------------------------

ALLEY = chain((-1, -0.9), (9, -0.9), (9, 0.9), (-1, 0.9), (-1, -0.9))


@pytest.mark.parametrize("aside", [0.0, 0.05, -0.05, 0.3])
def test_two_who_meet_pass_each_other(aside):
    routes = [[(0.0, 0.0), (8.0, 0.0)], [(8.0, aside), (0.0, aside)]]
    track = walked(ALLEY, routes, 14.0)
    assert all(legs(track, i, route) >= 1 for i, route in enumerate(routes))
    assert closest(track) > 2 * INRADIUS
    assert in_walls(track) <= 0.02


@pytest.mark.parametrize("aside", [0.0, 0.1, -0.3])
def test_people_walk_around_a_robot_that_stands_in_their_way(aside):
    route = [(0.0, 0.0), (8.0, 0.0)]
    track = walked(ALLEY, [route], 14.0, start=Pose2(4.0, aside, 0.0))
    assert legs(track, 0, route) >= 1
    assert not track.collided.any()


@pytest.mark.parametrize(("aside", "expected"), [(0.0, 0.5), (0.3, 0.5), (-0.3, -0.5), (0.9, 0.0)])
def test_who_stands_in_the_way_steps_aside(aside, expected):
    """To the side on which the one who walks east does not pass, at half the speed."""
    routes = np.array([[(0.0, 0.0), (8.0, 0.0)], [(2.0, aside), (2.0, 5.0)]])
    walkers = Walkers(People(), place([], (), FAR_OFF, routes), rng())
    bodies, robot = np.zeros((2, 6)), np.array([-50.0, 0.0, 0.22])
    walkers._clock[:, 0] = 0.0, 1e3  # the second rests
    bodies[:, :2] = (1.2, 0.0), (2.0, aside)
    for _ in range(2):
        walkers.steer(1.0, CONTROL_DT, bodies, robot, np.empty(0))
    assert walkers.velocities[0, 0] > 0.0
    assert walkers.velocities[1] == pytest.approx([0.0, expected])


def test_who_cannot_get_past_turns_around():
    narrow = chain((-1, -0.35), (9, -0.35), (9, 0.35), (-1, 0.35), (-1, -0.35))
    route = [(0.0, 0.0), (4.0, 0.0), (8.0, 0.0)]
    track = walked(narrow, [route], 30.0, start=Pose2(6.0, 0.0, 0.0))
    x = track.people[:, 0, 0]
    assert x.max() < 6.0
    assert x[60:90].min() > 5.0
    assert x[140:170].min() < 0.5
    assert np.linalg.norm(track.centres - track.centres[0], axis=1).max() < 0.2


def test_who_would_stand_on_anothers_feet_begins_beside():
    route = np.array([(0.0, 0.0), (4.0, 0.0)])
    places = Walkers(People(), place([], (), FAR_OFF, [route] * 9), rng()).starts()
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 9 * np.eye(9)
    assert apart.min() >= 2 * People().radius


def rng(seed=0):
    return np.random.default_rng(seed)


# -- in worlds -------------------------------------------------------------------------------------


def test_in_the_corridor_nearly_everybody_gets_there():
    """All six of 10 worlds reach the other end of their route; none walks through a wall."""
    reached = []
    for seed in range(10):
        driven = Driven(Corridor(people=6), doors=Doors(), seed=seed)
        track = Track(driven, [(0.0, 0.0)] * 1200)
        routes = driven.batch.layouts[0].routes
        reached += [legs(track, i, route) >= 1 for i, route in enumerate(routes)]
        assert not through_walls(track)
        assert in_walls(track) <= 0.02
        assert closest(track) > 2 * INRADIUS - 0.01
    assert np.mean(reached) >= 0.95


@pytest.mark.parametrize("world", [Office(people=5), Loop(people=5)], ids=["office", "loop"])
def test_nobody_leaves_a_world_in_which_the_robot_runs_wild(world):
    driven = Driven(world, NIMBLE, Doors(law=Uniform(2.0, 6.0)), seed=1)
    moves = rng().uniform((-1.2, -3.0), (1.2, 3.0), (40, 2))
    track = Track(driven, [tuple(move) for move in moves for _ in range(15)])
    low = track.walls.reshape(-1, 2).min(0)
    high = track.walls.reshape(-1, 2).max(0)
    assert (track.people > low).all()
    assert (track.people < high).all()
    assert not through_walls(track)
    assert in_walls(track) <= 0.02
    assert track.dent(slice(len(track.walls))) <= 0.01
    assert not track.tunnelled()


def test_the_same_seed_the_same_people():
    places = [
        Track(Driven(Corridor(people=4), doors=Doors(), seed=seed), [(0.5, 0.1)] * 200).people
        for seed in (3, 3, 4)
    ]
    assert places[0].tobytes() == places[1].tobytes()
    assert (places[0] != places[2]).any()


def test_a_world_without_people_does_not_know_of_them():
    layout = Corridor().layout(rng())
    worlds = [
        World(layout, NIMBLE, Doors(), people, rng(1), rng(seed))
        for people, seed in ((People(), 2), (People(speed=3.0, radius=0.4), 3))
    ]
    for _ in range(200):
        for world in worlds:
            world.step(0.4, 0.1, 0.3)
        assert worlds[0].robot.tobytes() == worlds[1].robot.tobytes()
        assert worlds[0].segments.tobytes() == worlds[1].segments.tobytes()
    assert worlds[0].people.shape == (0, 2)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"radius": 0.0}, "People.radius must be a finite number above 0"),
        ({"speed": -1.0}, "People.speed"),
        ({"patience": math.inf}, "People.patience"),
        ({"pause_min": -1.0}, "People.pause_min"),
        ({"pause_min": 9.0}, "People need pause_min <= pause_max, got 9 > 8 s"),
        ({"mass": "heavy"}, "People.mass"),
        ({"force": 0}, "People.force"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        People(**wrong)
