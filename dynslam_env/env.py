"""DoorCorridor-v0: layout, world, laser, odometry and task as one Gymnasium environment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, is_dataclass
from typing import Any, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dynslam_env.doors import Doors
from dynslam_env.laser import Laser, Scanner
from dynslam_env.layout import Corridor, Generator, Layout
from dynslam_env.odometry import Odometry
from dynslam_env.render import Belief, Scene, Viewer
from dynslam_env.robot import Robot
from dynslam_env.task import Event, Task
from dynslam_env.world import CONTROL_DT, World
from slam.checked import instance, one_of
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.scan import Scan

T = TypeVar("T")
Observation = dict[str, Any]
MAX_TURN_STEP = np.pi  # rad, the odometry's reading of one step stays within
MAX_STEP = 1.0  # m, likewise


class DoorCorridorEnv(gym.Env[Observation, NDArray[np.float32]]):
    """A mobile robot with a laser in a corridor whose doors open and close.

    ## Description
    A Pioneer 3-DX drives along a passage of 12 x 2 m with four hinged doors on each side, and back.
    Each door flips after a time drawn from U(5, 20) s: it swings, it can be pushed, and it waits
    when the robot is in the way. The laser sees the world as it is now; the odometry is badly
    wrong. This is the experiment for which Dynamic Maximum Likelihood SLAM was proposed (Mitsou
    and Tzafestas): where am I, and what does the place look like, while it changes? Defaults are
    that experiment's. Physics runs at 100 Hz, control at 10 Hz.

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

    `env.unwrapped.scan` and `env.unwrapped.motion` are the same as a SLAM takes them, in double
    precision (there, no echo is inf and no reading NaN).

    ## Rewards
    A weighted sum of named terms (`Task.reward`), each in `info["reward_terms"]`, already weighted:

    | term        | weight | what                                         | unit |
    |-------------|--------|----------------------------------------------|------|
    | `progress`  | 1.0    | way made along the present leg of the path   | m    |
    | `collision` | -0.1   | 1 in a step in which anything was touched     |      |
    | `time`      | -0.05  | duration of the step                         | s    |
    | `arrived`   | 5.0    | 1 in the step in which the path was completed |      |

    The path leads there and back; a leg ends within 0.3 m of its waypoint (`Task.reach`). No step
    makes more way than was driven.

    ## Starting State
    The robot stands 0.8 m from the western end, looking along the passage. Where the doors are,
    their hinges, and which of them are open (each with probability 0.5) is drawn. Layout and doors'
    timing, laser noise and odometry noise come from streams of their own: environments of the same
    seed that differ in `doors` alone share all else.

    ## Episode End
    Terminated when any of the named ends is true (`Task.ends`; `info["ends"]`): `arrived` by
    default, `crashed` on request. Truncated after 1000 steps (100 s).

    ## Information
    | key            | shape | what                                               | unit      |
    |----------------|-------|----------------------------------------------------|-----------|
    | `pose`         | (3,)  | true pose x, y, theta                              | m, m, rad |
    | `door_angles`  | (d,)  | 0 closed, positive open                            | rad       |
    | `collision`    | bool  | a wall or a door was touched during the step       |           |
    | `time`         | float | since the beginning                                | s         |
    | `reward_terms` | dict  | after a step only                                  |           |
    | `ends`         | dict  | after a step only                                  |           |

    ## Arguments
    All by keyword; wrong values raise `slam.InputError` (a ValueError).

    | argument      | type, default              | what                                          |
    |---------------|----------------------------|-----------------------------------------------|
    | `world`       | `Corridor()`               | the place; anything with `layout(rng)`        |
    | `doors`       | "moving", "static", `Doors` | law, dwell times, force                       |
    | `robot`       | `Robot()`                  | body, speeds, accelerations                   |
    | `laser`       | `Laser()`                  | beams, field of view, range, noise, mount     |
    | `odometry`    | `Odometry()`               | systematic and random error                   |
    | `task`        | `Task()`                   | reward terms and ends                         |
    | `render_mode` | None                       | "rgb_array" or "human"                        |

    ```python
    import gymnasium as gym
    env = gym.make("dynslam_env:DoorCorridor-v0", doors="static", laser=dynslam_env.Laser(beams=361))
    ```

    ## Version History
    v0: first.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": round(1 / CONTROL_DT)}  # noqa: RUF012

    def __init__(
        self,
        *,
        world: Generator | None = None,
        doors: str | Doors = "moving",
        robot: Robot | None = None,
        laser: Laser | None = None,
        odometry: Odometry | None = None,
        task: Task | None = None,
        render_mode: str | None = None,
    ):
        one_of("render_mode", render_mode, (None, *self.metadata["render_modes"]))
        if isinstance(doors, str):
            one_of("doors", doors, ("moving", "static"))
        self.generator = _given("world", world or Corridor(), Generator)
        self.doors = _given("doors", Doors(law=doors) if isinstance(doors, str) else doors, Doors)
        self.robot = _given("robot", robot or Robot(), Robot)
        self.laser = _given("laser", laser or Laser(), Laser)
        self.odometry = _given("odometry", odometry or Odometry(), Odometry)
        self.task = _given("task", task or Task(), Task)
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = _observation_space(self.laser, self.robot)
        self._viewer: Viewer | None = None
        self.belief: Callable[[], Belief | None] | None = None
        """What a SLAM believes, to be drawn beside the truth; a wrapper may set it."""

    # -- the truth, and what a SLAM takes ------------------------------------------------------

    layout: Layout
    motion: Pose2
    """The odometry's displacement in the last step, in the robot's frame at its beginning."""

    @property
    def pose(self) -> Pose2:
        """The true pose of the robot."""
        return self._world.pose

    @property
    def scan(self) -> Scan:
        """The last scan, in double precision: no echo is inf, no reading NaN."""
        return self._scanner.scan(self._ranges, self._world.time)

    def outline(self) -> Array:
        """(4 d, 4) edges of all door leaves as they stand now, x1, y1, x2, y2 in m."""
        return self._world.segments[len(self.layout.walls) :].copy()

    @property
    def config(self) -> dict[str, Any]:
        """All parameters, as plain data."""
        parts = {"world": self.generator, "doors": self.doors, "robot": self.robot}
        parts |= {"laser": self.laser, "odometry": self.odometry, "task": self.task}
        return {name: _plain(part) for name, part in parts.items()}

    # -- gymnasium -----------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode; the same seed, the same episode. There are no `options`."""
        super().reset(seed=seed)
        layout, doors, laser, self._slip = self.np_random.spawn(4)
        self.layout = self.generator.layout(layout)
        self._world = World(self.layout, self.robot, self.doors, doors)
        self._scanner = Scanner(self.laser, laser)
        self._judge = self.task.judge(self.layout, self._world.pose)
        self.motion = Pose2()
        self._trail = [self._world.pose]
        self._look()
        if self.render_mode == "human":
            self.render()
        return self._observation(), self._info()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for a tenth of a second."""
        before = self._world.pose
        self._world.step(*self._command(action))
        self.motion = self.odometry.reading(before.between(self._world.pose), self._slip)
        self._trail.append(self._world.pose)
        self._look()
        event = Event(self._world.pose, self._world.collided, CONTROL_DT)
        reward, terms, ends = self._judge(event)
        info = self._info() | {"reward_terms": terms, "ends": ends}
        if self.render_mode == "human":
            self.render()
        return self._observation(), reward, any(ends.values()), False, info

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """An image (rows, columns, 3) for "rgb_array"; a window for "human"."""
        if self.render_mode is None:
            gym.logger.warn('render_mode is None: gym.make(..., render_mode="rgb_array") to see it')
            return None
        if self._viewer is None:
            self._viewer = Viewer(self.render_mode == "human", self.metadata["render_fps"])
        return self._viewer.draw(self._scene(), self.belief() if self.belief else None)

    def close(self) -> None:
        """Close the window."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    # -- parts of a step -----------------------------------------------------------------------

    def _command(self, action: NDArray[np.float32]) -> tuple[float, float]:
        v, omega = np.asarray(action, dtype=np.float64).tolist()
        if not (abs(v) < np.inf and abs(omega) < np.inf):
            raise InputError(f"an action is two finite numbers from -1 to 1, got {action}")
        return _clip(v, 1.0) * self.robot.max_speed, _clip(omega, 1.0) * self.robot.max_turn

    def _scene(self) -> Scene:
        world, doors = self._world, self.layout.doors
        opening = self.doors.open_angle
        sweeps = np.array([(*d.hinge, d.closed, d.swing * opening) for d in doors]).reshape(-1, 4)
        leaves, title = self.outline().reshape(-1, 4, 4), f"truth   {world.time:5.1f} s"
        body = world.pose, self.robot.radius, self._trail
        return Scene(self.layout.walls, leaves, sweeps, self.scan, *body, title)

    def _look(self) -> None:
        self._ranges = self._scanner.ranges(self._world.pose, self._world.segments)

    def _observation(self) -> Observation:
        x, y, theta = self.motion
        v, omega = self._world.velocity
        fast, turn = self.robot.max_speed, self.robot.max_turn
        odometry = _clip(x, MAX_STEP), _clip(y, MAX_STEP), theta
        velocity = _clip(v, fast), _clip(omega, turn)
        return {
            "scan": self._scanner.observed(self._ranges),
            "odometry": np.array(odometry, dtype=np.float32),
            "velocity": np.array(velocity, dtype=np.float32),
        }

    def _info(self) -> dict[str, Any]:
        world = self._world
        return {
            "pose": np.array(world.pose),
            "door_angles": world.door_angles,
            "collision": world.collided,
            "time": world.time,
        }


def _given(name: str, value: T, kind: type[Any]) -> T:
    instance(name, value, kind)
    return value


def _plain(part: Any) -> Any:
    return asdict(part) if is_dataclass(part) and not isinstance(part, type) else repr(part)


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _observation_space(laser: Laser, robot: Robot) -> spaces.Dict:
    step = np.array([MAX_STEP, MAX_STEP, MAX_TURN_STEP], dtype=np.float32)
    speed = np.array([robot.max_speed, robot.max_turn], dtype=np.float32)
    return spaces.Dict(
        {
            "scan": spaces.Box(0.0, laser.max_range, (laser.beams,), np.float32),
            "odometry": spaces.Box(-step, step, dtype=np.float32),
            "velocity": spaces.Box(-speed, speed, dtype=np.float32),
        }
    )
