import numpy as np
import pytest

from slam.benchmark.run import run
from slam.errors import InputError
from slam.registry import make
from slam.sessions.redrawing import map_model_of, redrawn
from slam.sessions.session import Session, session_of
from tests.slam.worlds import drive


@pytest.fixture(scope="module")
def session() -> Session:
    episode = drive(60, bias=0.02)
    return session_of(episode, run(make("static-ml"), episode).poses)


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph", "hmm-ml/beam", "hybrid-pf"])
def test_a_map_is_drawn_in_cells_of_any_size(session: Session, variant: str) -> None:
    areas = []
    for resolution in (0.02, 0.1):
        grid = redrawn(session, variant, resolution)
        assert grid.spec.resolution == resolution
        areas.append(grid.observed.sum() * resolution**2)
    assert areas[0] == pytest.approx(areas[1], rel=0.15)


def test_in_the_cells_of_the_slam_it_is_the_slams_own_map() -> None:
    episode = drive(60, bias=0.02)
    done = run(make("static-ml"), episode)
    again = redrawn(session_of(episode, done.poses), "static-ml", 0.05)
    assert again.spec == done.grid.spec
    assert (again.observed == done.grid.observed).mean() > 0.999
    assert ((again.occupied > 0.5) == (done.grid.occupied > 0.5)).mean() > 0.998


def test_parameters_of_the_variant_stay() -> None:
    assert map_model_of("clamped-ml", 0.02).limit == map_model_of("clamped-ml", 0.05).limit  # pyright: ignore[reportAttributeAccessIssue]
    assert np.isfinite(map_model_of("clamped-ml", 0.02).limit)  # pyright: ignore[reportAttributeAccessIssue]


def test_a_variant_without_a_map_is_refused(session: Session) -> None:
    with pytest.raises(InputError, match="'odometry' cannot be drawn"):
        redrawn(session, "odometry", 0.02)
