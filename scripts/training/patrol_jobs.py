"""A patrol as a job: one agent, one world, one SLAM, one seed."""

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
from dynslam_env.record import RecordingWrapper
from slam.benchmark.results import Result, origin

from ..figures.film import write_film
from ..trials.jobs import Done, failure, file_name
from ..trials.recorded_run import RecordedRun, record_run
from ..trials.sources import digest, sparser
from .patrol_scorer import MAP_EVERY, PatrolJudge

SUITE = "evaluate"
SPEED = 5.0  # of a film, times as fast as it was
BUDGETS = {"corridor": 250, "loop": 500, "office": 750, "crowd": 250}
"""Steps of 0.4 s that a patrol of each world has."""
STEPS = 250  # of 0.4 s, in any other world


@dataclass(frozen=True)
class Patrol:
    """One agent on one patrol.

    world, slam  what it is compared under
    agent        its name, or the file of a trained policy
    seed         of the world, and of the agent
    steps        its budget of time
    limit        s, after which it counts as hanging
    pictured     whether to keep the run to be looked at
    film         where to write a film, if anywhere
    """

    world: str
    slam: str
    agent: str
    seed: int
    steps: int
    limit: float = 600.0
    pictured: bool = False
    film: Path | None = None

    def __call__(self) -> Done:
        """Run and judge it; an exception is a result."""
        try:
            row, seen = self._run()
            json.dumps(row, allow_nan=False)
        except Exception as error:  # whatever an agent raises is its result
            return Done(self.row() | failure(error))
        return Done(row, seen)

    def _run(self) -> tuple[Result, RecordedRun | None]:
        env = DoorPatrolEnv(
            world=self.world, slam=self.slam, score_every=MAP_EVERY,
            render_mode="rgb_array" if self.film else None,
        )  # fmt: skip
        observation, _ = env.reset(seed=self.seed)
        agent = agents.make(self.agent, env, self.seed)
        judge, recorded = PatrolJudge(env), RecordingWrapper(env.place) if self.pictured else None
        if recorded is not None:
            env.wrapped.env = recorded  # an action is held for several steps of the world
        frames: list[Image.Image] = []
        state, start, thinking = None, np.ones(1, dtype=bool), 0.0
        for _ in range(self.steps):
            before = time.perf_counter()
            action, state = agent.predict(observation, state, start, deterministic=True)
            thinking += time.perf_counter() - before
            observation, reward, *_, info = env.step(action)
            start = np.zeros(1, dtype=bool)
            judge.step(reward, info)
            if self.film is not None:
                frames.append(Image.fromarray(np.asarray(env.render())))
        if self.film is not None:
            self.film.parent.mkdir(parents=True, exist_ok=True)
            write_film(frames, self.film, SPEED / env.period)
        row = self.row() | judge.scores() | {"ms_per_step": 1e3 * thinking / self.steps}
        row["duration"] = self.steps * env.period
        seen = None
        if recorded is not None:
            drive = sparser(recorded.recorder.episode({}), env.orders.scan_every)
            seen = record_run(self.slam, drive, 0)
        env.close()
        return row, seen

    def row(self) -> Result:
        """What is known without running it."""
        return {
            "run": self.name,
            "suite": SUITE,
            "condition": list(self.condition),
            **self.condition,
            "variant": self.agent,
            "seed": self.seed,
            "episode": self.episode,
            "error": None,
            **origin(),
        }

    @property
    def condition(self) -> Mapping[str, str | float]:
        """The factors that agents are compared under."""
        return {"world": self.world, "slam": self.slam}

    @property
    def episode(self) -> str:
        """A name of the place and of all that happens there by itself."""
        plain: dict[str, Any] = {"world": self.world, "seed": self.seed, "steps": self.steps}
        return digest(plain)

    @property
    def name(self) -> str:
        """Of this run, in every evaluation."""
        return f"{self.episode}-{file_name(self.slam)}-{file_name(self.agent)}"
