"""Effects of real lasers, which a `Laser` takes: mixed pixels, lost echoes, glass, noise, sweep.

Each is an object with parameters of a data sheet or a paper. None is on by default.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from slam.errors import InputError
from slam.validation import instance, positive, whole, within

MAX_AGE = 0.1  # s, a control step: the oldest beam of a scan is not older than the step
MIN_SCAN_RATE = 10.0  # rad/s, of the beam: a slower sweep is not modelled


@dataclass(frozen=True)
class RangeNoise:
    """Range noise that grows with the range r: `Laser.sigma` + linear r + quadratic r^2.

    linear     m per m: a share of the range, as data sheets of triangulating lasers state it
    quadratic  m per m^2: a constant error of the spot on the detector of a triangulating laser

    Source: for a triangulating laser r = f b / x, so an error of the spot's place x grows with r^2
    (Konolige et al. 2008, A low-cost laser distance sensor, ICRA).
    """

    linear: float = 0.0
    quadratic: float = 0.0

    def __post_init__(self) -> None:
        within(self, "linear", 0.0, 1.0)
        within(self, "quadratic", 0.0, 1.0)


@dataclass(frozen=True)
class Quantisation:
    """Ranges are rounded to whole multiples of `step`, m.

    Source: a SICK LMS200 reports centimetres where it measures to 80 m, and millimetres where it
    measures to 8 m (technical description).
    """

    step: float = 0.01

    def __post_init__(self) -> None:
        positive(self, "step")


@dataclass(frozen=True)
class MixedPixels:
    """A beam of finite width that hits two surfaces gives a range between them.

    The light of a beam is spread evenly over `rays` rays. The nearest surface and all that lie at
    most `merging` behind it make one echo, whose range is the mean over their rays; what is farther
    is an echo of its own, which comes too late to be reported.

    width    rad, full angle of the beam
    merging  m, distance up to which two echoes merge: half the length of the pulse, or more where
             the receiver is slow
    rays     number of rays, odd

    Source: Ye, Borenstein (2002), Characterization of a 2-D laser scanner for mobile robot obstacle
    negotiation, ICRA: mixed pixels of a SICK LMS200. Default of `width`: its beam widens by 0.25
    degrees (technical description). That of `merging` is chosen such that recordings of one have as
    many mixed pixels by the jump of the range (docs/sensors.md).
    """

    width: float = 0.0044
    merging: float = 1.5
    rays: int = 5

    def __post_init__(self) -> None:
        positive(self, "width", "merging")
        within(self, "width", 0.0, 0.2)
        whole(self, "rays", 3)
        if self.rays % 2 == 0:
            raise InputError(f"MixedPixels.rays must be odd, got {self.rays}")


@dataclass(frozen=True)
class EchoLoss:
    """Weak echoes are lost: the beam reports no echo.

    The power of an echo relative to the weakest that is heard is q = (reach / range)^2
    * reflectivity * cos(incidence), the range equation of a surface that scatters evenly. The echo
    is lost with probability 1 / (1 + q^sharpness), and in any case with `share`.

    reach         m, from which every second echo of a white surface (1.0) at a right angle is lost
    reflectivity  share of the light that ordinary surfaces (walls, leaves, people) give back
    sharpness     how sudden the loss is: at twice the range of an even chance, q is 1/4
    share         probability that an echo is lost in spite of its power

    Source: Jelalian (1992), Laser radar systems, for the range equation. The form of the transition
    and `sharpness` are ours. Default of `reach`: a SICK LMS200 reaches 10 m on a surface of 10 %
    (technical description), and 10 m / sqrt(0.1) = 32 m.
    """

    reach: float = 32.0
    reflectivity: float = 0.7
    sharpness: float = 4.0
    share: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "reach", "reflectivity", "sharpness")
        within(self, "share", 0.0, 1.0)
        within(self, "reflectivity", 0.0, 1.0)


@dataclass(frozen=True)
class Surfaces:
    """Parts of the walls are of glass, others are dark; which ones is drawn in every episode.

    Walls are divided into panels, at most `panel` wide; both faces of a wall are alike. A beam that
    meets glass at an incidence of up to `visible` is reflected by it; any other passes, and what is
    behind is seen, or nothing. The light that passes is weakened, which matters with `EchoLoss`.
    Dark panels need `EchoLoss`.

    glass         share of the panels; or the indices of the walls of the layout that are of glass
    dark          share of the panels; or the indices of the walls of the layout that are dark
    panel         m, largest width of a panel
    visible       rad, largest incidence at which glass is seen
    transmission  share of the light that passes a pane on the way there and back
    reflectivity  of dark panels

    Source: Foster, Sun, Park, Kuipers (2013), VisAGGE: visible angle grid for glass environments,
    ICRA: a laser sees glass within some degrees of the right angle only; the default of `visible`
    is of that order. Black foam rubber reflects 2.4 % (SICK, operating instructions LMS5xx, 3.6.4).
    """

    glass: float | tuple[int, ...] = 0.0
    dark: float | tuple[int, ...] = 0.0
    panel: float = 1.0
    visible: float = math.radians(5.0)
    transmission: float = 0.7
    reflectivity: float = 0.024

    def __post_init__(self) -> None:
        for name in ("glass", "dark"):
            if isinstance(getattr(self, name), tuple):
                _indices(f"Surfaces.{name}", getattr(self, name))
            else:
                within(self, name, 0.0, 1.0)
        positive(self, "panel", "transmission", "reflectivity")
        within(self, "visible", 0.0, math.pi / 2)
        within(self, "transmission", 0.0, 1.0)
        within(self, "reflectivity", 0.0, 1.0)
        shares = [share for share in (self.glass, self.dark) if not isinstance(share, tuple)]
        if sum(shares) > 1.0:
            raise InputError(f"Surfaces.glass and dark are at most 1 together, got {sum(shares):g}")


@dataclass(frozen=True)
class Sweep:
    """The beams are measured one after the other, while the robot moves: the scan is distorted.

    The last beam is measured at the end of the control step. Within a step the robot's pose and
    all leaves and people are interpolated linearly. The scan is not corrected, and `Scan.beam_time`
    stays 0. In a recording, the true pose of a scan is that of its middle beam.

    duration  s, from the first beam to the last; at most 0.1
    """

    duration: float = 0.02

    def __post_init__(self) -> None:
        positive(self, "duration")
        within(self, "duration", 0.0, MAX_AGE)


@dataclass(frozen=True)
class Latency:
    """The laser is late against the odometry: the scan of a step was measured `delay` s before.

    In a recording, the true pose of a scan is that at which it was measured, as with `Lag`.

    delay  s; with the duration of the sweep at most 0.1. For more see the fault `Lag`

    Source: Ye, Borenstein (2002): a SICK LMS200 transfers a scan in 13 ms at 500 kBaud.
    """

    delay: float = 0.05

    def __post_init__(self) -> None:
        positive(self, "delay")
        within(self, "delay", 0.0, MAX_AGE)


Effect = RangeNoise | Quantisation | MixedPixels | EchoLoss | Surfaces | Sweep | Latency
Kind = TypeVar("Kind", RangeNoise, Quantisation, MixedPixels, EchoLoss, Surfaces, Sweep, Latency)
KINDS = (RangeNoise, Quantisation, MixedPixels, EchoLoss, Surfaces, Sweep, Latency)
ALLOWED = ", ".join(kind.__name__ for kind in KINDS)


def check_effects(effects: object, field_of_view: float) -> tuple[Effect, ...]:
    """`effects` as a tuple; raises InputError unless each is an effect, of a kind once."""
    if not isinstance(effects, tuple | list):
        raise InputError(f"Laser.effects must be a tuple of effects ({ALLOWED}), got {effects!r}")
    for effect in effects:
        instance("an effect of Laser.effects", effect, KINDS, f"one of {ALLOWED}")  # type: ignore[arg-type]
    names = [type(effect).__name__ for effect in effects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"Laser.effects holds each kind of effect once, got two {name}")
    _check_together(effects, field_of_view)
    return tuple(effects)


def effect_of(effects: Sequence[Effect], kind: type[Kind]) -> Kind | None:
    """The effect of this kind, if there is one."""
    return next((effect for effect in effects if isinstance(effect, kind)), None)


def _check_together(effects: Sequence[Effect], field_of_view: float) -> None:
    sweep, latency = effect_of(effects, Sweep), effect_of(effects, Latency)
    if sweep and field_of_view / sweep.duration < MIN_SCAN_RATE:
        raise InputError(
            f"a beam that turns by less than {MIN_SCAN_RATE:g} rad/s is not modelled, got "
            f"{field_of_view:g} rad in Sweep.duration {sweep.duration:g} s"
        )
    if sweep and latency and sweep.duration + latency.delay > MAX_AGE:
        raise InputError(
            f"Sweep.duration and Latency.delay are at most {MAX_AGE:g} s together, got "
            f"{sweep.duration:g} and {latency.delay:g}"
        )
    surfaces = effect_of(effects, Surfaces)
    if surfaces and surfaces.dark and not effect_of(effects, EchoLoss):
        raise InputError("dark Surfaces weaken echoes: they need an EchoLoss in Laser.effects")


def _indices(name: str, values: tuple[int, ...]) -> None:
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise InputError(f"{name} holds indices of walls, got {value!r}")
