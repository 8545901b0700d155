"""Which values of a parameter a constructor accepts, found by trying."""

from __future__ import annotations

import inspect
import itertools
import math
from typing import Any

from slam.errors import InputError

TRIED = (-math.inf, -1e6, -1.0, 0.0, 1e-9, 0.5, 1.0, 1.5, 2.0, 2.5, 1e6, math.inf)
EXAMPLES = {  # of parameters that must be given
    "distance": 0.1, "turn": 0.1, "time": 1.0, "path": 1.0, "contradicted": 0.2,
}  # fmt: skip


def accepted(part: Any, name: str, default: Any) -> str:
    """The range of a numeric parameter of a class, in words; empty for any other parameter."""
    if default is inspect.Parameter.empty:
        default = EXAMPLES.get(name)
    if isinstance(default, bool):
        return "true, false"
    makes_a_part = inspect.isclass(part) or part.__name__[0].isupper()
    if not isinstance(default, int | float) or not makes_a_part:
        return ""
    whole = isinstance(default, int)
    values = (-1, 0, 1, 2, 3, 1_000) if whole else TRIED
    good = [value for value in values if _accepts(part, name, value)]
    return _whole(good) if whole else _real(good)


def _accepts(part: Any, name: str, value: float) -> bool:
    needed = {
        one.name: EXAMPLES.get(one.name, False)
        for one in inspect.signature(part).parameters.values()
        if one.default is inspect.Parameter.empty
    }
    try:
        part(**{**needed, name: value})
    except InputError:
        return False
    return True


def _whole(good: list[float]) -> str:
    return f"whole, >= {good[0]}" if good and good[0] >= 0 else "whole"


def _real(good: list[float]) -> str:
    """The interval of the values that were accepted; its ends are 0, 1 or 2."""
    runs = [list(run) for fits, run in itertools.groupby(TRIED, good.__contains__) if fits]
    if len(runs) != 1:
        return ""
    low, high = runs[0][0], runs[0][-1]
    words = []
    below = {-math.inf: "", -1e6: "", 0.0: ">= 0", 1e-9: "> 0", 1.0: ">= 1", 1.5: "> 1"}
    above = {math.inf: "", 1e6: "finite", 0.0: "<= 0", -1.0: "< 0", 0.5: "< 1", 1.0: "<= 1",
             1.5: "< 2", 2.0: "<= 2"}  # fmt: skip
    words = [below.get(low, f">= {low:g}"), above.get(high, f"<= {high:g}")]
    text = ", ".join(word for word in words if word)
    return f"{text}, or infinity" if high == math.inf and low > -math.inf else text or "any"
