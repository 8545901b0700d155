"""The work of `dynslam score`: trajectories and their maps, each against its episode."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich.console import Console

from slam.benchmark.results import Result
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.episode_file import load_episode
from slam.io.ros_map import read_placed_map
from slam.io.tum import read_tum
from slam.metrics.external import score_external
from slam.trajectory import Trajectory
from slam.validation import number

from ..console.tables import plain_table
from ..report.scores import ALIGNED, ATE, F1, HEADING, QUALITY, present

if TYPE_CHECKING:
    from .score import ScoreCommand

MAP_ENDINGS = (".yaml", ".yml")
COLUMNS = (ATE, ALIGNED, HEADING, F1)
SHORT = {ATE: "ATE mm", ALIGNED: "aligned", HEADING: "head. deg", F1: "F1"}


class Output(NamedTuple):
    """What a SLAM system wrote of an episode; a map is not needed."""

    trajectory: Path
    map: Path | None


def score_files(options: ScoreCommand) -> int:
    """Read, score, print; the exit status."""
    number("offset", options.offset)
    found = [_scores(options, output) for output in outputs(options.files)]
    if options.json:
        print(json.dumps(found[0] if len(found) == 1 else found))
    elif len(found) == 1:
        _print_one(found[0])
    else:
        Console().print(_table(found))
    return 0


def outputs(files: Sequence[Path]) -> list[Output]:
    """Trajectories with the map that follows each. Raises InputError for a map without one."""
    found: list[Output] = []
    for path in files:
        if path.suffix.lower() not in MAP_ENDINGS:
            found.append(Output(path, None))
        elif found and found[-1].map is None:
            found[-1] = found[-1]._replace(map=path)
        else:
            raise InputError(f"{path}: a map follows its trajectory, and there is none before it")
    if not found:
        raise InputError("no trajectory named")
    return found


def episode_file(place: Path, trajectory: Path) -> Path:
    """The episode of a trajectory: `place`, or in that folder the one with the longest name that
    the trajectory's file name or its folder's name begins with. Raises InputError without one."""
    if not place.is_dir():
        return place
    names = trajectory.name, trajectory.resolve().parent.name
    fitting = [
        path
        for path in place.glob("*.npz")
        if any(re.match(rf"{re.escape(path.stem)}(?![A-Za-z0-9])", name) for name in names)
    ]
    if not fitting:
        raise InputError(f"{trajectory}: no episode in {place} has a name that its own begins with")
    return max(fitting, key=lambda path: len(path.stem))


def _scores(options: ScoreCommand, output: Output) -> Result:
    episode = _loaded(episode_file(options.episode, output.trajectory))
    given = read_tum(output.trajectory)
    moved = Trajectory(given.times + options.offset, given.poses)
    grid, frame = read_placed_map(output.map) if output.map is not None else (None, Pose2())
    scores = score_external(episode, moved, grid, frame, options.frame)
    return {"trajectory": str(output.trajectory), "of": len(episode.scans), **scores}


@lru_cache(maxsize=1)
def _loaded(path: Path) -> Episode:
    return load_episode(path)


def _print_one(scores: Result) -> None:
    print(f"{scores['scans']} of {scores['of']} scans")
    for score in present(QUALITY, [scores]):
        value = score.of(scores)
        assert value is not None
        print(f"{score.name:>24}: {score.format(value)}{score.unit}")


def _table(found: Sequence[Result]) -> object:
    shown = present(COLUMNS, found)
    rows = [
        [one["trajectory"], f"{one['scans']}/{one['of']}"]
        + ["-" if (value := score.of(one)) is None else score.format(value) for score in shown]
        for one in found
    ]
    return plain_table(["trajectory", "scans", *(SHORT[score] for score in shown)], rows)
