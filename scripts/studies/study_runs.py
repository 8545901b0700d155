"""The work of `dynslam study`: all cases on every drive, and their table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents import record_path
from slam.benchmark.results import Result
from slam.benchmark.run import Playback, Run
from slam.benchmark.statistics import median, paired, share
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, wrap_angle
from slam.interface import Slam
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.trajectory import ate
from slam.validation import unknown_name, whole_number

from ..console.output import own_directory
from ..report.scores import format_p
from ..trials.pool import check_workers
from .cases import DOOR_LAWS, STUDIES
from .drives import run_drives, write_table

if TYPE_CHECKING:
    from .study import StudyCommand

FIRST_NEES_SCAN = 20  # before, the pose is still known exactly
REGION = 7.815  # squared error, normalised, of the region that holds 95 % of poses (chi^2, 3)
HEADINGS = ("case", "doors flip", "ATE, mm", "online", "along / across, mm", "minus the first, mm",
            "F1", "Brier of doors", "NEES / 3", "within 95 %", "failed", "ms")  # fmt: skip
SCORES = ("ate", "ate_aligned", "heading_rms", "failed", "f1_5cm", "brier_share_door")


def run_study(options: StudyCommand) -> int:
    """Run, write, print; the exit status."""
    if options.name not in STUDIES:
        raise InputError(unknown_name("study", options.name, STUDIES))
    whole_number("seeds", options.seeds, 1)
    whole_number("first", options.first, 0)
    check_workers(options.jobs)
    out = own_directory(options.out or Path("out") / f"study-{options.name}")
    tasks = [(options.name, options.first + k) for k in range(options.seeds)]
    rows, status = run_drives(drive, tasks, options.jobs, out, "study")
    if rows:
        write_table(table(rows), out)
    return status


def drive(study: str, seed: int) -> list[Result]:
    """All cases on the drives of one seed, each drive recorded once."""
    drives: dict[Any, Episode] = {}
    scorers: dict[Any, EpisodeScorer] = {}
    rows = []
    for case in STUDIES[study]():
        key = case.env, case.doors, case.world
        if key not in drives:
            drives[key] = record_path(case.env, seed, DOOR_LAWS[case.doors], **dict(case.world))
        row, done = _run(case.make(drives[key], seed), drives[key])
        grid = done.grid
        place = *key, grid.spec.resolution
        if place not in scorers:
            scorers[place] = EpisodeScorer(drives[key], grid.spec.resolution)
        scores = scorers[place].scores(done.poses, grid)
        kept = {name: scores[name] for name in SCORES}
        rows.append(
            {"case": case.name, "doors": case.doors, "seed": seed, "env": case.env, **kept, **row}
        )
    return rows


def _run(robot: Slam, episode: Episode) -> tuple[Result, Run]:
    """The scores that only a study has, and the run; errors and covariances are those of the online
    estimates."""
    assert episode.truth is not None
    playback = Playback(robot, episode)
    covariances = np.array([estimate.covariance for estimate in playback])
    run = playback.result()
    errors = run.online - episode.truth.poses
    errors[:, 2] = wrap_angle(errors[:, 2])
    row = {
        "ate_online": ate(run.online, episode.truth.poses),
        "rms_along": float(np.sqrt((errors[:, 0] ** 2).mean())),
        "rms_across": float(np.sqrt((errors[:, 1] ** 2).mean())),
        **consistency(errors[FIRST_NEES_SCAN:], covariances[FIRST_NEES_SCAN:]),
        "ms": run.ms_per_matched_scan,
    }
    return row, run


def consistency(errors: Array, covariances: Array) -> dict[str, float | None]:
    """Of errors (n, 3) with covariances (n, 3, 3): `nees`, the normalised estimation error squared,
    mean of e' P^-1 e over a drive, 3 if consistent; `within`, the share of the scans whose error
    lies in the region that is to hold 95 % of them. None where a covariance is singular."""
    if not len(errors) or np.linalg.det(covariances).min() <= 0:
        return {"nees": None, "within": None}
    squares = (errors * np.linalg.solve(covariances, errors[..., None])[..., 0]).sum(1)
    return {"nees": float(squares.mean()), "within": float((squares < REGION).mean())}


def table(rows: list[Result]) -> str:
    """Markdown: medians with their intervals, and the paired difference to the first case."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for row in rows:
        groups.setdefault((row["case"], row["doors"]), []).append(row)
    firsts: dict[tuple[str, str], list[Result]] = {}
    for (_, doors), group in groups.items():
        firsts.setdefault((group[0]["env"], doors), group)
    lines = [HEADINGS, ("---",) * len(HEADINGS)]
    lines += [_line(*key, group, firsts[group[0]["env"], key[1]]) for key, group in groups.items()]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _line(case: str, doors: str, group: list[Result], first: list[Result]) -> tuple[str, ...]:
    ate = median([1e3 * row["ate"] for row in group])
    failed = share([row["failed"] for row in group])
    difference = "-"
    if group is not first:
        found = paired([1e3 * r["ate"] for r in group], [1e3 * r["ate"] for r in first])
        value, low, high = found.difference
        difference = f"{value:+.1f} ({low:+.1f} to {high:+.1f}), {format_p(found.p)}"
    return (
        case,
        doors,
        f"{ate.value:.1f} ({ate.low:.1f} to {ate.high:.1f})",
        f"{1e3 * _median(group, 'ate_online'):.1f}",
        f"{1e3 * _median(group, 'rms_along'):.0f} / {1e3 * _median(group, 'rms_across'):.0f}",
        difference,
        f"{_median(group, 'f1_5cm'):.2f}",
        f"{_median(group, 'brier_share_door'):.2f}",
        f"{_median(group, 'nees') / 3:.1f}",
        f"{100 * _mean(group, 'within'):.0f} %",
        f"{100 * failed.value:.0f} % ({100 * failed.low:.0f} to {100 * failed.high:.0f})",
        f"{_median(group, 'ms'):.2f}",
    )


def _mean(group: list[Result], name: str) -> float:
    values = [row[name] for row in group if row[name] is not None]
    return float(np.mean(values)) if values else float("nan")


def _median(group: list[Result], name: str) -> float:
    values = [row[name] for row in group if row[name] is not None]
    return float(np.median(values)) if values else float("nan")
