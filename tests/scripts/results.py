"""Results of a bench for whatever reads them: made-up ones, and the arguments of a small bench."""

from typing import Any

import numpy as np

Row = dict[str, Any]
SMALL = ("paper", "--seeds", "2", "--variants", "static-ml,odometry")
"""Arguments of the bench that the fixture `small_results` runs once for all tests."""


def row(
    variant: str, seed: int, ate: float | None, condition: dict | None = None, **more: Any
) -> Row:
    """One run; without an ATE it came to nothing."""
    condition = condition or {"doors": "moving"}
    told = {"error": "it broke", "failed": True} if ate is None else {"error": None}
    scores = {} if ate is None else {
        "ate": ate, "ate_online": ate, "failed": ate > 0.3, "f1_5cm": 1 - ate,
        "brier_share_door": ate, "ms_per_matched_scan": 100 * ate, "memory_mb": 10 * ate,
        "ate_bound": ate / 10, "error_curve": [ate, 2 * ate], "duration": 40.0,
        "calibration": {"cells": [100] * 10, "believed": [k / 10 for k in range(10)],
                        "occupied": [k / 10 for k in range(10)]},
    }  # fmt: skip
    return {
        "run": f"{seed}-{'-'.join(map(str, condition.values()))}-{variant}", "suite": "paper",
        "condition": list(condition), **condition, "variant": variant, "seed": seed,
        "episode": f"e{seed}-{condition}", "source": {}, "versions": {"python": "3"},
        "commit": "abc", "host": {"name": "h", "machine": "m", "cores": 2}, **told, **scores,
    }  # fmt: skip


def rows(seeds: int = 12, conditions: tuple[dict, ...] = ({"doors": "moving"},)) -> list[Row]:
    """`b` is 3 mm worse than `a` everywhere; `c` is `a` with noise."""
    rng = np.random.default_rng(0)
    found = []
    for condition in conditions:
        for seed in range(seeds):
            ate = rng.uniform(0.01, 0.02)
            found.append(row("a", seed, ate, condition))
            found.append(row("b", seed, ate + 0.003, condition))
            found.append(row("c", seed, ate + 0.001 * rng.standard_normal(), condition))
    return found
