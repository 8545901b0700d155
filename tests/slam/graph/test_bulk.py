from collections.abc import Callable

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.graph.bulk import AT_ONCE, Bulk
from slam.interface import MapModel
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.static import NO_DOUBT, Static
from slam.scan import Scan
from tests.slam.worlds import scan_at

NUMBER = 150  # of scans: many cells are free without a doubt, some of which are occupied again


def keyframes(seed: int) -> list[tuple[Scan, Pose2]]:
    rng = np.random.default_rng(seed)
    x = 0.03 * np.maximum(np.arange(NUMBER) - 100, 0)  # at the end it drives: the map grows
    poses = [Pose2.of([x[k], 0.0, 0.0] + rng.normal(0.0, 0.02, 3)) for k in range(NUMBER)]
    near = Scan(np.full(8, 0.5), np.linspace(-0.1, 0.1, 8), 10.0)  # where all others saw farther
    return [(near if k % 40 == 39 else scan_at(pose), pose) for k, pose in enumerate(poses)]


@pytest.mark.parametrize("make", [Static, Clamped, Histogram])
@pytest.mark.parametrize("seed", range(3))
def test_it_draws_what_one_by_one_draws(make: Callable[[], MapModel], seed: int) -> None:
    alone, together = make(), make()
    bulk, changed = Bulk(together), []
    for k, (scan, pose) in enumerate(keyframes(seed)):
        changed.append(alone.integrate(scan, pose))
        bulk.integrate(scan, pose)
        if k in (AT_ONCE + 9, NUMBER - 1):
            np.testing.assert_array_equal(bulk.finish(), np.unique(np.concatenate(changed)))
            changed.clear()
            for layer in ("occupied", "observed"):
                expected = getattr(alone.cells, layer).values
                np.testing.assert_array_equal(getattr(together.cells, layer).values, expected)
    if make is Static:
        assert isinstance(alone, Static)
        assert (alone.log_odds.values < NO_DOUBT).sum() > 1000
    assert len(bulk.finish()) == 0
