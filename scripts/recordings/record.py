"""`dynslam record ENV`: episodes as files, for any SLAM system."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import tyro

from slam.errors import InputError
from slam.validation import one_of, unknown_name


@dataclass
class RecordCommand:
    """Record simulated drives as files for any SLAM system.

    The robot follows the path of a world. npz: everything, with the truth, for `dynslam score` and
    `dynslam bench logs`; carmen: a CARMEN log; mcap: a ROS 2 bag with /scan, /odom, /tf,
    /tf_static, /ground_truth; tum: the true trajectory.
    """

    env: tyro.conf.Positional[str]
    """Id of the environment, such as DoorCorridor-v0; or MODULE:ID of a world of your own, which
    MODULE registers."""
    seeds: str = "5000"
    """Seeds: a number, a range such as 5000-5009, or several of these separated by commas. With
    --split, the numbers of episodes there; with --days, the buildings."""
    split: str | None = None
    """train, validation or test: record episodes of this split."""
    difficulty: str | None = None
    """easy, medium or hard. Default: the world as it is."""
    out: Path = Path("out/episodes")
    """Directory to write to: ENV-SEED.npz, .log.gz, .tum, and the folder ENV-SEED of the bag."""
    formats: str = "all"
    """npz, carmen, mcap, tum, separated by commas; or all."""
    doors: str | None = None
    """moving, static, or a registered law. Default: those of the world."""
    laser: str | None = None
    """SICK-LMS200, Hokuyo-UTM-30LX or RPLIDAR-A2, with the effects of the real one. Default: the
    laser of the paper's experiment, without effects."""
    robot: str | None = None
    """Pioneer-3DX or TurtleBot3. Default: the robot of the paper's experiment."""
    days: int | None = None
    """Record a campaign: visits to one building on so many days. Its doors have habits, furniture
    is moved, boxes are left and taken, and people come by the hour. A seed is a building."""
    visits: int = 3
    """With --days: the number of visits a day, between 7 and 19 o'clock."""
    minutes: float = 3.0
    """With --days: how long a visit lasts."""
    history: Path | None = None
    """With --days: the doors do what a real door did, by a CSV file with the header
    begin_s,end_s,state (state 1: open). Door k is k weeks ahead of door 0."""

    def __call__(self) -> int:
        """Record, write."""
        from dynslam_env import LASERS, ROBOTS
        from dynslam_env.registration import imported_id, world_ids
        from dynslam_env.reset_options import DIFFICULTIES
        from dynslam_env.simulation.registry import NAMED_LAWS
        from dynslam_env.splits import SPLITS

        from ..console.output import output_directory
        from ..console.progress import progress_bar
        from ..console.selection import parse_selection
        from ..trials.cache import episode_of
        from ..trials.code import module_digest
        from ..trials.episode_formats import RECORDED
        from ..trials.sources import SimulatedDrive
        from .campaign import record_campaigns

        env = imported_id(self.env)
        if env not in world_ids():
            raise InputError(unknown_name("environment", env, world_ids()))
        formats = parse_selection("format", self.formats, list(RECORDED), "dynslam record --help")
        known = {"doors": NAMED_LAWS.names(), "laser": tuple(LASERS), "robot": tuple(ROBOTS)}
        known |= {"difficulty": DIFFICULTIES}
        stem = env if self.split is None else f"{env}-{self.split}"
        parameters = {name: value for name in known if (value := getattr(self, name)) is not None}
        for name, value in parameters.items():
            one_of(name, value, known[name])
        one_of("split", self.split, (None, *SPLITS))
        seeds = numbers(self.seeds)
        if self.days is not None:
            return record_campaigns(self, seeds, parameters, formats)
        if self.history is not None:
            raise InputError("--history is of a campaign: give its number of days, --days")
        out, module = output_directory(self.out), self.env.rpartition(":")[0]
        code = module_digest(module) if module else ""
        with progress_bar() as bar:
            for seed in bar.track(seeds, description=env):
                episode = episode_of(
                    SimulatedDrive(env, seed, parameters, code=code, split=self.split)
                )
                for name in formats:
                    RECORDED[name](episode, out / f"{stem}-{seed}")
        episodes = "1 episode" if len(seeds) == 1 else f"{len(seeds)} episodes"
        print(f"{episodes} of {env} as {', '.join(formats)} in {out}")
        return 0


def numbers(text: str) -> list[int]:
    """Seeds such as `5000-5009,6000` as numbers, each once. Raises InputError."""
    found: dict[int, None] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,9})(?:-(\d{1,9}))?\s*", part)
        low, high = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if low > high:
            raise InputError(f"seeds must be like 5000, 5000-5009 or 1,3,5-7, got {text!r}")
        found |= dict.fromkeys(range(low, high + 1))
    return list(found)
