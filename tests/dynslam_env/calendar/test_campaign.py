"""Campaigns: the same building on all days, things that are moved, and the same bytes again."""

from datetime import datetime

import numpy as np
import pytest

from agents import record_path
from dynslam_env import Campaign, Corridor, Doors, Office, OnDate, Visit
from dynslam_env.calendar.clutter import BOX, FREE_WAY, FURNITURE, clutter, with_things
from dynslam_env.calendar.door_calendar import MONDAY_2026
from dynslam_env.worlds.clearance import gap, legs
from slam.episode import Episode
from slam.errors import InputError

SHORT = Campaign(Office(), days=8, visits=2, minutes=0.3, seed=11)


def drive(visit: Visit) -> Episode:
    place = {"world": visit.layout, "max_episode_steps": visit.steps}
    return visit.dated(
        record_path("DoorOffice-v0", visit.seed, doors=Doors(law=visit.doors), **place)
    )


@pytest.fixture(scope="module")
def plan() -> list[Visit]:
    return SHORT.plan()


def test_visits_are_spread_over_the_days(plan: list[Visit]):
    assert [(visit.day, visit.number) for visit in plan] == [(k // 2, k % 2) for k in range(16)]
    dates = [datetime.fromisoformat(visit.date) for visit in plan]
    assert dates == sorted(dates)
    assert all(7 <= date.hour < 19 for date in dates)
    assert (dates[-1] - dates[0]).days >= 6


def test_the_building_stays_and_things_are_moved(plan: list[Visit]):
    walls = len(SHORT.building().walls)
    first = plan[0].layout
    assert all(np.array_equal(v.layout.walls[:walls], first.walls[:walls]) for v in plan)
    assert all(v.layout.doors == first.doors for v in plan)
    things = {v.layout.walls[walls:].tobytes() for v in plan}
    assert len(things) > 4
    assert all(len(v.layout.walls) > walls for v in plan)


def test_things_leave_the_way_free():
    building = SHORT.building()
    things = clutter(building, {FURNITURE: 10, BOX: 10}, 0.0, 1e6, np.random.default_rng(3))
    assert len(things) > 40
    assert min(gap(thing.outline, legs(building.path)) for thing in things) >= FREE_WAY
    noon = with_things(building, things, 5e5)
    there = sum(thing.since <= 5e5 < thing.until for thing in things)
    assert len(noon) == len(building.walls) + 4 * there


def test_people_come_by_the_hour():
    crowd = Campaign(Office(), days=14, visits=4, minutes=0.3, people=6, seed=2).plan()
    weekend = [len(v.layout.routes) for v in crowd if v.day % 7 >= 5]
    noon = [len(v.layout.routes) for v in crowd if v.day % 7 < 5 and v.number in (1, 2)]
    assert np.mean(noon) > 3.0
    assert np.mean(weekend) < 1.5


def test_a_recorded_visit_carries_its_date_and_the_doors_states(plan: list[Visit]):
    visit = plan[5]
    episode = drive(visit)
    assert episode.meta["date"] == visit.date
    assert episode.scans[0].time == visit.begin > MONDAY_2026
    assert episode.odometry.times[0] == visit.begin
    assert episode.truth is not None
    assert episode.truth.poses[0, :2] == pytest.approx(visit.layout.start[:2])
    opened = [SHORT.history(d).state[np.searchsorted(SHORT.history(d).begin, visit.begin) - 1] == 1
              for d in range(len(visit.layout.doors))]  # fmt: skip
    assert list(visit.doors.opened) == opened


def test_the_same_campaign_gives_the_same_bytes(plan: list[Visit]):
    again = Campaign(Office(), days=8, visits=2, minutes=0.3, seed=11).plan()
    one, two = drive(plan[3]), drive(again[3])
    assert np.array_equal([s.ranges for s in one.scans], [s.ranges for s in two.scans])
    assert np.array_equal(one.odometry.poses, two.odometry.poses)
    other = Campaign(Office(), days=8, visits=2, minutes=0.3, seed=12).plan()
    assert not np.array_equal(other[3].layout.walls[:40], plan[3].layout.walls[:40])


def test_the_robot_goes_to_and_fro_where_the_path_is_open():
    visit = Campaign(Corridor(), days=1, visits=1, minutes=2.0, seed=1).plan()[0]
    length = np.hypot(*np.diff(visit.layout.path, axis=0).T).sum()
    assert length == pytest.approx(2.0 * 60.0 * 0.55)


@pytest.mark.parametrize(
    "wrong", [{"days": 0}, {"visits": 0}, {"minutes": 0.0}, {"visits": 300}, {"boxes": -1}]
)
def test_wrong_numbers_are_refused(wrong: dict):
    with pytest.raises(InputError, match="Campaign"):
        Campaign(Office(), **wrong)


def test_states_of_other_doors_are_refused():
    with pytest.raises(InputError, match="OnDate"):
        OnDate(opened=(True,)).initial_states(np.zeros(2, bool), np.random.default_rng(0))
