"""The clocks of a recording: by how much the odometry's stamps are late against the laser's.

The turning of the laser from scan to scan, which `scan_rotation` finds without odometry, is
compared with that of the odometry at stamps moved by up to `MAX_OFFSET`. Where a robot starts to
turn, a wrong offset shows; where it drives straight or turns evenly, it does not.

One number can be identified: the stamp of the odometry that is of the same moment as the middle
of a sweep. Whether a stamp is of the sweep's beginning or of its end cannot be told apart from an
offset of one sweep, and neither can how sharp a corrected scan becomes, since only the motion
during the sweep corrects it, not its place in time. So of the two, that is chosen which leaves
the smaller offset between the clocks, and the beginning, as ROS has it, unless the end is better
by `SURE` standard errors.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from slam.episode import Episode
from slam.geometry import Array, Pose2
from slam.preprocessing.deskewing import MAX_SWEEP
from slam.preprocessing.scan_rotation import contour, rotation
from slam.scan import Scan
from slam.trajectory import Trajectory

MAX_OFFSET = 0.6  # s, either way; the estimate must lie within it
GRID_STEP = 0.01  # s between the offsets that are compared
RATE_SPAN = 0.05  # s, either side, over which a turning rate of the odometry is measured
SCAN_GAP = (0.08, 0.5)  # s from a scan to the next one that it is matched with
MAX_PAIRS = 1500  # of scans that are matched: those where the turning changes most
MIN_PAIRS = 30
MIN_CHANGE = 0.25  # of the turning within `MAX_OFFSET`, as a share of nearly the largest
SMOOTHING = 1.0  # standard deviation of the smoothing, in steps of the scans or the odometry
FIRST_SPREAD = math.radians(0.5)  # scale of the Cauchy loss, rad, until the residuals' is known
SPREADS = 1.5  # that scale in medians of the residuals
MIN_SPREAD = math.radians(0.05)  # of the residuals, rad; a smaller one is by chance
DAMPING = 1e-9  # by the trace of the normal matrix
REWEIGHTINGS = 6
BLOCK = 20  # pairs, one after another, whose errors may depend on each other
MIN_EXPLAINED = 0.5  # share of the laser's turning that the odometry explains
SURE = 3.0  # standard errors
MIN_OFFSET = 0.02  # s; a smaller offset is not worth a correction
SYSTEMATIC = 0.005  # s, added to the standard error: on simulated drives, more turns left as much
MAX_DEVIATION = 0.03  # s; a less sure estimate is none


class Clock(NamedTuple):
    """How stamps are corrected.

    offset  s by which the odometry's stamps are late against the laser's
    end     whether a scan's stamp is of the end of its sweep, rather than of its beginning
    """

    offset: float = 0.0
    end: bool = False


class ClockEstimate(NamedTuple):
    """What a recording tells about its clocks.

    middle     s, the odometry's stamp less the laser's, at the middle of a sweep; NaN: not known
    deviation  s, its standard error; NaN: not known
    sweep      s, the median duration of a sweep; 0 where the recording does not state it
    reason     why it could not be told; empty where it could
    """

    middle: float
    deviation: float
    sweep: float
    reason: str = ""

    @property
    def end(self) -> bool:
        """Whether stamps are taken to be of the end of a sweep."""
        return self.sweep > 0 and self.middle < -SURE * self.deviation

    @property
    def offset(self) -> float:
        """s by which the odometry's stamps are late; NaN: not known."""
        return self.middle + (0.5 if self.end else -0.5) * self.sweep

    @property
    def significant(self) -> bool:
        """Whether the offset is surely not zero, and worth a correction."""
        return abs(self.offset) > max(SURE * self.deviation, MIN_OFFSET)

    @property
    def clock(self) -> Clock:
        """The correction that is used: none of what is not significant."""
        return Clock(self.offset if self.significant else 0.0, self.end)


def with_clock(episode: Episode, clock: Clock) -> Episode:
    """The episode with the odometry's stamps moved to the laser's clock, and each scan's stamp at
    the beginning of its sweep.

    Where the moved odometry does not reach the first or the last scan, the robot is taken to
    have moved on as at that end of the odometry.
    """
    if clock == Clock():
        return episode
    stamp = "end" if clock.end else "begin"
    meta = {**episode.meta, "clock": {"offset_s": clock.offset, "stamp": stamp}}
    episode = dataclasses.replace(episode, meta=meta)
    if clock.end:
        episode = dataclasses.replace(
            episode, scans=tuple(_begun_before(scan) for scan in episode.scans)
        )
    if not (clock.offset and episode.has_odometry):
        return episode
    return dataclasses.replace(episode, odometry=_moved(episode.odometry, clock.offset))


def synchronised(episode: Episode) -> Episode:
    """The episode with the correction that its estimate tells to use."""
    return with_clock(episode, estimated_clock(episode).clock)


def estimated_clock(episode: Episode) -> ClockEstimate:
    """The estimate for a recording."""
    sweep = _sweep(episode.scans)
    if not episode.has_odometry:
        return ClockEstimate(math.nan, math.nan, sweep, "there is no odometry")
    pairs = _informative(episode, _pairs(episode.times))
    if len(pairs) < MIN_PAIRS:
        reason = f"the scans are more than {SCAN_GAP[1]:g} s apart, or too few"
        return ClockEstimate(math.nan, math.nan, sweep, reason)
    turned = _turned_by_laser(episode.scans, pairs)
    matched = np.isfinite(turned)
    if matched.sum() < MIN_PAIRS:
        return ClockEstimate(math.nan, math.nan, sweep, "the scans could not be matched")
    profile = Profile(episode.odometry, episode.times[pairs[matched]], turned[matched])
    return profile.estimate(sweep)


class Profile:
    """How well the turning of laser and odometry agree, by the offset.

    offsets  (m,) s
    costs    (m,) mean Cauchy loss
    """

    def __init__(self, odometry: Trajectory, stamps: Array, turned: Array):
        """stamps (n, 2) s and turned (n,) rad: of pairs of scans."""
        self._times, self._ways = odometry.times, _ways(odometry)
        self._stamps = stamps
        self._smooth = _smoothing(stamps.mean(axis=1), SMOOTHING * _longest_step(stamps, odometry))
        self._turned = turned
        self.offsets = np.linspace(-1, 1, round(2 * MAX_OFFSET / GRID_STEP) + 1) * MAX_OFFSET
        self._spread = FIRST_SPREAD
        for _ in range(2):
            self.costs = np.array([self._cost(offset) for offset in self.offsets])
            residuals = self._fit(self.offsets[int(np.argmin(self.costs))]).residuals
            self._spread = max(SPREADS * float(np.median(np.abs(residuals))), MIN_SPREAD)

    def estimate(self, sweep: float) -> ClockEstimate:
        """The offset of the smallest cost, unless it says too little."""
        best = int(np.argmin(self.costs))
        if not 0 < best < len(self.costs) - 1:
            return ClockEstimate(math.nan, math.nan, sweep, "no offset fits best")
        middle = float(self.offsets[best]) + GRID_STEP * _parabola(self.costs[best - 1 : best + 2])
        fit = self._fit(middle)
        if not self._explained(fit) > MIN_EXPLAINED:
            reason = "the odometry does not turn as the laser does"
            return ClockEstimate(math.nan, math.nan, sweep, reason)
        deviation = self._deviation(middle, fit)
        if not deviation < MAX_DEVIATION:
            return ClockEstimate(math.nan, deviation, sweep, "the robot turns too little")
        return ClockEstimate(middle, deviation, sweep)

    def _moved(self, offset: float) -> Array:
        """(n, 3) from scan to scan by the odometry: rad turned, m driven, s."""
        stamps = self._stamps + offset
        turned, driven = (
            np.diff(np.interp(stamps, self._times, way))[:, 0] for way in self._ways.T
        )
        return np.column_stack([turned, driven, np.diff(self._stamps)[:, 0]])

    def _cost(self, offset: float) -> float:
        return float(np.log1p((self._fit(offset).residuals / self._spread) ** 2).mean())

    def _fit(self, offset: float) -> _Fit:
        """The laser's turning as a multiple of the odometry's and a drift with way and time, by
        iteratively reweighted least squares."""
        turned, moved = self._smooth @ self._turned, self._smooth @ self._moved(offset)
        fit = _fitted(turned, moved, np.ones(len(moved)))
        for _ in range(REWEIGHTINGS):
            fit = _fitted(turned, moved, 1 / (1 + (fit.residuals / self._spread) ** 2))
        return fit

    def _explained(self, fit: _Fit) -> float:
        """Share of the laser's turning that the odometry's turning explains, beyond drift."""
        left = (fit.weights * fit.residuals**2).sum()
        without = fit.residuals + fit.factors[0] * fit.moved[:, 0]
        drift = fit.moved[:, 1:]
        weighted = drift.T * fit.weights
        squares = weighted @ drift + 1e-12 * np.eye(2)
        without = without - drift @ np.linalg.solve(squares, weighted @ without)
        return 1 - float(left / (fit.weights * without**2).sum()) if fit.factors[0] > 0 else 0.0

    def _deviation(self, offset: float, fit: _Fit) -> float:
        """s; of errors that are independent before the smoothing, each as large as its residual
        there (White's estimator), or dependent within blocks, whichever is larger."""
        later, earlier = (self._moved(offset + step) for step in (RATE_SPAN, -RATE_SPAN))
        slope = self._smooth @ ((later - earlier) @ fit.factors / (2 * RATE_SPAN))
        moved = self._moved(offset)
        slope -= fit.moved @ np.linalg.lstsq(fit.moved, slope)[0]  # what no factor can imitate
        weighted = fit.weights * slope
        curvature = weighted @ slope
        if not curvature > 0:
            return math.inf
        pulls = (self._smooth.T @ weighted) * (self._turned - moved @ fit.factors)
        blocks = np.add.reduceat(weighted * fit.residuals, np.arange(0, len(slope), BLOCK))
        scatter = math.sqrt(max((pulls**2).sum(), (blocks**2).sum())) / float(curvature)
        return math.hypot(scatter, SYSTEMATIC)


class _Fit(NamedTuple):
    """factors (3,) of `moved` (n, 3), residuals (n,) rad, weights (n,) of the Cauchy loss."""

    factors: Array
    moved: Array
    residuals: Array
    weights: Array


def _fitted(turned: Array, moved: Array, weights: Array) -> _Fit:
    squares = (moved.T * weights) @ moved
    squares += DAMPING * np.trace(squares) * np.eye(3)
    factors = np.linalg.solve(squares, moved.T @ (weights * turned))
    return _Fit(factors, moved, turned - moved @ factors, weights)


def _ways(odometry: Trajectory) -> Array:
    """(n, 2) rad turned and m driven up to each pose."""
    steps = np.diff(odometry.poses[:, :2], axis=0)
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    return np.column_stack([np.unwrap(odometry.poses[:, 2]), driven])


def _longest_step(stamps: Array, odometry: Trajectory) -> float:
    """s, the usual step of the scans or that of the odometry, whichever is longer."""
    steps = np.diff(odometry.times)
    return max(float(np.median(np.diff(stamps))), float(np.median(steps)) if len(steps) else 0.0)


def _smoothing(times: Array, width: float) -> csr_array:
    """(n, n) weighted mean of neighbours in time, with Gaussian weights of standard deviation
    `width` (s).

    Odometry between two of its poses is less noisy than at one, since it is interpolated; offsets
    halfway between poses would fit better than the true one. Smoothing, of laser and odometry
    alike, takes away the frequencies at which they differ.
    """
    first, end = (np.searchsorted(times, times + reach) for reach in (-3 * width, 3 * width))
    rows = np.repeat(np.arange(len(times)), end - first)
    columns = np.concatenate([np.arange(a, b) for a, b in zip(first, end, strict=True)])
    weights = np.exp(-0.5 * ((times[rows] - times[columns]) / width) ** 2)
    weights /= np.bincount(rows, weights)[rows]
    return csr_array((weights, (rows, columns)), shape=(len(times), len(times)))


def _pairs(times: Array) -> np.ndarray:
    """(n, 2) indices of scans that follow each other within `SCAN_GAP`."""
    found, i = [], 0
    while i < len(times) - 1:
        j = int(np.searchsorted(times, times[i] + SCAN_GAP[0]))
        j = max(j, i + 1)
        if j < len(times) and times[j] - times[i] <= SCAN_GAP[1]:
            found.append((i, j))
        i = j
    return np.array(found, dtype=np.intp).reshape(-1, 2)


def _informative(episode: Episode, pairs: np.ndarray) -> np.ndarray:
    """Those of the pairs, `MAX_PAIRS` at most, around which the odometry's turning rate changes
    most; without them, the many pairs of a straight drive would determine the loss."""
    if not len(pairs):
        return pairs
    odometry = episode.odometry
    heading = np.unwrap(odometry.poses[:, 2])
    around = np.linspace(-MAX_OFFSET, MAX_OFFSET, 13)
    stamps = episode.times[pairs][:, :, None] + around
    turned = np.diff(np.interp(stamps, odometry.times, heading), axis=1)[:, 0]
    change = np.ptp(turned, axis=1)
    enough = change >= MIN_CHANGE * np.quantile(change, 0.98)
    order = np.argsort(-change, kind="stable")[: min(MAX_PAIRS, int(enough.sum()))]
    return pairs[np.sort(order)]


def _turned_by_laser(scans: Sequence[Scan], pairs: np.ndarray) -> Array:
    """(n,) rad; NaN where two scans do not match."""
    at = lru_cache(maxsize=2)(lambda k: contour(scans[k]))
    return np.array([rotation(at(i), at(j)) for i, j in pairs.tolist()])


def _parabola(costs: Array) -> float:
    """Where, in grid steps from the middle of three costs, a parabola through them is lowest."""
    before, least, after = costs.tolist()
    bend = before - 2 * least + after
    return 0.5 * (before - after) / bend if bend > 0 else 0.0


def _duration(scan: Scan) -> float:
    """s from the first beam to the last; 0 where it is not stated or wrong."""
    sweep = scan.beam_time * len(scan.ranges)
    return sweep if 0 < sweep <= MAX_SWEEP else 0.0


def _sweep(scans: Sequence[Scan]) -> float:
    return float(np.median([_duration(scan) for scan in scans]))


def _begun_before(scan: Scan) -> Scan:
    return dataclasses.replace(scan, time=scan.time - _duration(scan))


def _moved(odometry: Trajectory, offset: float) -> Trajectory:
    """Stamps earlier by `offset`, and a pose more at the end that would be missing."""
    times = odometry.times - offset
    if len(times) < 2:
        return Trajectory(times, odometry.poses)
    first, last = (odometry.at(np.array([t]))[0] for t in odometry.times[[0, -1]])
    near = odometry.at(odometry.times[[0, -1]] + abs(offset) * np.array([1, -1]))
    first, last, after, before = (Pose2.of(row) for row in (first, last, *near))
    if offset > 0:
        pose, at = last @ before.between(last), len(times)
        return _with(times, odometry.poses, at, times[-1] + offset, pose)
    pose = first @ after.between(first)
    return _with(times, odometry.poses, 0, times[0] + offset, pose)


def _with(times: Array, poses: Array, at: int, time: float, pose: Pose2) -> Trajectory:
    return Trajectory(np.insert(times, at, time), np.insert(poses, at, pose, axis=0))
