"""DoorPatrolGoals-v0: the patrol with goals as actions; a path follower drives to them."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dynslam_env.patrol.config import PatrolKeywords
from dynslam_env.patrol.env import DoorPatrolEnv, Observation
from dynslam_env.patrol.goal_driver import Decision, GoalConfig, GoalDriver, goals_space, slots_of
from dynslam_env.patrol.goal_options import SLOTS, GoalOptions
from dynslam_env.reset_options import episode_options
from dynslam_env.simulation.config import check_keywords


class DoorPatrolGoalsEnv(gym.Env[Observation, np.int64]):
    """A robot patrols a place whose doors open and close; the agent chooses its goals.

    ## Description
    The task, the SLAM and the dynamic map of `DoorPatrol-v0`. The goals are frontiers of the SLAM's
    map and doors found in the dynamic map, where cells changed. The path follower of the classical
    agents drives to them, slows down before obstacles of the last scan, and recovers when stuck.

    A decision lasts until the goal is reached, until it cannot be (no path leads there any more, or
    the robot made no progress for 4 s), or for `patience`; then the same goal may be chosen again.
    An unfinished recovery continues in the next decision. Decisions take different times: this is a
    semi-Markov decision process (Sutton, Precup and Singh 1999), and the reward is not discounted
    within a decision.

    ## Action Space
    `Discrete(9)`:

    | action | goal                                                                                |
    |--------|-------------------------------------------------------------------------------------|
    | 0      | look around: turn by 170 degrees to the left, on the spot                           |
    | 1 .. 4 | a frontier: stand before it and look beyond; 1 has the shortest path                |
    | 5 .. 8 | a door that was found: look at it from a cell that sees it; 5 was unseen longest    |

    Only goals to which a path leads are offered. A reached frontier, and any goal on the way to
    which the robot was stuck, is left out for 60 s, a visited door for 8 s, with all goals nearer
    to it than 0.5 m. An action without a goal is legal and looks around.

    ## Observation Space
    That of `DoorPatrolEnv`, and:

    | key           | shape          | what                                             | range   |
    |---------------|----------------|--------------------------------------------------|---------|
    | `goals`       | (9, 7) float32 | a row for each action, below                     | -1 .. 1 |
    | `action_mask` | (9,) int8      | 1 where the action has a goal                    | 0, 1    |

    | column | of `goals`                                                            | range   |
    |--------|-----------------------------------------------------------------------|---------|
    | 0      | present: 1; the row of an action without a goal is 0                  | 0, 1    |
    | 1      | length of the path, over 10 m                                         | 0 .. 1  |
    | 2, 3   | cosine, sine of the bearing of frontier or door, from the robot; 0, 0 for action 0 | -1 .. 1 |
    | 4      | size of the frontier, log(cells) / log(200), cells of 0.1 m; doors 0  | 0 .. 1  |
    | 5      | time since it was seen, 1 - exp(-age / 20 s); frontiers 1             | 0 .. 1  |
    | 6      | changes seen, 1 is 0.2 a second; frontiers 0                          | 0 .. 1  |

    `action_masks()` gives the mask for sb3-contrib's MaskablePPO.

    ## Rewards
    The sum of those of `DoorPatrolEnv` over the decision; `info["reward_terms"]` are summed by name.

    ## Starting State
    That of `DoorPatrolEnv`.

    ## Episode End
    Never terminated; truncated when `budget` is used up, within a decision if need be.

    ## Information
    Those of `DoorPatrolEnv` at the end of the decision, but `door_brier` and `collision` are means
    over it, and after a step there are:

    | key       | what                                                    |
    |-----------|---------------------------------------------------------|
    | `steps`   | steps of `DoorPatrolEnv` that the decision took         |
    | `reached` | whether the robot is at the goal and has its heading    |

    ## Arguments
    Those of `DoorPatrolEnv`, and:

    | argument   | default | what                                                               |
    |------------|---------|--------------------------------------------------------------------|
    | `patience` | 4.0 s   | longest decision, a multiple of the period of 0.4 s                |
    | `budget`   | 100.0 s | time of an episode, likewise                                       |

    `gym.make_vec("DoorPatrolGoals-v0", 8)` steps many at once. To train on it by
    stable-baselines3, take its vector environments:

    ```python
    from sb3_contrib import MaskablePPO
    from stable_baselines3.common.env_util import make_vec_env
    import dynslam_env

    envs = make_vec_env("DoorPatrolGoals-v0", 8, env_kwargs={"world": "office", "budget": 500.0})
    MaskablePPO("MultiInputPolicy", envs).learn(100_000)
    ```

    ## Version History
    v0: first.
    """  # noqa: E501

    metadata = DoorPatrolEnv.metadata

    def __init__(
        self,
        *,
        patience: float = GoalConfig.patience,
        budget: float = GoalConfig.budget,
        score_every: int = 0,
        render_mode: str | None = None,
        **parts: Unpack[PatrolKeywords],
    ):
        check_keywords(DoorPatrolGoalsEnv, PatrolKeywords, parts)
        self.patrol = DoorPatrolEnv(score_every=score_every, render_mode=render_mode, **parts)
        self.render_mode = self.patrol.render_mode
        self._limits = GoalConfig(patience, budget).steps(self.patrol.period)
        self.action_space = spaces.Discrete(SLOTS)
        self.observation_space = goals_space()
        self._driver = GoalDriver(self._limits, np.random.default_rng(0))

    @property
    def options(self) -> GoalOptions:
        """The goals that can be chosen now."""
        return self._driver.options

    def action_masks(self) -> NDArray[np.bool_]:
        """(9,) whether an action has a goal."""
        return self.options.mask

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new episode, deterministic for a given seed. `options` are those of the world."""
        observation, info = self.patrol.reset(seed=seed, options=options)
        self._np_random, self._np_random_seed = self.patrol.np_random, self.patrol.np_random_seed
        rng = episode_options(options, seed).rng(self.np_random)  # the world only spawns from it
        self._driver = GoalDriver(self._limits, rng)
        return observation | self._driver.look(self.patrol.snapshot()), info

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive to the goal, at most for `patience`."""
        [slot], driver, patrol = slots_of([action], self.action_space), self._driver, self.patrol
        driver.choose(slot)
        decision, snapshot, info, goes_on = Decision.begun(), patrol.snapshot(), {}, True
        while goes_on:
            reward, info = patrol.advance(driver.action(snapshot))
            decision.add(reward, info["reward_terms"], info["door_brier"], info["collision"])
            snapshot = patrol.snapshot()
            goes_on = driver.goes_on(snapshot)
        brier, collision = decision.means
        told = info | {
            "reward_terms": decision.reward_terms, "door_brier": brier, "collision": collision,
            "steps": driver.steps, "reached": driver.arrived(snapshot),
        }  # fmt: skip
        shown = patrol.observation() | driver.look(snapshot)
        if driver.over and patrol.scored:
            told["slam"] = patrol.finish()
        return shown, decision.reward, False, driver.over, told

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """See `DoorPatrolEnv`."""
        return self.patrol.render()

    def close(self) -> None:
        """Close the window."""
        self.patrol.close()
