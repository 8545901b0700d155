"""The scanner before lasers had effects: the worlds -v0 must measure as it did, to the byte."""

import numpy as np

from dynslam_env.sensors.raycast import look

SCANS_PER_DRAW = 32


class FormerScanner:
    """The laser without effects, as it was."""

    def __init__(self, laser, rng):
        self.laser, self._rng = laser, rng
        self.angles = laser.angles
        self._fan = np.stack([np.cos(self.angles), np.sin(self.angles)])
        self._settings = np.array([*laser.mount, laser.min_range, laser.max_range, laser.sigma])
        self._noise, self._lost, self._scans = np.empty((0, 0)), np.zeros((0, 0), dtype=bool), 0
        self.hits = np.empty(laser.beams, dtype=np.int32)

    def look(self, pose, segments, first_edge, ranges, observed):
        row = self._scans % SCANS_PER_DRAW
        if row == 0:
            shape = SCANS_PER_DRAW, self.laser.beams
            self._noise = self._rng.standard_normal(shape)
            if self.laser.dropout:
                self._lost = self._rng.random(shape) < self.laser.dropout
        self._scans += 1
        look(pose, self._settings, self._fan, segments, first_edge,
             row, self._noise, self._lost, ranges, observed, self.hits)  # fmt: skip
