"""Doors that slide into the wall."""

import copy
import math

import numpy as np
import pytest

from dynslam_env import Corridor, Door, Doors, DoorWorldEnv, Fixed, People, Scripted, Uniform
from slam import Pose2
from tests.dynslam_env.driven import Driven, Track, place

DOOR = Door((0.0, 0.0), math.pi / 2, 1, 1.0, 0.04, slides=True)  # across x, from 0 up to y = 1
JAMBS = [(0.0, 0.0, 0.0, -2.0), (0.0, 1.0, 0.0, 3.0)]
FAR = Pose2(-2.0, 0.5, 0.0)
FULL = math.pi / 2
RADIUS = 0.22  # m, of the robot
STEP = 0.1 / 1.5 * FULL  # rad of the opening, in a control step


def driven(start=FAR, flips=((0.0, 0),), open_share=0.0, **parameters):
    doors = Doors(law=Scripted(flips), open_share=open_share)
    return Driven(place(JAMBS, [DOOR], start), doors=doors, **parameters)


def lowest(one):
    """y of the leaf's lower end, m."""
    edges = one.world.outline()
    return min(edges[:, 1].min(), edges[:, 3].min())


def test_a_leaf_slides_in_a_line_at_constant_speed():
    one = driven()
    openings = [float(one.openings[0])]
    for k in range(1, 21):
        one.step()
        openings.append(float(one.openings[0]))
        assert lowest(one) == pytest.approx(-min(k / 15, 1.0), abs=1e-9)
        assert np.abs(one.world.outline()[:, [0, 2]]).max() <= DOOR.thickness + 1e-12
    assert openings == pytest.approx([min(k * STEP, FULL) for k in range(21)], abs=1e-9)


@pytest.mark.parametrize("law", [Fixed(), Scripted()])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_an_open_leaf_begins_beyond_its_hinge(law, share):
    one = Driven(place(JAMBS, [DOOR], FAR), doors=Doors(law=law, open_share=share))
    assert lowest(one) == pytest.approx(-share, abs=1e-12)
    one.step()
    assert lowest(one) == pytest.approx(-share, abs=1e-12)
    assert one.openings[0] == pytest.approx(share * FULL, abs=1e-9)


def test_it_waits_while_the_robot_is_in_the_doorway_and_then_closes():
    one = driven(Pose2(-0.4, 0.5, 0.0), ((0.5, 0),), open_share=1.0)
    Track(one, [(1.0, 0.0)] * 4 + [(0.0, 0.0)] * 30)
    assert abs(one.pose.x) < 0.05
    assert one.openings[0] == pytest.approx(FULL)
    Track(one, [(0.8, 0.0)] * 30)
    assert one.openings[0] == pytest.approx(0.0, abs=1e-9)
    assert one.pose.x > 1.0


def test_it_waits_for_a_person():
    route = np.array([(0.0, 0.5), (0.0, 0.6)])
    lingering = People(pause_min=50.0, pause_max=60.0)
    doors = Doors(law=Scripted(((0.0, 0),)), open_share=1.0)
    one = Driven(place(JAMBS, [DOOR], FAR, [route]), doors=doors, people=lingering)
    Track(one, [(0.0, 0.0)] * 30)
    assert one.openings[0] == pytest.approx(FULL)


@pytest.mark.parametrize("flips", [(), ((0.5, 0),), ((1.0, 0),)])
@pytest.mark.parametrize("y", [0.2, 0.5, 0.85])
def test_nobody_pushes_it_aside(flips, y):
    """Robot and leaf get no further into each other than robot and wall, at full speed."""
    start = Pose2(-0.8, y, 0.0)
    track = Track(driven(start, flips), [(1.2, 0.0)] * 8 + [(0.0, 0.0)] * 5 + [(1.2, 0.0)] * 12)
    ends = track.segments.reshape(len(track.segments), -1, 2, 2)
    for centre, segments in zip(track.centres, ends, strict=True):
        a, along = segments[:, 0], segments[:, 1] - segments[:, 0]
        share = np.clip(((centre - a) * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
        nearest = np.linalg.norm(a + share[:, None] * along - centre, axis=-1).min()
        assert nearest > RADIUS - 0.01
    if not flips:
        assert track.collided.any()
        assert track.centres[:, 0].max() < 0.0


def test_without_contact_it_moves_as_in_chipmunk():
    world = Corridor(length=8.0, doors_per_side=3, sliding=1.0, doubled=0.4, people=2)
    env = DoorWorldEnv(world=world, doors=Doors(law=Uniform(1.0, 3.0)))
    env.reset(seed=1)
    assert all(door.slides for door in env.layout.doors)
    twin, moved = copy.deepcopy(env), 0.0
    for k in range(60):
        twin.physics.mechanics.in_space()
        action, before = np.array([0.3 * math.sin(k / 7), 0.4]), env.physics.openings.copy()
        for each in (env, twin):
            each.step(action.astype(np.float32))
        assert np.array_equal(env.physics.bodies, twin.physics.bodies)
        moved += np.abs(env.physics.openings - before).sum()
    assert moved > 10.0
