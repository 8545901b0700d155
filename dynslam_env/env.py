"""DoorCorridor-v0 and the other worlds: a fleet of one as a Gymnasium environment."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dynslam_env.drawing.render import Viewer
from dynslam_env.drawing.scene import Belief, Scene, scene
from dynslam_env.drawing.view import View
from dynslam_env.reset_options import start_of
from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.odometry import Odometry
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.fleet import Fleet, actions_of
from dynslam_env.simulation.laws import Law
from dynslam_env.simulation.localizability import pose_bound
from dynslam_env.simulation.past import CELL, Past
from dynslam_env.simulation.people import People
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.setup import Setup
from dynslam_env.simulation.task import Task
from dynslam_env.simulation.world import CONTROL_DT, World
from dynslam_env.worlds.layout import Generator, Layout
from slam.geometry import Array, Pose2
from slam.metrics.change import TrueOccupancy
from slam.metrics.cramer_rao import Bound
from slam.scan import Scan
from slam.validation import one_of

Observation = dict[str, Any]
ALONE = np.zeros(1, dtype=np.int64)  # the rows of a fleet of one
TRAIL = 6000  # poses that are kept to be drawn


class DoorWorldEnv(gym.Env[Observation, NDArray[np.float32]]):
    """A mobile robot with a laser in a place whose doors open and close.

    ## Description
    A Pioneer 3-DX drives along a passage of 12 x 2 m with four hinged doors on each side, and back.
    Each door flips after a time drawn from U(5, 20) s: it swings, it can be pushed, and it waits
    when the robot is in the way. The laser sees the world as it is now; the odometry is badly
    wrong. This is the experiment for which Dynamic Maximum Likelihood SLAM was proposed (Mitsou
    and Tzafestas): where am I, and what does the place look like, while it changes? Defaults are
    that experiment's. Physics runs at 100 Hz, control at 10 Hz. All worlds are one environment:

    | id                        | place                                                    | steps |
    |---------------------------|----------------------------------------------------------|-------|
    | `DoorCorridor-v0`         | the passage                                              | 1000  |
    | `DoorCorridorStatic-v0`   | the same, its doors fixed as they were drawn             | 1000  |
    | `DoorLoop-v0`             | corridors around a block of rooms: the path closes on itself | 2000 |
    | `DoorOffice-v0`           | a floor of rooms, another at each reset; doors are short cuts | 5000 |
    | `DoorCrowd-v0`            | the passage, and six people who walk from room to room   | 1500  |

    ## Action Space
    `Box(-1, 1, (2,), float32)`, clipped to that range:

    | index | action                       | -1 and 1 stand for | unit  |
    |-------|------------------------------|--------------------|-------|
    | 0     | forward velocity wanted      | -/+ 1.2            | m/s   |
    | 1     | turning velocity wanted      | -/+ 5.2            | rad/s |

    The wheels follow within their acceleration; a pair that no wheel can do is slowed on the same
    arc.

    ## Observation Space
    `Dict`, all float32:

    | key        | shape    | what                                                 | range        | unit       |
    |------------|----------|------------------------------------------------------|--------------|------------|
    | `scan`     | (beams,) | ranges, right to left; no echo = max_range, no reading = 0 | 0 .. 8 | m          |
    | `odometry` | (3,)     | displacement dx, dy, dtheta in the last step, as the wheels report it, in the robot's frame at its beginning | -1 .. 1, -pi .. pi | m, m, rad |
    | `velocity` | (2,)     | forward, turning                                     | -1.2 .. 1.2, -5.2 .. 5.2 | m/s, rad/s |

    Where the path leads is not observed: it is the layout's (`env.unwrapped.layout.path`), in the
    passage to its other end and back. `env.unwrapped.scan` and `env.unwrapped.displacement` are the same as a SLAM takes them, in double
    precision (there, no echo is inf and no reading NaN).

    ## Rewards
    A weighted sum of named terms (`Task.reward`), each in `info["reward_terms"]`, already weighted:

    | term        | weight | what                                         | unit |
    |-------------|--------|----------------------------------------------|------|
    | `progress`  | 1.0    | way made along the present leg of the path   | m    |
    | `collision` | -0.1   | 1 in a step in which anything was touched     |      |
    | `time`      | -0.05  | duration of the step                         | s    |
    | `arrived`   | 5.0    | 1 in the step in which the path was completed |      |

    The path is the layout's, in the passage there and back; a leg ends within 0.3 m of its waypoint
    (`Task.reach`). No step makes more way than was driven.

    ## Starting State
    The robot stands 0.8 m from the western end, looking along the passage. Where the doors are,
    their hinges, and which of them are open (each with probability 0.5) is drawn. Layout, doors,
    laser noise, odometry noise and people come from streams of their own: environments of the same
    seed that differ in `doors` alone share all else. `reset(options={"start": (x, y, theta)})` puts
    the robot elsewhere (m, m, rad); where it cannot stand is refused.

    ## Episode End
    Terminated when any of the named ends is true (`Task.ends`; `info["ends"]`): `arrived` by
    default, `crashed` on request. Truncated after the steps above, 10 of them a second.

    ## Information
    | key            | shape | what                                               | unit      |
    |----------------|-------|----------------------------------------------------|-----------|
    | `pose`         | (3,)  | true pose x, y, theta                              | m, m, rad |
    | `door_angles`  | (d,)  | 0 closed, positive open                            | rad       |
    | `people`       | (p, 2) | where people are                                  | m         |
    | `collision`    | bool  | a wall, a door or a person was touched in the step |           |
    | `time`         | float | since the beginning                                | s         |
    | `reward_terms` | dict  | after a step only                                  |           |
    | `ends`         | dict  | after a step only                                  |           |

    ## Arguments
    All by keyword; wrong values raise `slam.InputError` (a ValueError).

    | argument      | type, default              | what                                          |
    |---------------|----------------------------|-----------------------------------------------|
    | `world`       | "corridor", "loop", "office", "crowd", `Corridor()` | the place: `Corridor`, `Loop`, `Office`, a `Layout` drawn by hand or from a file (`Layout.load`), anything with `layout(rng)` |
    | `doors`       | "moving", "static", a law, `Doors` | law (`Uniform`, `Exponential`, `Periodic`, `Scripted`, `Coupled`, `Static`), force |
    | `robot`       | `Robot()`                  | body, speeds, accelerations                   |
    | `laser`       | `Laser()`                  | beams, field of view, range, noise, mount     |
    | `odometry`    | `Odometry()`               | systematic and random error                   |
    | `people`      | `People()`                 | how people walk; where, and how many, is the `world`'s |
    | `task`        | `Task()`                   | reward terms and ends                         |
    | `render_mode` | None                       | "rgb_array" or "human"                        |

    ```python
    import gymnasium as gym
    import dynslam_env

    env = gym.make("DoorCorridor-v0", doors="static", laser=dynslam_env.Laser(beams=361))
    envs = gym.make_vec("DoorOffice-v0", 64, world=dynslam_env.Office(furniture=2))
    ```

    ## Truth
    `env.unwrapped` has `pose`, `layout`, `outline()` of all that moves, `occupancy()` (the raster now,
    and the share of time that each cell was occupied), and `bound()`, the Cramer-Rao bound of the pose:

    ```python
    import matplotlib.pyplot as plt

    env.reset(seed=0)
    truth = env.unwrapped.occupancy()
    plt.imshow(truth.share, origin="lower", extent=truth.spec.extent)
    ```

    ## Version History
    v0: first.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": round(1 / CONTROL_DT)}  # noqa: RUF012

    def __init__(
        self,
        *,
        world: str | Generator | None = None,
        doors: str | Law | Doors = "moving",
        robot: Robot | None = None,
        laser: Laser | None = None,
        odometry: Odometry | None = None,
        people: People | None = None,
        task: Task | None = None,
        render_mode: str | None = None,
    ):
        one_of("render_mode", render_mode, (None, *self.metadata["render_modes"]))
        parts = {"world": world, "doors": doors, "robot": robot, "laser": laser}
        parts |= {"odometry": odometry, "people": people, "task": task}
        self.setup = Setup.of(parts)
        self.render_mode = render_mode
        self.action_space = self.setup.action_space()
        self.observation_space = self.setup.observation_space()
        self._fleet = Fleet(self.setup, 1)
        self._terms, self._ends = tuple(self.setup.task.reward), self.setup.task.ends
        self._viewer: Viewer | None = None
        self.view = View()
        """What `render` shows of the world, and how large."""
        self.belief: Callable[[], Belief | None] | None = None
        """What a SLAM believes, to be drawn beside the truth. Who sets it draws a "human"
        window itself, when the SLAM has taken in the step."""

    # -- the truth, and what a SLAM takes ------------------------------------------------------

    @property
    def layout(self) -> Layout:
        """The place of this episode."""
        return self._begun.layouts[0]

    @property
    def physics(self) -> World:
        """The simulated world of this episode."""
        return self._begun.worlds[0]

    @property
    def robot(self) -> Robot:
        """The robot's body and limits."""
        return self.setup.robot

    @property
    def pose(self) -> Pose2:
        """The true pose of the robot."""
        return Pose2.of(self._begun.drive.poses[0])

    @property
    def displacement(self) -> Pose2:
        """The odometry's displacement in the last step, in the robot's frame at its beginning."""
        return Pose2.of(self._begun.motions[0])

    @property
    def scan(self) -> Scan:
        """The last scan, in double precision: no echo is inf, no reading NaN."""
        fleet = self._begun
        return fleet.scanners[0].scan(fleet.ranges[0].copy(), fleet.worlds[0].time)

    def outline(self) -> Array:
        """(e, 4) edges of all that can move, as it stands now: x1, y1, x2, y2 in m.

        Four a door leaf, then eight a person.
        """
        return self.physics.outline()

    def occupancy(self, cell: float = CELL) -> TrueOccupancy:
        """The true map so far in cells of `cell` m: `now`, and `share`, of the time since reset."""
        _ = self._begun  # before a reset there is no past
        return self._past.occupancy(cell)

    def bound(self) -> Bound:
        """The Cramer-Rao bound of the pose from the last scan alone, the place being known."""
        return pose_bound(self._begun, 0)

    @property
    def config(self) -> dict[str, Any]:
        """All parameters, as plain data."""
        return self.setup.plain()

    # -- gymnasium -----------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode; the same seed, the same episode.

        options  {"start": (x, y, theta)}: where the robot begins, in m and rad, instead of at the
                 layout's own start
        """
        super().reset(seed=seed)
        self._fleet.reset(0, self.np_random, start_of(options))
        self._past = Past(self.layout.walls, self.physics.outlines)
        self._trail: deque[Pose2] = deque(maxlen=TRAIL)
        self._take_down()
        return self._observation(), self._info()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for a tenth of a second."""
        fleet = self._begun
        judge = fleet.judge
        fleet.step(ALONE, actions_of(action, (2,))[None])
        self._take_down()
        info = self._info()
        info["reward_terms"] = dict(zip(self._terms, judge.terms[0].tolist(), strict=True))
        info["ends"] = ends = dict(zip(self._ends, judge.ends[0].tolist(), strict=True))
        return self._observation(), float(judge.rewards[0]), any(ends.values()), False, info

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """An image (rows, columns, 3) for "rgb_array"; a window for "human"."""
        if self.render_mode is None:
            gym.logger.warn('render_mode is None: gym.make(..., render_mode="rgb_array") to see it')
            return None
        if self._viewer is None:
            self._viewer = Viewer(self.render_mode == "human", self.metadata["render_fps"])
        belief = self.belief() if self.belief else None
        return self._viewer.draw(self.scene(), belief, self.view)

    def scene(self) -> Scene:
        """What is to be drawn; the trail is kept with a `render_mode` only."""
        return scene(self._begun, 0, tuple(self._trail))

    def close(self) -> None:
        """Close the window."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    @property
    def _begun(self) -> Fleet:
        if self._fleet.worlds[0] is None:
            raise gym.error.ResetNeeded("there is no world before reset()")
        return self._fleet

    # -- parts of a step -----------------------------------------------------------------------

    def _take_down(self) -> None:
        self._past.see(self._fleet.worlds[0].poses())
        if self.render_mode is not None:
            self._trail.append(self.pose)
        if self.render_mode == "human" and self.belief is None:
            self.render()

    def _observation(self) -> Observation:
        fleet = self._fleet
        return {
            "scan": fleet.scans[0].copy(),
            "odometry": fleet.odometry[0].copy(),
            "velocity": fleet.drive.observed[0].copy(),
        }

    def _info(self) -> dict[str, Any]:
        world = self._fleet.worlds[0]
        return {
            "pose": self._fleet.drive.poses[0].copy(),
            "door_angles": world.openings.copy(),
            "people": world.people.copy(),
            "collision": world.collided,
            "time": world.time,
        }
