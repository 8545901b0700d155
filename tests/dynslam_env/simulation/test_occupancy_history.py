import numpy as np
import pytest

from dynslam_env import Doors, DoorWorldEnv, Laser, Layout, Uniform
from dynslam_env.simulation import occupancy_history
from dynslam_env.simulation.occupancy_history import DEFAULT_CELL, OccupancyHistory
from slam import InputError, Pose2, Truth
from slam.metrics.change import TrueOccupancy

WALLS = np.array([(0.0, 0.0, 2.0, 0.0), (2.0, 0.0, 2.0, 1.0)])


def edges(x):
    """A triangle at x, all that moves."""
    corners = np.array([(x, 0.5), (x + 0.3, 0.5), (x, 0.8)])
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def same(states):
    return states


def seen(places, walls=WALLS):
    record = OccupancyHistory(walls, same)
    for x in places:
        record.add(edges(x))
    return record


def cells(raster):
    """Share of the time by the lattice's cell, of those that were ever occupied."""
    spec = raster.spec
    occupied = np.argwhere(raster.share > 0).tolist()
    return {(r + spec.row0, c + spec.col0): float(raster.share[r, c]) for r, c in occupied}


def test_the_share_is_that_of_the_moments_and_now_is_the_last():
    record = seen([0.0, 0.0, 1.0])
    raster = record.occupancy(DEFAULT_CELL)
    assert set(raster.share[raster.share > 0].round(6)) == {round(1 / 3, 6), round(2 / 3, 6), 1.0}
    walls = OccupancyHistory(WALLS, same)
    walls.add(edges(1.0))
    assert (raster.share > 0).sum() > (raster.now).sum()
    assert cells(raster).keys() > cells(walls.occupancy(DEFAULT_CELL)).keys()


@pytest.mark.parametrize("cell", [DEFAULT_CELL, 0.1])
def test_asking_in_between_changes_nothing(cell):
    places = np.linspace(0.0, 1.5, 12)
    once, often = seen(places), OccupancyHistory(WALLS, same)
    for x in places:
        often.add(edges(x))
        often.occupancy(cell)
    for _ in range(2):  # and asking twice neither
        assert cells(often.occupancy(cell)) == pytest.approx(cells(once.occupancy(cell)))
        assert (often.occupancy(cell).now.sum()) == once.occupancy(cell).now.sum()


def test_it_is_the_same_in_small_parts(monkeypatch):
    places = np.linspace(0.0, 1.5, 23)
    whole = cells(seen(places).occupancy(DEFAULT_CELL))
    monkeypatch.setattr(occupancy_history, "STATES_PER_BATCH", 5)
    assert cells(seen(places).occupancy(DEFAULT_CELL)) == pytest.approx(whole)


def test_what_was_given_does_not_change_later():
    record = seen([0.0, 0.0])
    first = record.occupancy(DEFAULT_CELL)
    share, now = first.share.copy(), first.now.copy()
    for x in (1.0, 5.0):
        record.add(edges(x))
        record.occupancy(DEFAULT_CELL)
    assert first.share.tobytes() == share.tobytes()
    assert first.now.tobytes() == now.tobytes()


@pytest.mark.parametrize("cell", [0, -1, np.nan, None, "a"])
def test_cells_without_a_size_are_refused(cell):
    with pytest.raises(InputError, match="cell must be a finite number above 0"):
        seen([0.0]).occupancy(cell)


def test_an_episode_of_any_length_in_a_world_of_any_size():
    far = [(0, 0, 400, 0), (400, 0, 400, 400), (400, 400, 0, 400), (0, 400, 0, 0)]
    layout = Layout(np.array(far), (), Pose2(5, 5, 0), np.array([(390.0, 390.0)]))
    env = DoorWorldEnv(world=layout, laser=Laser(beams=1))
    env.reset(seed=0)
    for _ in range(4200):
        env.step(np.zeros(2, dtype=np.float32))
    with pytest.raises(InputError, match="cells"):
        env.occupancy()


def test_the_environment_gives_the_share_of_all_steps():
    env = DoorWorldEnv(doors=Doors(Uniform(0.5, 2.0)))
    env.reset(seed=0)
    outlines = [env.outline()]
    for _ in range(300):
        env.step(np.zeros(2, dtype=np.float32))
        outlines.append(env.outline())
    truth = Truth(np.empty((0, 3)), env.layout.walls, np.array(outlines))
    expected, raster = TrueOccupancy(truth, 0.05), env.occupancy()
    assert raster.share.tobytes() == expected.share.tobytes()
    assert raster.now.tobytes() == expected.now.tobytes()
    assert ((raster.share > 0.02) & (raster.share < 0.98)).sum() > 0


def test_without_anything_that_moves_there_are_the_walls():
    record = OccupancyHistory(WALLS, same)
    record.add(np.empty((0, 4)))
    raster = record.occupancy(DEFAULT_CELL)
    assert (raster.now == (raster.share == 1.0)).all()
    assert raster.now.any()
