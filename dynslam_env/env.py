"""DoorCorridor-v0 and the other worlds: one simulated world as a Gymnasium environment."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Unpack

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dynslam_env.drawing.render import Viewer
from dynslam_env.drawing.scene import Belief, Scene, scene
from dynslam_env.drawing.view import View
from dynslam_env.faults.episode_faults import names_of
from dynslam_env.reset_options import EpisodeOptions, episode_options
from dynslam_env.simulation.config import WorldConfig, WorldKeywords, check_keywords
from dynslam_env.simulation.contacts import CONTACT_COLUMNS
from dynslam_env.simulation.occupancy_history import DEFAULT_CELL, OccupancyHistory
from dynslam_env.simulation.world import CONTROL_DT
from dynslam_env.simulation.world_batch import WorldBatch, actions_of
from dynslam_env.simulation.world_view import WorldView
from slam.geometry import Pose2
from slam.metrics.change import TrueOccupancy
from slam.validation import one_of

Observation = dict[str, Any]
ONLY_ROW = np.zeros(1, dtype=np.int64)  # the rows to step in a batch of one world
MAX_TRAIL = 6000  # poses kept for drawing
NO_CONTACT: dict[str, bool | float] = dict.fromkeys(CONTACT_COLUMNS, False) | {"impulse": 0.0}


class DoorWorldEnv(WorldView, gym.Env[Observation, NDArray[np.float32]]):
    """A mobile robot with a laser scanner in a world whose doors open and close.

    ## Description
    A Pioneer 3-DX drives along a passage of 12 x 2 m with four hinged doors on each side, and back.
    Each door flips (opens or closes) after a time drawn from U(5, 20) s. A leaf swings, gives way
    when it is pushed, and is held up when the robot is in its way. The laser measures the world as
    it is now; the odometry has a large systematic error. This is the experiment for which Dynamic
    Maximum Likelihood SLAM was proposed (Mitsou and Tzafestas): estimate the robot's pose and a map
    of the place while it changes. The defaults are those of that experiment. The physics runs at
    100 Hz, control at 10 Hz. All worlds are configurations of this one class:

    | id                        | world                                                    | steps |
    |---------------------------|----------------------------------------------------------|-------|
    | `DoorCorridor-v0`         | the passage                                              | 1000  |
    | `DoorCorridorStatic-v0`   | the passage; its doors never move after the reset        | 1000  |
    | `DoorLoop-v0`             | corridors around a block of rooms: the path closes a loop | 2000 |
    | `DoorOffice-v0`           | a floor of rooms, drawn anew at each reset; doors are short cuts | 5000 |
    | `DoorCrowd-v0`            | the passage with six people who walk from room to room   | 1500  |
    | `DoorWings-v0`            | three corridors at oblique angles, drawn anew at each reset; hinged, double and sliding doors | 2500 |

    ## Action Space
    `Box(-1, 1, (2,), float32)`; values outside are clipped:

    | index | action                      | -1 and 1 stand for | unit  |
    |-------|-----------------------------|--------------------|-------|
    | 0     | desired forward velocity    | -/+ 1.2            | m/s   |
    | 1     | desired turning velocity    | -/+ 5.2            | rad/s |

    The velocities approach the desired ones within the limits of acceleration. Where a pair of
    velocities exceeds what a wheel can do, both are reduced by the same factor, so that the robot
    stays on the same arc.

    ## Observation Space
    `Dict`, all float32:

    | key        | shape    | content                                              | range        | unit       |
    |------------|----------|------------------------------------------------------|--------------|------------|
    | `scan`     | (beams,) | ranges from right to left; no echo is max_range, no reading is 0 | 0 .. 8 | m     |
    | `odometry` | (3,)     | displacement dx, dy, dtheta in the last step as the wheels report it, in the robot's frame at the beginning of the step | -1 .. 1, -pi .. pi | m, m, rad |
    | `velocity` | (2,)     | mean forward and turning velocity of the last step by the same wheels: those of the arc to `odometry` | -1.2 .. 1.2, -5.2 .. 5.2 | m/s, rad/s |

    The path is not part of the observation; it is `env.unwrapped.layout.path` (in the passage: to
    the other end and back). `env.unwrapped.scan` and `env.unwrapped.displacement` are the scan and
    the odometry in double precision, as a SLAM takes them (no echo is inf, no reading is NaN).

    ## Rewards
    A weighted sum of named terms (`Task.reward`); `info["reward_terms"]` holds each weighted term:

    | term        | weight | value                                        | unit |
    |-------------|--------|----------------------------------------------|------|
    | `progress`  | 1.0    | distance gained along the current leg of the path | m |
    | `collision` | -0.1   | 1 in a step with contact                     |      |
    | `time`      | -0.05  | duration of the step                         | s    |
    | `arrived`   | 5.0    | 1 in the step that completes the path        |      |

    A leg of the path ends when the robot is within 0.3 m of its waypoint (`Task.reach`). The
    progress of a step never exceeds the distance that was driven.

    ## Starting State
    The robot stands 0.8 m from the western end and faces along the passage. The positions of the
    doors, the sides of their hinges, and which of them are open (each with probability 0.5) are
    random. Layout, doors, laser noise, odometry noise and people have separate random streams:
    environments with the same seed that differ only in `doors` share everything else.
    `reset(options={"start": (x, y, theta)})` starts the robot at another pose (m, m, rad); a pose
    at which it would overlap a wall, a leaf or a person is rejected.

    `reset(options={"split": "test", "index": 17})` begins episode 17 of the split: world, doors,
    people and noise are the same in every process, and occur in no other split and with no seed.
    Splits are "train", "validation" and "test"; a seed beside them is an error. The id's own stream
    of episodes goes on as if that reset had not been. `"difficulty"` in the options is that of this
    one episode. What a difficulty is, and reference scores: docs/splits.md.

    ## Episode End
    Termination: any of the ends named in `Task.ends` is true (`info["ends"]`). By default this is
    `arrived`; `crashed` is available. Truncation: after the number of steps above.

    ## Information
    | key            | shape | content                                            | unit      |
    |----------------|-------|----------------------------------------------------|-----------|
    | `pose`         | (3,)  | true pose x, y, theta                              | m, m, rad |
    | `door_angles`  | (d,)  | opening angles; 0 is closed; of a leaf that slides, the share that is open of the angle of a hinged one | rad |
    | `people`       | (p, 2) | positions of the people                           | m         |
    | `collision`    | bool  | contact with a wall, a door or a person at any time in the step | |
    | `contact`      | dict  | `wall`, `door`, `person`: which of them were touched in the step; `at_end`: whether something is touched at its end; `impulse`: sum of the contacts' impulses in the step | bool, N s |
    | `time`         | float | time since the reset                               | s         |
    | `reward_terms` | dict  | weighted reward terms; after a step only           |           |
    | `ends`         | dict  | which ends are true; after a step only             |           |
    | `split`, `index` | str, int | of an episode of a split only                     |           |
    | `faults`       | dict  | with `faults` only: which of them act in this step |           |
    | `fault_times`  | dict  | with `faults` only: end of the first step of the last occurrence of each; NaN before | s |

    ## Arguments
    All are keywords; invalid values raise `slam.InputError` (a ValueError).

    | argument      | type, default              | content                                       |
    |---------------|----------------------------|-----------------------------------------------|
    | `world`       | "corridor", "loop", "office", "crowd", "wings", a `Generator`; `Corridor()` | the place: a registered name, a `Corridor`, `Loop`, `Office` or `Wings`, a `Layout` built by hand or loaded from a file (`Layout.load`), a map (`FromMap`), or any object with `layout(rng)` |
    | `difficulty`  | "easy", "medium", "hard"; none | size, rooms, doors, furniture, oblique corners and people of a `Corridor`, `Loop`, `Office` or `Wings`, drawn anew in each episode |
    | `doors`       | "moving", "static", a `Law`, `Doors`; "moving" | a registered name, a law (`Uniform`, `Exponential`, `Periodic`, `Scripted`, `Coupled`, `Fixed`), or law and mechanics of the doors |
    | `robot`       | "Pioneer-3DX", "TurtleBot3", a `Robot`; `Robot()` | body, speeds, accelerations; a named robot carries the laser at its own place |
    | `laser`       | "SICK-LMS200", "Hokuyo-UTM-30LX", "RPLIDAR-A2", a `Laser`; `Laser()` | beams, field of view, range, noise, mount, and the effects of real lasers, below |
    | `odometry`    | `Odometry()`               | what the wheels report: the true displacement with a systematic and a random error, or the ticks of `WheelEncoders` |
    | `people`      | `People()`                 | how people walk; their number and routes belong to the `world` |
    | `task`        | `Task()`                   | reward terms and ends                         |
    | `faults`      | list, none                 | what goes wrong in every episode, below       |
    | `render_mode` | None                       | "rgb_array" or "human"                        |

    ```python
    import gymnasium as gym
    import dynslam_env

    env = gym.make("DoorCorridor-v0", doors="static", laser=dynslam_env.Laser(beams=361))
    envs = gym.make_vec("DoorOffice-v0", 64, world=dynslam_env.Office(furniture=2))
    ```

    ## Real Lasers
    `laser=Laser(effects=(MixedPixels(), Sweep(0.1)))` measures as real lasers do; by default there are
    no effects, and the lasers by name have those of the real ones. Effects have random streams of
    their own and change nothing else. What they cost a SLAM: docs/sensors.md.

    | effect         | default              | what it does                                        |
    |----------------|----------------------|-----------------------------------------------------|
    | `RangeNoise`   | 0                    | the noise grows with the range                      |
    | `Quantisation` | 1 cm                 | ranges are rounded                                  |
    | `MixedPixels`  | 4.4 mrad, 1.5 m      | a beam over an edge gives a range between           |
    | `EchoLoss`     | 32 m on white        | weak echoes (far, oblique, dark) are no echo        |
    | `Surfaces`     | none                 | panels of the walls are of glass, or dark           |
    | `Sweep`        | 0.02 s               | the robot moves while the laser sweeps              |
    | `Latency`      | 0.05 s               | the scan is older than the odometry                 |

    ## Faults
    `faults=[Slip(0.8, at=30.0), Gap(10.0)]` lets things go wrong that a SLAM should notice. They act
    from the first step on (the scan of the reset is right), each has a random stream of its own, and
    nothing else of the episode changes its random numbers. `at` is a time in s, or a pair between
    which it is drawn. A list may hold several of a kind: the second is named "Slip 2" in `info`.

    | fault           | default                | what goes wrong                                     |
    |-----------------|------------------------|-----------------------------------------------------|
    | `Slip`          | 0.4 m, 0 rad           | the odometry reports a motion, ahead or back and to the left or right, that was not made: within 0.5 s, or at once (`duration=0.1`) as after a reset |
    | `OdometryScale` | 1.2 times              | the odometry reports all translations too long      |
    | `Lag`           | 0.2 s                  | the scan is that of some time ago                   |
    | `Gap`           | 10 s                   | no scan arrives: the observation has no reading of any beam, and `SlamWrapper` waits |
    | `WrongBeams`    | 20 %                   | beams report random ranges                          |
    | `MissingBeams`  | 30 %                   | beams report no echo                                |
    | `CarriedAway`   | visited, 3 m away      | the robot is put down elsewhere; the odometry reports nothing |

    A generator or a law of one's own gets a name by `dynslam_env.register_world(name, generator)`
    or `dynslam_env.register_law(name, law)`.

    ## Ground Truth
    `env.unwrapped` has `pose`, `layout`, `outline()` (the edges of everything that moves),
    `occupancy()` (the current grid, and the share of time for which each cell was occupied), and
    `bound()` (the Cramer-Rao bound of the pose):

    ```python
    import matplotlib.pyplot as plt

    env.reset(seed=0)
    truth = env.unwrapped.occupancy()
    plt.imshow(truth.share, origin="lower", extent=truth.spec.extent)
    ```

    ## Version History
    v0: first release. Episodes and `odometry` have not changed since to the bit. `velocity` was
    the body's true velocity, from which the true path could be computed; now it comes from the
    wheels, as `odometry`. The spaces are the same.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": round(1 / CONTROL_DT)}  # noqa: RUF012

    def __init__(self, *, render_mode: str | None = None, **parts: Unpack[WorldKeywords]):
        check_keywords(DoorWorldEnv, WorldKeywords, parts)
        one_of("render_mode", render_mode, (None, *self.metadata["render_modes"]))
        self.world_config = WorldConfig.of(parts)
        self.render_mode = render_mode
        self.action_space = self.world_config.action_space()
        self.observation_space = self.world_config.observation_space()
        super().__init__(WorldBatch(self.world_config, 1))
        self._faults = names_of(self.world_config.faults)
        self._terms, self._ends = tuple(self.world_config.task.reward), self.world_config.task.ends
        self._viewer: Viewer | None = None
        self._asked = EpisodeOptions()
        self.view = View()
        """Which part of the world `render` shows, and its size."""
        self.belief: Callable[[], Belief | None] | None = None
        """Returns a SLAM's map and poses to be drawn beside the truth. Where it is set, its owner
        calls `render` for the "human" mode, after the update of the SLAM."""

    # -- ground truth beside that of `WorldView` -----------------------------------------------

    def occupancy(self, cell: float = DEFAULT_CELL) -> TrueOccupancy:
        """The true map in cells of `cell` m: `now`, and `share`, the share of time since the reset
        for which each cell was occupied."""
        _ = self._begun  # raises before the first reset
        return self._history.occupancy(cell)

    # -- gymnasium -----------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new episode; the same seed gives the same episode.

        options  {"start": (x, y, theta)}: start pose in m, m, rad, instead of the layout's;
                 {"split": "test", "index": 17}: that episode of the split, without a seed;
                 {"difficulty": "hard"}: of this episode
        """
        self._asked = asked = episode_options(options, seed)
        super().reset(seed=seed)
        rng = asked.rng(self.np_random)
        self._batch.reset(0, rng, asked.start, self.world_config.place(asked.difficulty))
        self._history = OccupancyHistory(self.layout.walls, self.physics.outlines)
        self._trail: deque[Pose2] = deque(maxlen=MAX_TRAIL)
        self._record_step()
        return self._observation(), self._info()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one control step of 0.1 s."""
        batch = self._begun
        progress = batch.progress
        batch.step(ONLY_ROW, actions_of(action, (2,))[None])
        self._record_step()
        info = self._info()
        terms, ends = progress.terms.tolist()[0], progress.ends.tolist()[0]
        info["reward_terms"] = dict(zip(self._terms, terms, strict=True))
        info["ends"] = dict(zip(self._ends, ends, strict=True))
        return self._observation(), float(progress.rewards[0]), any(ends), False, info

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
        """The content of a picture; it has a trail only with a `render_mode`."""
        return scene(self._begun, 0, tuple(self._trail))

    def close(self) -> None:
        """Close the window."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    # -- parts of a step -----------------------------------------------------------------------

    def _record_step(self) -> None:
        self._history.add(self._batch.worlds[0].poses())
        if self.render_mode is not None:
            self._trail.append(self.pose)
        if self.render_mode == "human" and self.belief is None:
            self.render()

    def _observation(self) -> Observation:
        batch = self._batch
        return {
            "scan": batch.scans[0].copy(),
            "odometry": batch.odometry[0].copy(),
            "velocity": batch.velocities[0].copy(),
        }

    def _info(self) -> dict[str, Any]:
        world = self._batch.worlds[0]
        info = {
            "pose": self._batch.drive.poses[0].copy(),
            "door_angles": world.openings.copy(),
            "people": world.people.copy(),
            "collision": bool(self._batch.collided[0]),
            "contact": self._contact(),
            "time": world.time,
        }
        if self._asked.place is not None:
            info |= self._asked.info
        if self._faults:
            info |= self._fault_info()
        return info

    def _contact(self) -> dict[str, bool | float]:
        if not self._batch.collided[0]:
            return NO_CONTACT.copy()
        *flags, impulse = self._batch.contacts[0].tolist()
        named = {name: flag > 0.0 for name, flag in zip(CONTACT_COLUMNS, flags, strict=False)}
        return named | {"impulse": impulse}

    def _fault_info(self) -> dict[str, Any]:
        faults = self._batch.faults[0]
        assert faults is not None
        active = dict(zip(self._faults, faults.active(), strict=True))
        return {"faults": active, "fault_times": self.fault_times}
