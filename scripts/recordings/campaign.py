"""`dynslam record --days`: campaigns as files, and what their doors did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents import record_path
from dynslam_env import Campaign, Doors, Recorded, Visit
from dynslam_env.registration import spec_of
from dynslam_env.simulation.config import WorldConfig
from slam.episode import Episode
from slam.errors import InputError
from slam.io.door_runs import write_door_runs

from ..console.output import output_directory
from ..console.progress import progress_bar
from ..trials.episode_formats import RECORDED

if TYPE_CHECKING:
    from .record import RecordCommand


def record_campaigns(
    options: RecordCommand,
    seeds: Sequence[int],
    parameters: Mapping[str, Any],
    formats: Sequence[str],
) -> int:
    """Record one campaign a seed, write, print; the exit status."""
    if options.split is not None or options.doors is not None:
        raise InputError("a campaign (--days) has a calendar of its own: no --split, no --doors")
    campaigns = {seed: _campaign(options, seed, parameters) for seed in seeds}
    others = {name: value for name, value in parameters.items() if name in ("laser", "robot")}
    out = output_directory(options.out)
    count = 0
    with progress_bar() as bar:
        for seed in seeds:
            stem = f"{options.env}-{seed}"
            _write_building(campaigns[seed], out, stem)
            visits = campaigns[seed].plan()
            for visit in bar.track(visits, len(visits), description=stem):
                episode = recorded(options.env, visit, others)
                for name in formats:
                    RECORDED[name](episode, out / f"{stem}-day{visit.day:02}-{visit.number}")
                count += 1
    visits_in_all = "1 visit" if count == 1 else f"{count} visits"
    print(f"{visits_in_all} in {options.env} as {', '.join(formats)} in {out}")
    return 0


def recorded(env: str, visit: Visit, parameters: Mapping[str, Any]) -> Episode:
    """The drive of a visit, dated.

    parameters  of the environment, such as laser and robot
    """
    given: dict[str, Any] = {**parameters, "world": visit.layout, "max_episode_steps": visit.steps}
    drive = record_path(env, visit.seed, doors=Doors(law=visit.doors), **given)
    return visit.dated(drive)


def _campaign(options: RecordCommand, seed: int, parameters: Mapping[str, Any]) -> Campaign:
    keywords = spec_of(options.env).kwargs
    place = {"difficulty": parameters.get("difficulty"), "world": keywords.get("world")}
    doors = None if options.history is None else Recorded(str(options.history))
    assert options.days is not None
    return Campaign(
        WorldConfig.of(place).world, doors, options.days, options.visits, options.minutes, seed=seed
    )


def _write_building(campaign: Campaign, out: Path, stem: str) -> None:
    """The building as a world file, and the history of each door."""
    building = campaign.building()
    building.save(out / f"{stem}-building.json")
    for door in range(len(building.doors)):
        write_door_runs(campaign.history(door), out / f"{stem}-door{door}.csv")
