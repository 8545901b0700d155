"""Patrol jobs: one agent in one world with one SLAM and one seed."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import agents
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.long_env import LongPatrolEnv
from dynslam_env.record import RecordingWrapper
from dynslam_env.reset_options import reset_arguments
from dynslam_env.simulation.find_world import find_world
from slam.benchmark.results import Result, origin

from ..figures.film import write_film
from ..trials.jobs import Done, failure, file_name
from ..trials.recorded_run import RecordedRun, record_run
from ..trials.sources import digest, sparser
from .patrol_scorer import MAP_PERIOD, PatrolScorer
from .registered import register_all
from .worlds import LONG_PATROL, PATROL_ENVS, content_of

SUITE = "evaluate"
FILM_SPEED = 5.0  # times real time


@dataclass(frozen=True)
class Patrol:
    """One agent on one patrol.

    world       a registered name, a world file (.json), or FILE.py:NAME
    slam        name of the variant
    agent       its name, a policy's file, or FILE.py:NAME
    seed        of the world and of the agent
    steps       of the episode, 0.4 s each
    limit       s, after which it counts as hanging
    pictured    whether to keep the run for the report
    film        file to write a film to; None: no film
    split       of which `seed` is the number of the episode; None: of none
    difficulty  of the world; None: as it is
    registered  objects registered by the user in the process that made this job; see `registered`
    env         id of the patrol, one of PATROL_ENVS
    """

    world: str
    slam: str
    agent: str
    seed: int
    steps: int
    limit: float = 600.0
    pictured: bool = False
    film: Path | None = None
    registered: bytes | None = None
    split: str | None = None
    difficulty: str | None = None
    env: str = PATROL_ENVS[0]

    def __call__(self) -> Done:
        """Run and score it; an exception becomes a result."""
        try:
            register_all(self.registered)
            row, seen = self._run()
            json.dumps(row, allow_nan=False)
        except Exception as error:  # an agent may raise anything
            return Done(self.row() | failure(error))
        return Done(row, seen)

    def _run(self) -> tuple[Result, RecordedRun | None]:
        kind = LongPatrolEnv if self.env == LONG_PATROL else DoorPatrolEnv
        env = kind(
            world=find_world(self.world), difficulty=self.difficulty, slam=self.slam,
            score_every=MAP_PERIOD,
            render_mode="rgb_array" if self.film else None,
        )  # fmt: skip
        observation, _ = env.reset(**reset_arguments(self.seed, self.split))
        agent = agents.make(self.agent, env, self.seed)
        scorer, recorded = PatrolScorer(env), RecordingWrapper(env.place) if self.pictured else None
        if recorded is not None:
            env.wrapped.env = recorded  # an action is held for several steps of the world
        frames: list[Image.Image] = []
        state, start, seconds = None, np.ones(1, dtype=bool), 0.0
        for _ in range(self.steps):
            before = time.perf_counter()
            action, state = agent.predict(observation, state, start, deterministic=True)
            seconds += time.perf_counter() - before
            observation, reward, *_, info = env.step(action)
            start = np.zeros(1, dtype=bool)
            scorer.step(reward, info)
            if self.film is not None:
                frames.append(Image.fromarray(np.asarray(env.render())))
        if self.film is not None:
            self.film.parent.mkdir(parents=True, exist_ok=True)
            write_film(frames, self.film, FILM_SPEED / env.period)
        row = self.row() | scorer.scores() | {"ms_per_step": 1e3 * seconds / self.steps}
        row["duration"] = self.steps * env.period
        seen = None
        if recorded is not None:
            drive = sparser(recorded.recorder.episode({}), env.patrol_config.scan_every)
            seen = record_run(self.slam, drive, 0)
        env.close()
        return row, seen

    def row(self) -> Result:
        """The part of the result that is known before it runs."""
        return {
            "run": self.name,
            "suite": SUITE,
            "condition": list(self.condition),
            **self.condition,
            **self._drawn_from,
            "variant": self.agent,
            "seed": self.seed,
            "episode": self.episode,
            "error": None,
            **origin(),
        }

    @property
    def condition(self) -> Mapping[str, str | float]:
        """The factors under which agents are compared."""
        return {"world": self.world, "slam": self.slam}

    @property
    def episode(self) -> str:
        """A name of the episode without the agent: world, seed, steps, and a world file's text."""
        plain: dict[str, Any] = {"world": self.world, "seed": self.seed, "steps": self.steps}
        return digest(plain | self._drawn_from | content_of(self.world))

    @property
    def _drawn_from(self) -> dict[str, str]:
        """Split, difficulty and environment, where they are not the usual ones."""
        env = None if self.env == PATROL_ENVS[0] else self.env
        given = {"env": env, "split": self.split, "difficulty": self.difficulty}
        return {name: value for name, value in given.items() if value is not None}

    @property
    def name(self) -> str:
        """A name of this run, the same in every evaluation."""
        return f"{self.episode}-{file_name(self.slam)}-{file_name(self.agent)}"
