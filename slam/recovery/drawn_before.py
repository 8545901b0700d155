"""The old ground of a single map: its field as it was some stretches of the path before."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2, near
from slam.graph.local_map import Keyframe, Panorama, panorama
from slam.kernel import kernel
from slam.recovery.old_ground import DRIFT, HELD, KEYFRAMES, RECENT, WINDOW, OldGround, share
from slam.recovery.places import Place, Surroundings, at, best_near, matched
from slam.recovery.surprise import Surprise
from slam.scan import Scan
from slam.sensor_models.blocks import BLOCKS, blocks_of
from slam.sensor_models.endpoint import Endpoint

THINNED = 12  # keyframes of a stretch, at most, that are looked at
STRETCH, STEP = 4.0, 1.0  # m of the path: of a stretch, and between two looks for a drift
UNEXPLAINED, FITTING = 0.15, 0.1  # share of the known echoes, from which on a drift is sought, and
# up to which the last stretch fits where it is moved to
GAIN = 10.0  # nats by which it must fit better there
HALF, LARGE_GAIN = 0.5, 40.0  # of what is unexplained here; nats: where two looks in a row find the
# same drift: as a loop closes, the old field knows only the far side of what it shows
AGAIN = 0.1, math.radians(1.5)  # m, rad, between the finds of two looks
MOVED = 0.1, math.radians(1.5)  # m, rad, at least, of a drift
REST = 0.05, math.radians(5.0)  # m, rad, from the last keyframe: a robot that stands


class OnPath(NamedTuple):
    """A keyframe, and the path to it, m."""

    keyframe: Keyframe
    path: float


class DrawnBefore:
    """Keeps the field of a map as it was RECENT stretches before, and the last keyframes. A robot
    that was carried draws over its map where it believes to be; the old field does not change yet.

    At the end of each stretch the tiles that were drawn are copied; RECENT stretches later they
    enter the old field, which holds a saved map, and the first scan, from the beginning. It is a
    `Ground`.

    endpoint  reads the old field
    ordinal   number of finished stretches
    drift     transform from where the last stretch was drawn to where it fits the old field: the
              newer map hides the drift from the next scans. None without one
    """

    def __init__(self, field: Endpoint):
        """`field` reads the map, and has been refreshed."""
        self._field, tiles = field, field.tiles
        self._fresh = tiles.layer(np.bool_, shape=())  # tiles that were drawn in this stretch
        self._old = tiles.layer(np.float32, field.unknown)
        self.endpoint = field.of_layer(self._old)
        self._copies: deque[tuple[np.ndarray, np.ndarray]] = deque()  # slots, their fields
        self._drawn: deque[OnPath] = deque(maxlen=KEYFRAMES)
        self._begun = False  # whether a keyframe was added
        self._fresh.values[tiles.current.slots] = True
        self._path = self._ended = self._looked = 0.0  # m; where a stretch ended, or was looked at
        self.ordinal = 0
        self.drift: Pose2 | None = None
        self._likely: Pose2 | None = None  # the drift that the last look found
        self._judge, self._misfits = OldGround(), Surprise(UNEXPLAINED)

    @property
    def votes(self) -> int:
        """See `OldGround`."""
        return self._judge.votes

    def note(self) -> None:
        """The field was refreshed. What is drawn before a keyframe is added is old."""
        _mark(self._field.refreshed, self._field.tiles.index, self._fresh.values)
        if not self._begun:
            self._write(*self._copy())

    def add(self, scan: Scan, pose: Pose2) -> None:
        """Add a keyframe; after each stretch they are judged."""
        self._begun = True
        if self._drawn:
            if near(self.frame, pose, *REST):
                return
            self._path += math.dist(self.frame[:2], pose[:2])
        self._drawn.append(OnPath(Keyframe(scan, pose), self._path))
        if self._path >= self._looked + STEP:
            self._looked = self._path
            self.drift = self._found_drift(scan)
        if self._path >= self._ended + STRETCH:
            if self.drift is None:
                self._judge.judge(self, self._panorama(1))
            self._end()

    def take_drift(self) -> Pose2 | None:
        """The drift, which is known until it is taken."""
        drift, self.drift = self.drift, None
        return drift

    def move(self, by: Pose2) -> None:
        """What was drawn last lies elsewhere, moved by a transform of the world."""
        moved = [one._replace(keyframe=one.keyframe.moved(by)) for one in self._drawn]
        self._drawn = deque(moved, KEYFRAMES)
        self._likely = None
        self._judge.begin(self.ordinal + 1)

    def doubt(self) -> None:
        """A doubt was dropped, or the robot goes on on new ground: all that was drawn before is old
        ground now (see `OldGround`), but not if there is a vote, as the last stretches may lie
        elsewhere."""
        if self.votes:
            self._judge.open = True
            return
        self._copies.append(self._copy())
        self._age(0)
        self._drawn.clear()
        self._ended = self._looked = self._path
        self.drift = self._likely = None
        self._judge.doubt()

    @property
    def open(self) -> bool:
        """See `OldGround`."""
        return self._judge.open

    @property
    def arriving(self) -> bool:
        """See `OldGround`."""
        return self._judge.arriving

    def settle(self) -> None:
        """The robot was found."""
        self._judge.open = False

    def forget(self) -> None:
        """The robot is elsewhere than it was believed to be: what it saw before tells nothing."""
        self._drawn.clear()
        self.drift = self._likely = None
        self._judge.begin(self.ordinal + 1)

    def _end(self) -> None:
        """Begin the next stretch."""
        self._ended, self.ordinal = self._path, self.ordinal + 1
        self._copies.append(self._copy())
        self._age(HELD if self.open else RECENT)

    def _age(self, recent: int) -> None:
        """All stretches but so many are old ground."""
        while len(self._copies) > recent:
            self._write(*self._copies.popleft())

    def _copy(self) -> tuple[np.ndarray, np.ndarray]:
        """The slots of the tiles that were drawn in this stretch, and their fields."""
        slots = np.flatnonzero(self._fresh.values)
        self._fresh.values[:] = False
        return slots, self._field.field().values[slots]

    def _write(self, slots: np.ndarray, values: np.ndarray) -> None:
        self._old.values[slots] = values
        self.endpoint.rewritten(blocks_of(self._field.tiles, slots))

    def _found_drift(self, scan: Scan) -> Pose2 | None:
        """The drift by the last stretch, if the old field does not explain the last scan."""
        before, self._likely = self._likely, None
        endpoint, frame = self.endpoint, self.frame
        unexplained = self.unexplained(scan)
        if unexplained is None or not self._misfits.surprising(unexplained):
            return None
        last = self._panorama(1)
        place = self._fitted(last, before)
        here, there = self.unexplained(last), self._unexplained_at(place.pose, last)
        gain = place.value - at(endpoint, last, frame).value
        misfits = here is None or here >= UNEXPLAINED
        if misfits and there is not None and not near(place.pose, frame, *MOVED):
            found = place.pose @ frame.inverse()
            if here is not None and there < FITTING and gain > GAIN:
                return found
            if there < HALF * (1.0 if here is None else here) and gain > LARGE_GAIN:
                self._likely = found
                same = before is not None and near(before @ frame, place.pose, *AGAIN)
                return found if same else None
        self._misfits.dismiss()
        return None

    def _fitted(self, last: Panorama, likely: Pose2 | None) -> Place:
        """Where the last stretch fits the old field, within DRIFT. Along a corridor another pose
        may fit as well as that by a likely drift, which is taken then."""
        endpoint, frame = self.endpoint, self.frame
        place = matched(endpoint, last, best_near(endpoint, last, frame, DRIFT))
        if likely is None:
            return place
        again = matched(endpoint, last, likely @ frame)
        return again if again.value > place.value - GAIN else place

    def _panorama(self, stretches: int) -> Panorama:
        """The keyframes of the last stretches as one scan at the frame."""
        begin = self._path - stretches * STRETCH
        last = [one.keyframe for one in self._drawn if one.path > begin]
        every = math.ceil(len(last) / (stretches * THINNED))
        return panorama([one.seen_from(self.frame) for one in last[::-every]])

    @property
    def frame(self) -> Pose2:
        """The pose of the last keyframe."""
        return self._drawn[-1].keyframe.pose

    # -- as a `Ground` -------------------------------------------------------------------------

    def unexplained(self, scan: Scan) -> float | None:
        """The share that the old field knows and does not explain."""
        return self._unexplained_at(self.frame, scan)

    def _unexplained_at(self, pose: Pose2, scan: Scan) -> float | None:
        return share(*self.endpoint.known_shares(scan.points, pose))

    def last(self, begin: int) -> Panorama:
        """The last keyframes; those from before the robot was found are forgotten."""
        return self._panorama(WINDOW)

    def old(self) -> Surroundings:
        """The old field, and the pose of the last keyframe in it."""
        return Surroundings(self.endpoint, self.frame)


@kernel
def _mark(blocks, index, fresh):
    """Mark the slots of the tiles that blocks (n, 2) lie in."""
    for k in range(len(blocks)):
        fresh[index[blocks[k, 0] // BLOCKS, blocks[k, 1] // BLOCKS]] = True
