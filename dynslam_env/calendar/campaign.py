"""Campaigns: visits of some minutes to one building, over weeks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from dynslam_env.calendar.clutter import BOX, FURNITURE, clutter, with_things
from dynslam_env.calendar.door_calendar import DAY, MONDAY_2026, DoorCalendar
from dynslam_env.calendar.habits import HOUR, Habits
from dynslam_env.simulation.laws import Bools, Clock, FlipClock, Scripted
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.world import CONTROL_DT
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Generator, Layout
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.start_checks import check_start
from slam.episode import Episode
from slam.errors import InputError
from slam.forecast.watched import Runs
from slam.geometry import Array, Pose2
from slam.trajectory import Trajectory
from slam.validation import instance, number, positive, whole, within

OPENS, CLOSES = 7.0, 19.0  # h, between which visits begin
SPEED = 0.55  # m/s, of the robot along its path
FROM_PEOPLE = 1.0  # m, from the robot's start to those of the people
MINUTE, WEEK_HOURS = 60.0, 168  # s, h
LONGEST = 60.0  # min, of a visit
BUSY = (0.0,) * 7 + (0.2, 0.6, 0.8, 0.8, 0.7, 1.0, 0.8, 0.8, 0.7, 0.6, 0.3, 0.1) + (0.0,) * 5
"""Share of the people who are there in each hour of a working day; a fifth of it at weekends."""


@dataclass(frozen=True)
class OnDate(Scripted):
    """Doors at given states, that flip at given times; nothing is random.

    flips   pairs (time in s, index of the door)
    opened  the states at time 0
    """

    opened: tuple[bool, ...] = ()

    def initial_states(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The given states."""
        if len(self.opened) != len(is_open):
            raise InputError(f"OnDate.opened must hold {len(is_open)} states of doors")
        return np.array(self.opened, dtype=np.bool_)

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The given flips."""
        return FlipClock(self.flips, lambda: math.inf)


class Visit(NamedTuple):
    """One visit of a campaign.

    day, number  counted from 0; the number among those of its day
    begin        s, unix time
    layout       the building with what stands in it, the robot's start and path, and the people
                 who are there
    doors        the law of its doors
    seed         of the noise
    steps        time limit
    """

    day: int
    number: int
    begin: float
    layout: Layout
    doors: OnDate
    seed: int
    steps: int

    @property
    def date(self) -> str:
        """ISO 8601, UTC."""
        return datetime.fromtimestamp(self.begin, UTC).isoformat()

    def dated(self, episode: Episode) -> Episode:
        """The recorded visit with unix time in its stamps, and its date in `meta`."""
        scans = tuple(replace(scan, time=scan.time + self.begin) for scan in episode.scans)
        odometry = Trajectory(episode.odometry.times + self.begin, episode.odometry.poses)
        meta = {**episode.meta, "date": self.date, "day": self.day, "visit": self.number}
        return replace(episode, scans=scans, odometry=odometry, meta=meta)


@dataclass(frozen=True)
class Campaign:
    """Visits to one building over days: its doors have habits, things are moved, people come and
    go by the hour.

    world      draws the building, once
    doors      what the doors do; default: `Habits` with the campaign's seed
    days       number of days
    visits     number of visits a day, at random times from 7 to 19 o'clock
    minutes    min of a visit; the robot goes round its path from a random place on, either way
    people     number of people, those absent included; in a Corridor, Loop or Office
    furniture  pieces that are moved every four days, on average
    boxes      number of boxes; half of them are somewhere at a time, for two thirds of a day
    begin      s, unix time, 0 o'clock of the first day
    seed       of everything
    """

    world: Generator = field(default_factory=Office)
    doors: DoorCalendar | None = None
    days: int = 14
    visits: int = 3
    minutes: float = 3.0
    people: int = 4
    furniture: int = 6
    boxes: int = 6
    begin: float = MONDAY_2026
    seed: int = 0

    def __post_init__(self) -> None:
        instance("Campaign.world", self.world, Generator)
        for name, low in (("days", 1), ("visits", 1), ("people", 0), ("furniture", 0)):
            whole(self, name, low)
        whole(self, "boxes", 0)
        whole(self, "seed", 0)
        positive(self, "minutes")
        number("Campaign.begin", self.begin, 0.0)
        within(self, "minutes", 0.1, min(LONGEST, (CLOSES - OPENS) * 60.0 / self.visits))

    @property
    def end(self) -> float:
        """s, unix time, 0 o'clock after the last day."""
        return self.begin + self.days * DAY

    @property
    def calendar(self) -> DoorCalendar:
        """What the doors do."""
        return Habits(seed=self.seed) if self.doors is None else self.doors

    def building(self) -> Layout:
        """The building without things that stand about, with the routes of all people."""
        world = self.world
        if isinstance(world, Corridor | Loop | Office):
            world = replace(world, people=self.people)
        return world.layout(self._rng(0))

    def history(self, door: int) -> Runs:
        """What a door does in the course of the campaign."""
        return self.calendar.runs(door, self.begin, self.end)

    def week(self, door: int) -> Array:
        """(7, 24) share of the time in which a door is open, by weekday (from Monday) and hour,
        UTC; NaN for hours that the campaign does not have."""
        runs = self.history(door)
        times = np.arange(self.begin, self.end, MINUTE) + 0.5 * MINUTE
        at = np.searchsorted(runs.begin, times, side="right") - 1
        hours = ((times - MONDAY_2026) // HOUR).astype(int) % WEEK_HOURS
        count = np.bincount(hours, minlength=WEEK_HOURS).astype(float)
        opened = np.bincount(hours, runs.state[at] == 1, WEEK_HOURS)
        share = np.divide(opened, count, out=np.full(WEEK_HOURS, np.nan), where=count > 0)
        return share.reshape(7, 24)

    def plan(self) -> list[Visit]:
        """All visits, in the order of time. The same campaign gives the same visits."""
        building = self.building()
        counts = {FURNITURE: self.furniture, BOX: self.boxes}
        things = clutter(building, counts, self.begin, self.end, self._rng(1))
        histories = [self.history(door) for door in range(len(building.doors))]
        return [
            self._visit(building, with_things(building, things, begin), histories, begin, day, k)
            for day in range(self.days)
            for k, begin in enumerate(self._begins(day))
        ]

    def _rng(self, *stream: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *stream])

    def _begins(self, day: int) -> list[float]:
        """s, unix time, of the visits of a day: one in each equal part of the opening hours."""
        part = (CLOSES - OPENS) * HOUR / self.visits
        late = self._rng(2, day).random(self.visits) * (part - 60.0 * self.minutes)
        opens = self.begin + day * DAY + OPENS * HOUR
        return [float(opens + k * part + round(late[k])) for k in range(self.visits)]

    def _visit(
        self, building: Layout, walls: Array, histories: list[Runs], begin: float, day: int, k: int
    ) -> Visit:
        rng = self._rng(3, day, k)
        length = 60.0 * self.minutes * SPEED
        furnished = Layout(walls, building.doors, building.start, building.path, building.routes)
        start, path = _way(furnished, length, rng)
        routes = tuple(
            route
            for route in building.routes
            if rng.random() < _busy(begin) and math.dist(route[0], start[:2]) > FROM_PEOPLE
        )
        layout = Layout(walls, building.doors, start, path, routes)
        steps = round(60.0 * self.minutes / CONTROL_DT)
        doors = _on_date(histories, begin, CONTROL_DT * steps)
        return Visit(day, k, begin, layout, doors, int(rng.integers(2**31)), steps)


def _busy(time: float) -> float:
    """Share of the people who are there at a unix time."""
    date = datetime.fromtimestamp(time, UTC)
    return BUSY[date.hour] * (1.0 if date.weekday() < 5 else 0.2)


def _on_date(histories: list[Runs], begin: float, seconds: float) -> OnDate:
    """The law of `seconds` from `begin` on."""
    opened, flips = [], []
    for door, runs in enumerate(histories):
        first = int(np.searchsorted(runs.begin, begin, side="right")) - 1
        opened.append(bool(runs.state[first] == 1))
        later = runs.begin[first + 1 :] - begin
        flips += [(time, door) for time in later[later <= seconds].tolist()]
    return OnDate(tuple(sorted(flips)), tuple(opened))


def _way(layout: Layout, length: float, rng: np.random.Generator) -> tuple[Pose2, Array]:
    """A start on the layout's path, and the waypoints from there on, `length` m in all."""
    path = layout.path if rng.random() < 0.5 else layout.path[::-1]
    closed = bool((path[0] == path[-1]).all())
    circuit = path[:-1] if closed else np.concatenate([path, path[-2:0:-1]])
    for first in rng.permutation(len(circuit)).tolist():
        turned = np.roll(circuit, -first, axis=0)
        ahead = turned[1] - turned[0]
        x, y = turned[0].tolist()
        start = Pose2(x, y, math.atan2(ahead[1], ahead[0]))
        try:
            check_start(layout, start, Robot().radius, math.pi / 2)
        except InputError:
            continue
        return start, _around(turned, length)
    raise InputError("at none of the waypoints of this world the robot has room to begin")


def _around(circuit: Array, length: float) -> Array:
    """Waypoints along a closed circuit, cut off after `length` m."""
    around = np.hypot(*(np.roll(circuit, -1, axis=0) - circuit).T).sum()
    turns = int(length // around) + 2
    points = np.tile(circuit, (turns, 1))
    gone = np.concatenate([[0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()])
    last = [np.interp(length, gone, axis) for axis in points.T]
    return np.concatenate([points[gone < length], [last]])
