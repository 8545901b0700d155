"""EffectScanner: measures scans with a laser that has effects; `scanner_of` chooses the scanner."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.sensors.effects import (
    MAX_AGE,
    EchoLoss,
    Latency,
    MixedPixels,
    Quantisation,
    RangeNoise,
    Surfaces,
    Sweep,
    effect_of,
)
from dynslam_env.sensors.footprint import (
    EchoPower,
    MovingScene,
    SweptFan,
    lose,
    merge,
    read,
    see_through,
    sweep,
)
from dynslam_env.sensors.laser import SCANS_PER_DRAW, Floats, Laser, Scanner
from dynslam_env.sensors.materials import DARK, GLASS, Panels, panels_of
from slam.geometry import Array

Flags = NDArray[np.bool_]
NO_LOSS = EchoLoss(reach=1e9)


def scanner_of(laser: Laser, rng: np.random.Generator) -> Scanner:
    """A scanner of this laser with its own stream of noise."""
    return EffectScanner(laser, rng) if laser.effects else Scanner(laser, rng)


class EffectScanner(Scanner):
    """A scanner with the effects of its laser.

    Its range noise is that of the same laser without effects; all other random numbers come from
    streams of their own. The walls must not change from scan to scan; the rest may move. `hits`
    counts the panels of the walls (see `Panels`), then the other segments.
    """

    def __init__(self, laser: Laser, rng: np.random.Generator):
        super().__init__(laser, rng)
        self._chance_rng, self._panel_rng = rng.spawn(2)
        self._swept, self._power = _fan(laser), _power(laser)
        middle = self._swept.begun + self._swept.per_beam * (laser.beams - 1) / 2
        self.age = MAX_AGE * (1.0 - middle)
        mixed = effect_of(laser.effects, MixedPixels)
        rays = mixed.rays if mixed else 1
        places = (np.arange(rays) + 0.5) / rays - 0.5
        self._offsets = (places * (mixed.width if mixed else 0.0)).tolist()
        self._middle = rays // 2
        noise = effect_of(laser.effects, RangeNoise) or RangeNoise()
        self._growth = np.array([noise.linear, noise.quadratic])
        rounded = effect_of(laser.effects, Quantisation)
        self._step = rounded.step if rounded else 0.0
        self.panels: Panels | None = None
        """The walls of the episode, divided into panels; None before the first scan."""
        self._pose: Array | None = None
        self._segments = np.empty((0, 4))
        self._chances = np.empty((0, 0))

    def carried(self) -> None:
        """The robot was put down elsewhere: a sweep does not begin where it was before."""
        self._pose = None

    def look(
        self, pose: Array, segments: Array, first_edge: int, ranges: Array, observed: Floats
    ) -> None:
        """See `Scanner.look`."""
        row = self.next_row()
        scene, opaque = self._scene(pose, segments, first_edge)
        through = self._merged(scene, opaque, ranges)
        if self._power.reach:
            dark = self._of(scene, DARK)
            lose(scene.segments, dark, self._directions(scene), self._power, self._chances[row],
                 self.hits, through, ranges)  # fmt: skip
        lost = self._lost[row] if len(self._lost) else np.zeros(0, dtype=np.bool_)
        read(self.settings, self._growth, self._step, self.noise[row], lost, ranges, observed)

    def _scene(self, pose: Array, segments: Array, first_edge: int) -> tuple[MovingScene, int]:
        """The world since the last scan, its walls divided into panels, and the number of panels
        that are not of glass."""
        if self.panels is None:
            surfaces = effect_of(self.laser.effects, Surfaces)
            self.panels = panels_of(segments[:first_edge], surfaces, self._panel_rng)
        panels = self.panels
        now = np.concatenate([panels.segments, segments[first_edge:]])
        here = np.array(pose[:3], dtype=np.float64)
        if self._pose is None or len(self._segments) != len(now):
            self._pose, self._segments = here, now
        first = len(panels.segments)
        scene = MovingScene(self._pose, here, self._segments, now, first)
        self._pose, self._segments = here, now
        return scene, panels.opaque

    def _merged(self, scene: MovingScene, opaque: int, ranges: Array) -> Flags:
        """Write the ranges without noise; (beams,) bool, whether an echo came through glass."""
        shape = len(self._offsets), self.laser.beams
        rays, hits = np.empty(shape), np.empty(shape, dtype=np.int32)
        passed = np.zeros(shape, dtype=np.bool_)
        for k, offset in enumerate(self._offsets):
            sweep(self._swept, scene, offset, self.laser.max_range, rays[k], hits[k])
            if opaque < scene.first_edge:
                passed[k] = self._through_glass(scene, opaque, offset, rays[k], hits[k])
        through = np.empty(self.laser.beams, dtype=np.bool_)
        merge(rays, hits, passed, self._power.merging, self._middle, ranges, self.hits, through)
        return through

    def _through_glass(
        self, scene: MovingScene, opaque: int, offset: float, ranges: Array, hits: NDArray[np.int32]
    ) -> Flags:
        """Let the rays pass through glass; (beams,) bool, which of them did."""
        panes = scene.first_edge - opaque
        behind, behind_hits = np.empty_like(ranges), np.empty_like(hits)
        kept = np.r_[:opaque, scene.first_edge : len(scene.segments)]
        rest = scene._replace(
            segments_before=scene.segments_before[kept],
            segments=scene.segments[kept],
            first_edge=opaque,
        )
        sweep(self._swept, rest, offset, self.laser.max_range, behind, behind_hits)
        behind_hits[behind_hits >= opaque] += panes
        directions = self._directions(scene) + offset
        return see_through(scene.segments, self._of(scene, GLASS), directions, self._power.visible,
                           ranges, hits, behind, behind_hits)  # fmt: skip

    def _directions(self, scene: MovingScene) -> Array:
        """(beams,) rad, of the beams in the world, each at its time."""
        shares = self._swept.begun + self._swept.per_beam * np.arange(self.laser.beams)
        heading = scene.pose_before[2] + shares * (scene.pose[2] - scene.pose_before[2])
        return heading + self.laser.mount.theta + self.angles

    def _of(self, scene: MovingScene, code: int) -> Flags:
        """(n,) bool, which segments are of a material."""
        assert self.panels is not None
        which = np.zeros(len(scene.segments), dtype=np.bool_)
        which[: scene.first_edge] = self.panels.codes == code
        return which

    def draw(self) -> None:
        """See `Scanner.draw`."""
        super().draw()
        if self._power.reach:
            self._chances = self._chance_rng.random((SCANS_PER_DRAW, self.laser.beams))


def _fan(laser: Laser) -> SweptFan:
    swept, late = effect_of(laser.effects, Sweep), effect_of(laser.effects, Latency)
    duration, delay = (swept.duration if swept else 0.0), (late.delay if late else 0.0)
    gaps = max(laser.beams - 1, 1)
    first = -laser.field_of_view / 2 if laser.beams > 1 else 0.0
    begun = 1.0 - (duration + delay) / MAX_AGE
    return SweptFan(
        laser.beams, first, laser.field_of_view / gaps, begun, duration / gaps / MAX_AGE,
        *map(float, laser.mount),
    )  # fmt: skip


def _power(laser: Laser) -> EchoPower:
    loss = effect_of(laser.effects, EchoLoss)
    surfaces = effect_of(laser.effects, Surfaces) or Surfaces()
    mixed = effect_of(laser.effects, MixedPixels) or MixedPixels()
    used = loss or NO_LOSS
    return EchoPower(
        used.reach if loss else 0.0, used.sharpness, used.share, used.reflectivity,
        surfaces.reflectivity, surfaces.transmission, math.cos(surfaces.visible), mixed.merging,
    )  # fmt: skip
