"""The tree of frames of a ROS recording, with transforms that may change over time."""

from __future__ import annotations

import math
from array import array
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from slam.bounds import MAX_COORDINATE, all_within
from slam.errors import InputError
from slam.geometry import Array
from slam.io.one_line import one_line

MAX_DEPTH = 100  # frames from the root; a robot has five to twenty
STATIC_TOLERANCE = 1e-6  # m and rad: a transform that changes less is constant


class TransformHistory(NamedTuple):
    """The pose of a frame in its parent over time.

    times         (n,) s, increasing
    translations  (n, 3) m
    rotations     n of them
    """

    times: Array
    translations: Array
    rotations: Rotation

    @property
    def constant(self) -> bool:
        """Whether it is the same at all times."""
        turned = (self.rotations[0].inv() * self.rotations).magnitude()
        shifted = np.abs(self.translations - self.translations[0])
        return bool(turned.max() < STATIC_TOLERANCE and shifted.max() < STATIC_TOLERANCE)

    def at(self, times: Array) -> tuple[Array, Rotation]:
        """Translations (m, 3) and m rotations at times (m,), interpolated, clamped at the ends."""
        if len(self.times) == 1:
            quaternion = np.repeat(self.rotations.as_quat(), len(times), axis=0)
            shift = np.repeat(self.translations, len(times), axis=0)
            return shift, Rotation.from_quat(quaternion)
        times = np.clip(times, self.times[0], self.times[-1])
        shifts = [np.interp(times, self.times, column) for column in self.translations.T]
        return np.column_stack(shifts), Slerp(self.times, self.rotations)(times)


class Transforms:
    """Frames by name, each with its pose in its parent, collected from /tf and /tf_static."""

    def __init__(self) -> None:
        self._rows: dict[str, array[float]] = {}
        self._edges: dict[str, TransformHistory] = {}
        self.parents: dict[str, str] = {}

    def add(self, parent: str, child: str, row: tuple[float, ...]) -> bool:
        """Add a row: time (s), translation (x, y, z) and quaternion (x, y, z, w).

        False for an invalid one: numbers that are not finite, no rotation, a frame that would
        become its own ancestor, or one too deep in the tree.
        """
        parent, child = plain(parent), plain(child)
        if not (math.isfinite(row[0]) and is_valid_transform(row[1:4], row[4:])):
            return False
        above = self.ancestors(parent)
        if child in above or len(above) > MAX_DEPTH:
            return False
        if self.parents.get(child, parent) != parent:
            self._rows[child] = array("d")  # the frame has a new parent: only this one counts
        self.parents[child] = parent
        self._rows.setdefault(child, array("d")).extend(row)
        self._edges.pop(child, None)
        return True

    def ancestors(self, frame: str) -> list[str]:
        """The frame itself, its parent, and so on up to the root."""
        chain = [plain(frame)]
        while chain[-1] in self.parents:
            chain.append(self.parents[chain[-1]])
        return chain

    def edge(self, child: str) -> TransformHistory:
        """The poses of `child` in its parent."""
        if child not in self._edges:
            rows = np.array(self._rows[child]).reshape(-1, 8)
            times, first = np.unique(rows[:, 0], return_index=True)
            self._edges[child] = TransformHistory(
                times, rows[first, 1:4], Rotation.from_quat(rows[first, 4:])
            )
        return self._edges[child]

    def connected(self, a: str, b: str) -> bool:
        """Whether both frames are in the same tree."""
        return self.ancestors(a)[-1] == self.ancestors(b)[-1]

    def path(self, parent: str, child: str) -> tuple[list[str], list[str]]:
        """The frames whose edges lead from their last common ancestor down to `parent`, and to
        `child`. Raises InputError if they are not connected."""
        up, down = self.ancestors(parent), self.ancestors(child)
        if up[-1] != down[-1]:
            raise InputError(f"no transform leads from frame {parent!r} to {child!r}")
        while up and down and up[-1] == down[-1]:
            up.pop()
            down.pop()
        return up, down

    def times(self, parent: str, child: str) -> Array:
        """All times of the transforms between two frames that change; empty if all are constant."""
        edges = [self.edge(name) for part in self.path(parent, child) for name in part]
        moving = [edge.times for edge in edges if not edge.constant]
        return np.unique(np.concatenate(moving)) if moving else np.empty(0)

    def at(self, parent: str, child: str, times: Array) -> tuple[Array, Rotation]:
        """The pose of `child` in `parent` at times (n,): translations (n, 3), n rotations."""
        up, down = self.path(parent, child)
        shift, turn = self._down(down, times)
        other_shift, other_turn = self._down(up, times)
        back = other_turn.inv()
        return back.apply(shift - other_shift), back * turn

    def _down(self, names: list[str], times: Array) -> tuple[Array, Rotation]:
        shift, turn = np.zeros((len(times), 3)), Rotation.identity(len(times))
        for name in reversed(names):
            step, rotation = self.edge(name).at(times)
            shift, turn = shift + turn.apply(step), turn * rotation
        return shift, turn


def is_valid_transform(translation: tuple[float, ...], turn: tuple[float, ...]) -> bool:
    """Whether translation (m) and quaternion can be a pose; an unset quaternion is zero."""
    return all_within(translation, MAX_COORDINATE) and 0.5 < math.hypot(*turn) < 2.0


def plain(frame: str) -> str:
    """A frame's name without the slash that old recordings put before it."""
    return one_line(frame.lstrip("/"), 100) if frame else ""


def seen_from_above(shift: Array, turn: Rotation) -> Array:
    """(n, 3) poses in the plane: x, y in m and the heading of the x axis in rad."""
    ahead = turn.apply([1.0, 0.0, 0.0])
    return np.column_stack([shift[:, :2], np.arctan2(ahead[:, 1], ahead[:, 0])])
