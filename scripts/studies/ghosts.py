"""`dynslam ghosts`: how many ghosts the static layer shows, beside static ML's map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import tyro
from joblib import Parallel, delayed
from rich.console import Console

from agents import record_path
from dynslam_env import DoorWorldEnv
from dynslam_env.worlds.loop import Loop
from slam.benchmark.results import append
from slam.benchmark.run import build, run
from slam.benchmark.statistics import median, share
from slam.episode import Episode
from slam.geometry import Array, Pose2, transform_points
from slam.io.files import replacing
from slam.layers import Layers, layers
from slam.metrics.ghosts import Ghosts, seen_through
from slam.metrics.trajectory import alignment
from slam.validation import one_of, whole_number

from ..console.output import output_directory
from ..console.progress import progress_bar
from ..console.rows import Row

ROUNDS = (1, 3, 6, 12)  # around a block where people walk too: 80 s to 16 min
PLACES: dict[str, tuple[str, dict[str, Any]]] = {
    "corridor": ("DoorCorridor-v0", {}),
    "office": ("DoorOffice-v0", {}),
    "loop": ("DoorLoop-v0", {}),
    "crowd": ("DoorCrowd-v0", {}),
    **{
        f"rounds-{n}": (
            "DoorLoop-v0", {"world": Loop(laps=n, people=4), "max_episode_steps": 40_000}
        )
        for n in ROUNDS
    },
}  # fmt: skip
BASE, VARIANTS = "static-ml", ("hmm-ml", "dynamic-graph")
AT = 0.35  # m between the middles of a door found and the true one
BOTH = 5  # scans that saw a door closed, and as many that saw through: it could be found
LEAF = 0.08  # m from the middle of the closed leaf: an echo of it
HEAD = ("world", "map", "ghosts per m", "median: times fewer", "mean: times fewer",
        "no beam went through", "walls kept", "doors found: right",
        "doors seen open and closed: found")  # fmt: skip


@dataclass
class GhostsCommand:
    """Count ghosts: occupied cells where nothing always stands.

    Static ML's own map, and the static layer at the poses of other variants, on the same drives
    with moving doors. Writes results.jsonl and table.md.
    """

    worlds: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Of corridor, office, loop, crowd, and rounds-1, -3, -6, -12 (around a block with people); if
    none is given, all."""
    seeds: int = 20
    """Number of drives in each."""
    first: int = 8000
    """The first seed; the layers' parameters were chosen on 1000 to 1005, claims are made on
    others."""
    jobs: int = 2
    """Drives that are run at the same time."""
    out: Path | None = None
    """Directory to write to; if none is given, out/ghosts."""

    def __call__(self) -> int:
        """Run, write, print."""
        for name in ("seeds", "jobs"):
            whole_number(name, getattr(self, name), 1)
        whole_number("first", self.first, 0)
        for world in self.worlds:
            one_of("worlds", world, tuple(PLACES))
        out = output_directory(self.out or Path("out") / "ghosts")
        worlds = self.worlds or tuple(PLACES)
        path, rows = out / "results.jsonl", []
        path.unlink(missing_ok=True)
        tasks = [(w, s) for w in worlds for s in range(self.first, self.first + self.seeds)]
        with progress_bar() as bar:
            work = Parallel(n_jobs=self.jobs, return_as="generator")
            done: Iterable[list[Row]] = work(delayed(drive)(*task) for task in tasks)  # pyright: ignore
            for found in bar.track(done, total=len(tasks), description="ghosts"):
                for row in found:
                    append(path, row)
                rows.extend(found)
        text = table(rows)
        with replacing(out / "table.md") as file:
            file.write(text.encode())
        Console().print(text, highlight=False, soft_wrap=True, markup=False)
        return 0


def drive(world: str, seed: int) -> list[Row]:
    """All maps of one drive."""
    env_id, parameters = PLACES[world]
    episode = record_path(env_id, seed, "moving", **parameters)
    assert episode.truth is not None
    judge, truth = Ghosts(episode), episode.truth.poses
    middles = true_doors(world, seed)
    known = seen_both(episode, middles)
    done = run(build(BASE, episode, seed), episode)
    row: Row = {"world": world, "seed": seed}
    base = judge.score(done.grid, alignment(done.poses, truth)).as_dict()
    rows = [{**row, "map": BASE, **base}]
    for variant in VARIANTS:
        done = run(build(variant, episode, seed), episode)
        made, frame = layers(episode.scans, done.poses), alignment(done.poses, truth)
        static = made.static_map()
        through = seen_through(episode, judge.centres(static, frame))
        rows.append({
            **row,
            "map": f"layer, {variant}",
            **judge.score(static, frame).as_dict(),
            "no_beam_through": int((through == 0).sum()),
            **_doors(made, frame, middles, known),
        })  # fmt: skip
    return rows


def true_doors(world: str, seed: int) -> Array:
    """(d, 2) m, the middles of the closed leaves."""
    env_id, parameters = PLACES[world]
    env = gym.make(f"dynslam_env:{env_id}", doors="moving", **parameters)
    env.reset(seed=seed)
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    doors = place.layout.doors
    half = [0.5 * d.width * np.array([np.cos(d.closed), np.sin(d.closed)]) for d in doors]
    return np.array([d.hinge for d in doors]).reshape(-1, 2) + np.array(half).reshape(-1, 2)


def seen_both(episode: Episode, middles: Array) -> np.ndarray:
    """(d,) bool: the middle of the doorway was seen closed, and through, in a few scans each."""
    assert episode.truth is not None
    closed = np.zeros(len(middles), np.int64)
    for scan, pose in zip(episode.scans, episode.truth.poses.tolist(), strict=True):
        echoes = transform_points(Pose2(*pose), scan.points)
        away = np.hypot(*(echoes[:, None] - middles).T)
        closed += (away < LEAF).any(axis=1)
    return (closed >= BOTH) & (seen_through(episode, middles) >= BOTH)


def _doors(made: Layers, frame: Pose2, middles: Array, known: np.ndarray) -> Row:
    found = [transform_points(frame, door.ends).mean(axis=0) for door in made.doors]
    away = np.hypot(*(np.array(found).reshape(-1, 1, 2) - middles).transpose(2, 0, 1))
    return {
        "doors_found": len(found),
        "doors_right": int((away < AT).any(axis=1).sum()),
        "doors_known": int(known.sum()),
        "doors_known_found": int(((away < AT).any(axis=0) & known).sum()),
    }


def table(rows: list[Row]) -> str:
    """Markdown: medians with their intervals."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["world"], row["map"]), []).append(row)
    lines = [HEAD, ("---",) * len(HEAD)]
    lines += [_line(*key, group, groups[key[0], BASE]) for key, group in groups.items()]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _line(world: str, name: str, group: list[Row], base: list[Row]) -> tuple[str, ...]:
    cells = (_told(median([row["ghosts_per_m"] for row in group])),)
    walls = f"{np.median([row['wall_recall'] for row in group]):.3f}"
    if group is base:
        return (world, name, *cells, "-", "-", "-", walls, "-", "-")
    return (world, name, *cells, _told(_times_fewer(base, group, np.median), 1),
            _told(_times_fewer(base, group, np.mean), 1),
            _share(group, "no_beam_through", "ghost_cells"), walls,
            _share(group, "doors_right", "doors_found"),
            _share(group, "doors_known_found", "doors_known"))  # fmt: skip


def _times_fewer(base: list[Row], group: list[Row], centre: Any) -> tuple[float, float, float]:
    """The ratio of two medians or means, with a paired bootstrap 95 % interval."""
    many, few = (np.array([row["ghosts_per_m"] for row in rows]) for rows in (base, group))
    drawn = np.random.default_rng(0).integers(len(many), size=(9999, len(many)))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = centre(many[drawn], axis=1) / centre(few[drawn], axis=1)
        value = float(centre(many) / centre(few))
    low, high = np.percentile(ratios, [2.5, 97.5], method="inverted_cdf")
    return value, float(low), float(high)


def _share(group: list[Row], part: str, whole: str) -> str:
    k, n = (sum(row[name] for row in group) for name in (part, whole))
    found = share([True] * k + [False] * (n - k))
    return f"{k} of {n} ({100 * found.low:.0f} to {100 * found.high:.0f} %)" if n else "-"


def _told(figure: tuple[float, float, float], digits: int = 2) -> str:
    value, low, high = figure
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"
