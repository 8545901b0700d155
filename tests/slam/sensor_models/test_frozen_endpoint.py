import numpy as np
import pytest

from slam.geometry import Pose2
from slam.maps.static import Static
from slam.sensor_models.endpoint import Endpoint, FrozenEndpoint
from tests.slam.sensor_models.rooms import around, mapped
from tests.slam.worlds import scan_at

HERE = Pose2(0.3, -0.2, 0.4)


@pytest.mark.parametrize("parameters", [{}, {"beta": 1.0, "sigma": 0.06, "z_hit": 0.7}])
def test_a_frozen_endpoint_equals_the_endpoint_when_it_was_frozen(parameters) -> None:
    grid, reading = mapped(Static(), Endpoint(**parameters))
    scan = scan_at(HERE)
    poses = np.asarray(np.array(HERE) + around(HERE, n=2), dtype=np.float64)
    values = reading.log_likelihood(scan, poses)
    slopes = [reading.slope(scan, HERE, level) for level in range(Endpoint.levels)]
    shares = reading.shares(scan.points, HERE)
    frozen = FrozenEndpoint(reading)
    mapped(grid, reading, walls=np.array([(0.0, -1.0, 0.0, 1.0)]))
    assert not np.array_equal(reading.log_likelihood(scan, poses), values)
    found = frozen.unpacked()
    np.testing.assert_array_equal(found.log_likelihood(scan, poses), values)
    assert found.shares(scan.points, HERE) == shares
    for level, slope in enumerate(slopes):
        for mine, its in zip(found.slope(scan, HERE, level), slope, strict=True):
            np.testing.assert_array_equal(mine, its)
    assert frozen.nbytes < 0.2 * found.tiles.nbytes
