"""`python -m docs.making.parameters`: writes docs/parameters.md, all parameters of all parts.

What a parameter does, and its unit, is what the docstring of its class says; its default is that of
the constructor; its range is found by calling the constructor with many values. The page is kept
in the repository, to be readable on a code host; a test compares the two.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from dataclasses import MISSING, astuple, fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from docs.making.accepted_values import accepted
from docs.making.docstring_rows import rows
from docs.making.option_table import option_table
from slam.geometry import Pose2
from slam.motion.threshold import MotionThreshold

PAGE = Path(__file__).parents[1] / "parameters.md"
HEAD = """\
<!-- Written by `make docs` from the classes' docstrings and constructors. Change those. -->

# Parameters

This page lists every parameter of `dynslam map` and of every part of a SLAM: unit, default, range
and effect. Options are set on the command line, or in a TOML file (`--config`); the parameters of
parts in Python, where a part is made ([Your own](your-own.md)). The range is what is accepted:
anything else raises `slam.InputError`. The defaults are the same for all recordings and all figures
on these pages; change one only for a reason that you can measure (`dynslam bench`).

"""
GROUPS: dict[str, tuple[str, ...]] = {
    "Maps": (
        "slam.maps.static.Static", "slam.maps.clamped.Clamped", "slam.maps.histogram.Histogram",
        "slam.maps.temporal.Temporal", "slam.maps.mean.Mean", "slam.maps.hybrid.Hybrid",
        "slam.maps.recency.Recency", "slam.maps.hmm.HMM", "slam.maps.filtered.Filtered",
        "slam.maps.log_odds.Evidence", "slam.maps.rays.Rays",
    ),
    "Sensor models": (
        "slam.sensor_models.endpoint.Endpoint", "slam.sensor_models.beam.Beam",
        "slam.sensor_models.literal.Literal",
    ),
    "Motion models": (
        "slam.motion.adaptive.AdaptiveOdometry", "slam.motion.gaussian.GaussianMotion",
        "slam.motion.learned.LearnedOdometry", "slam.motion.threshold.MotionThreshold",
    ),
    "Searches": (
        "slam.search.correlative.Correlative", "slam.search.gauss_newton.GaussNewton",
        "slam.search.hill_climb.HillClimb", "slam.search.random_restart.RandomRestart",
        "slam.search.registration.Registration", "slam.search.registration.EchoModel",
    ),
    "Algorithms": (
        "slam.algorithms.maximum_likelihood.MaximumLikelihood",
        "slam.algorithms.graph_slam.GraphSlam", "slam.graph.loops.Loops",
        "slam.graph.alignment.Alignment", "slam.graph.links.Links",
        "slam.algorithms.particle_filter.ParticleFilter",
        "slam.algorithms.dead_reckoning.DeadReckoning",
    ),
    "Lost robots": (
        "slam.recovery.watch.Watch", "slam.recovery.wide_search.WideSearch",
        "slam.recovery.demands.Demands", "slam.algorithms.second_start.SecondStart",
    ),
    "Recordings": (
        "slam.preprocessing.clock.Clock",
        "slam.preprocessing.laser_odometry.ConstantVelocity",
        "slam.preprocessing.laser_odometry.LaserOdometry",
    ),
    "Layers": ("slam.layers.layers.layers",),
}  # fmt: skip
INTERNAL = {  # what a SLAM makes for itself, by class: no parts that are chosen
    "slam.algorithms.ceilings.MappingOnly": "a ceiling, which is shown the truth",
    "slam.graph.edges.Edge": "an edge of a pose graph",
    "slam.graph.edges.Edges": "the edges of a pose graph",
    "slam.graph.global_search.GlobalSearch": "a map prepared for a search",
    "slam.graph.local_map.LocalMap": "a local map",
    "slam.graph.local_map.Panorama": "the echoes of a local map as one scan",
    "slam.graph.pose_graph.PoseGraph": "the graph that GraphSlam makes",
    "slam.graph.system.System": "a system of equations",
    "slam.graph.whole_map.WholeMap": "the global map that GraphSlam makes",
    "slam.maps.tiles.TileIndex": "the storage of a map",
    "slam.maps.true_map.TrueMap": "made of the truth",
    "slam.maps.windowed.Windowed": "the base of other maps",
    "slam.preprocessing.clock.ClockEstimate": "what a recording tells",
    "slam.recovery.astray.Astray": "the map of a robot that is lost",
    "slam.recovery.astray.Attempt": "what an attempt finds",
    "slam.recovery.match.Match": "a matched keyframe",
    "slam.recovery.places.Places": "a map prepared for a search",
    "slam.motion.systematic.Systematic": "what AdaptiveOdometry has learned",
    "slam.recovery.rivals.Suspect": "a place where a robot may be",
}
SHARED = {  # parameters that are parts themselves, or that all algorithms have
    "resolution": "m, side of a cell",
    "evidence": "log-odds of an observation: `Evidence`",
    "rays": "how far beams update the map: `Rays`",
    "start": "m, m, rad: pose of the robot before the first scan",
    "rng": "random generator, of parts that draw numbers; None: a seed of 0",
    "map_model": "the map: one of [Maps](#maps), or a function that makes it; None: `Static`",
    "local": "makes the local maps: one of [Maps](#maps)",
    "sensor_model": "how well a scan fits the map: one of [Sensor models](#sensor-models), or a "
                    "function that makes it; None: `Endpoint`",
    "motion_model": "how the odometry errs: one of [Motion models](#motion-models); None: "
                    "`AdaptiveOdometry`",
    "search": "how the best pose is found: one of [Searches](#searches); None: `Correlative`",
    "loops": "the search for loops: `Loops`; None: its defaults",
    "registration": "refines the pose on the surfaces of the map: `Registration`; None: nothing",
    "matches": "spacing of the scans that are matched: `MotionThreshold`",
    "keyframes": "spacing of the scans that are mapped: `MotionThreshold`",
    "watch": "tells whether the robot is lost: `Watch`; None: nobody does",
    "scans": "the scans",
    "poses": "(n, 3) m, m, rad: their poses",
    "limit": "nats, at which log-odds (prior included) are clamped on either side",
    "distance": "m from one event to the next",
    "turn": "rad from one event to the next",
    "time": "s from one event to the next",
}  # fmt: skip


class Parameter(NamedTuple):
    """A row of a table; texts, the default as Python has it, and what the constructor accepts."""

    name: str
    unit: str
    default: str
    accepted: str
    effect: str


def page() -> str:
    """The whole page."""
    parts = [HEAD, "## Options of `dynslam map`\n", option_table()]
    for group, names in GROUPS.items():
        parts.append(f"\n## {group}\n")
        for name in names:
            parts += [f"### {name.rpartition('.')[2]}\n", _head(found(name)), _table(name)]
    return "\n".join(parts)


def found(name: str) -> Any:
    """The class or function of a dotted name."""
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(module), attribute)


def parameters(name: str) -> Iterator[Parameter]:
    """The parameters of a part. Raises ValueError for one that nothing describes."""
    part = found(name)
    described = _described(part)
    for one in inspect.signature(part).parameters.values():
        text = described.get(one.name) or SHARED.get(one.name)
        if text is None:
            raise ValueError(f"{name}.{one.name}: neither its docstring nor SHARED describes it")
        unit, effect = _split(text)
        default = _made(part, one)
        words = _value(default)
        if unit == "rad" and isinstance(default, float):
            words += f" ({math.degrees(default):.3g} degrees)"
        yield Parameter(one.name, unit, words, accepted(part, one.name, one.default), effect)


def _made(part: Any, one: inspect.Parameter) -> Any:
    """The default of a parameter; what a field's factory makes."""
    factories = {field.name: field.default_factory for field in fields(part)} if is_dataclass(
        part) else {}  # fmt: skip
    factory = factories.get(one.name, MISSING)
    return one.default if factory is MISSING else factory()


def _described(part: Any) -> dict[str, str]:
    """What docstrings say of each parameter: those of the bases, the class, and its constructor."""
    texts = [inspect.getdoc(one) or "" for one in reversed(getattr(part, "__mro__", (part,)))]
    if isinstance(part, type):
        texts.append(inspect.getdoc(part.__init__) or "")
    return {name: text for doc in texts for name, text in rows(doc)}


UNITS = ("m and rad", "m, m, rad", "m/s^2 and rad/s^2", "nats", "rad", "m", "s", "echoes")


def _split(text: str) -> tuple[str, str]:
    """The unit with which a description begins, and the rest."""
    for unit in UNITS:
        for sign in (", ", ": ", "; ", " "):
            if text.startswith(unit + sign):
                return unit, text[len(unit + sign) :]
    return "", text


def _value(default: Any) -> str:
    if default is inspect.Parameter.empty:
        return "to be given"
    if inspect.isclass(default) or inspect.isroutine(default):
        return _linked(default.__name__)
    if isinstance(default, MotionThreshold | Pose2):
        values = astuple(default) if isinstance(default, MotionThreshold) else default
        return f"`{type(default).__name__}({_numbers(values)})`"
    if isinstance(default, tuple) and not hasattr(default, "_fields"):
        return f"`({_numbers(default)})`"
    if isinstance(default, float):
        return f"`{default:.6g}`"
    plain = default is None or isinstance(default, int | str)
    return f"`{default!r}`" if plain else _linked(type(default).__name__)


def _numbers(values: tuple[float, ...]) -> str:
    return ", ".join(
        f"({_numbers(value)})" if isinstance(value, tuple) else f"{value:.4g}" for value in values
    )


def _linked(name: str) -> str:
    """The name of a part, with a link to its table if it has one."""
    known = {full.rpartition(".")[2] for names in GROUPS.values() for full in names}
    return f"[`{name}`](#{name.lower()})" if name in known else f"`{name}`"


def _head(part: Any) -> str:
    """The first paragraph of the docstring."""
    text = inspect.getdoc(part) or ""
    return text.split("\n\n")[0].replace("\n", " ") + "\n"


def _table(name: str) -> str:
    lines = ["| parameter | unit | default | range | effect |", "|---|---|---|---|---|"]
    for one in parameters(name):
        cells = f"`{one.name}`", one.unit, one.default, one.accepted, one.effect
        lines.append("| " + " | ".join(text.replace("|", "\\|") for text in cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
