"""`python -m docs.making.without_rule [VARIANT] [--rules NAME ...] [--drives N]`: what each rule
by which a lost robot is told is worth.

Drives development recordings with all rules, and then without one rule at a time: the faults of
`dynslam bench faults`, robots drawn at random, those of them that were carried, and robots carried
around a block. Prints a table like that of docs/lost-method.md; three to five minutes a rule, and
ten to record the drives. A rule that changes nothing here may be needed elsewhere: run the tests
without it, too.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from docs.making.any_robot import drawn
from docs.making.looks_alike import KINDS, Judged, judge
from scripts.bench.suites import faults
from slam.episode import Episode
from slam.geometry import Pose2
from slam.graph import loops
from slam.recovery import (
    astray,
    continuity,
    drawn_before,
    lost_belief,
    odometry_failure,
    rivals,
    signs,
    watch,
)

SUITE = range(350, 352)  # seeds, on which the rules were made
ANY = range(5000, 5056)
CARRIED = range(6000, 6300)
BLOCK = range(6320, 6328)
NEVER = 1e9  # a threshold that nothing exceeds


class Rule(NamedTuple):
    """What is replaced where, so that a rule is without effect."""

    where: Any
    name: str
    by: Any

    def off(self) -> Any:
        """Switches it off for a while."""
        return mock.patch.object(self.where, self.name, self.by)


def _nothing(result: Any = None) -> Callable[..., Any]:
    return lambda *_: result


def _found(_: Any, match: Any, *__: Any) -> Pose2:
    return match.estimate.pose


RULES: Mapping[str, Rule] = {
    "a match between keyframes that fits 16 nats worse": Rule(
        odometry_failure.OdometryFailure, "evident", _nothing(False)
    ),
    "a match far from the prediction": Rule(odometry_failure, "LARGE_ERROR", NEVER),
    "other surfaces than the scans before": Rule(odometry_failure, "FALL", NEVER),
    "a keyframe that fits worse than the one before": Rule(
        odometry_failure.OdometryFailure, "_suddenly", _nothing(False)
    ),
    "odometry that jumps, scans far apart": Rule(
        odometry_failure.OdometryFailure, "_farther", _found
    ),
    "the map stops contradicting": Rule(
        odometry_failure.OdometryFailure, "_relieved", _nothing(False)
    ),
    "the heading by the latest scan": Rule(
        continuity.Recent, "as_seen_last", lambda _, match: match.estimate.pose
    ),
    "a gap: the odometry is believed": Rule(odometry_failure.OdometryFailure, "_after_gap", _found),
    "only the map tells": Rule(signs, "TURNED", NEVER),
    "the map explains less at once": Rule(signs, "FADED", NEVER),
    "0.06 changed though the robot hardly moved": Rule(watch, "STARTLING", NEVER),
    "hardly agrees: waits": Rule(lost_belief.LostBelief, "hardly_agrees", _nothing(False)),
    "more than 0.4 changed, and the map shows little": Rule(watch, "TORN", NEVER),
    "scans that agree with no place": Rule(watch.Watch, "_strange", _nothing(False)),
    "a place within 1 m": Rule(rivals.Rivals, "_nearby", _nothing()),
    "the scans since then, together": Rule(rivals, "SINCE_GAIN", NEVER),
    "a doubt that is not dropped": Rule(watch, "WELL_KNOWN", NEVER),
    "16 checks where another place leads": Rule(watch, "MOST_CHECKS", watch.MAX_CHECKS),
    "a dropped doubt opens old ground": Rule(watch.Watch, "take_unsettled", _nothing(False)),
    "a scan of which the map shows nearly nothing": Rule(
        lost_belief, "HARDLY_EXPLAINED", (-1.0, NEVER)
    ),
    "old ground: elsewhere": Rule(drawn_before.OldGround, "judge", _nothing()),
    "old ground: a drift": Rule(drawn_before.DrawnBefore, "_found_drift", _nothing()),
    "a drift by two looks": Rule(drawn_before, "LARGE_GAIN", NEVER),
    "right, on new ground: 20 times": Rule(astray, "LONGER", astray.REPEATED),
    "nearly all explained": Rule(astray, "NEARLY_ALL", 0.0),
    "clearly better": Rule(astray, "CLEARLY_BETTER", -NEVER),
    "the map may have changed there": Rule(astray, "LASTING", NEVER),
    "off the end of the map, where it was found": Rule(astray, "SEEN", NEVER),
    "each scan followed: nearby": Rule(watch.Watch, "_reach", property(_nothing(math.inf))),
    "where a loop closes: 20 times": Rule(watch, "LONG_WAY", NEVER),
    "loops that other places fit nearly as well": Rule(
        loops, "_spread", _nothing(np.zeros((3, 3)))
    ),
}


class Drive(NamedTuple):
    """A recording, its group in the table, and whether the robot was carried."""

    group: str
    carried: bool
    episode: Episode


def drives() -> Iterator[Drive]:
    """All recordings."""
    for case in faults().cases:
        for seed in SUITE:
            yield Drive(
                "suite", case.condition["fault"] == "carried away", case.source(seed).make()
            )
    for seed in (*ANY, *CARRIED):
        robot = drawn(seed)
        if seed in ANY or robot.fault == "carried":
            yield Drive("drawn", robot.fault == "carried", robot.drive(seed))
    kind = KINDS["carried in the second lap"]
    for seed in BLOCK:
        yield Drive("block", True, kind.drive(seed))


def scored(variant: str, recorded: list[Drive]) -> list[tuple[str, Judged]]:
    """How a variant does, with the group of each drive."""
    return [(one.group, judge(variant, one.episode, one.carried)) for one in recorded]


def row(name: str, of: list[tuple[str, Judged]], all_rules: list[tuple[str, Judged]]) -> str:
    """Of the table: sure and wrong of each group, those that end far off and sure, false alarms,
    and in how many drives the scores differ."""
    shares = [
        f"{100.0 * np.mean([one.scores.sure_and_wrong for group, one in of if group == asked]):.2f}"
        for asked in dict.fromkeys(group for group, _ in of)
    ]
    sure = sum(one.sure for _, one in of)
    alarms = sum(one.scores.false_alarms for _, one in of)
    changed = sum(
        repr(one.scores) != repr(other.scores)
        for (_, one), (_, other) in zip(of, all_rules, strict=True)
    )
    return f"| {name} | {', '.join(shares)} | {sure} | {alarms} | {changed} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("variant", nargs="?", default="static-ml")
    parser.add_argument("--rules", nargs="+", choices=RULES, default=list(RULES), metavar="NAME")
    parser.add_argument("--drives", type=int, help="only so many")
    options = parser.parse_args()
    recorded = list(islice(drives(), options.drives))
    print(f"{len(recorded)} drives recorded", file=sys.stderr, flush=True)
    print("| without the rule | sure and wrong, %: suite, drawn, block | end off and sure "
          "| false alarms | drives that change |")  # fmt: skip
    print("|---|---|---|---|---|", flush=True)
    with_all = scored(options.variant, recorded)
    print(row("(all rules)", with_all, with_all), flush=True)
    for name in options.rules:
        with RULES[name].off():
            print(row(name, scored(options.variant, recorded), with_all), flush=True)


if __name__ == "__main__":
    main()
