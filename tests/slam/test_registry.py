import numpy as np
import pytest

import slam
from slam import registry
from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.errors import InputError
from slam.geometry import Pose2
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.maps.temporal import Temporal
from slam.sensor_models.endpoint import Endpoint
from tests.slam.worlds import drive


@pytest.fixture
def own_names(monkeypatch):
    """What a test registers is gone after it."""
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))


def test_the_known_variants_differ_by_what_they_name() -> None:
    assert isinstance(slam.make("odometry"), DeadReckoning)
    grids = {"static-ml": Static, "clamped-ml": Static, "dynamic-ml": Histogram}
    for name, grid in grids.items():
        tempered, paper = slam.make(name), slam.make(f"{name}/beta1")
        for made in (tempered, paper):
            assert isinstance(made, MaximumLikelihood)
            assert isinstance(made.map_model, grid)
        betas = tempered.sensor_model.beta, paper.sensor_model.beta  # pyright: ignore
        assert betas == (Endpoint().beta, 1.0)
    assert slam.make("static-ml").map_model.limit == np.inf  # pyright: ignore
    assert slam.make("clamped-ml").map_model.limit == 2.0  # pyright: ignore


def test_each_one_made_is_new_and_begins_at_the_start() -> None:
    a, b = slam.make("static-ml", Pose2(1, 2, 3)), slam.make("static-ml")
    assert a.pose == Pose2(1, 2, 3)
    assert b.pose == Pose2()
    assert a.map_model is not b.map_model  # pyright: ignore


def test_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(InputError) as refused:
        slam.make("dynamik-ml")
    message = str(refused.value)
    assert message.startswith("unknown SLAM variant 'dynamik-ml'; did you mean dynamic-ml, ")
    assert message.endswith(f"? (all {len(slam.variants())}: slam.variants())")
    assert "odometry" not in message


def test_a_variant_of_ones_own_is_made_by_name(own_names) -> None:
    class Own:
        def __init__(self, start, rng):
            self.pose, self.drawn = start, rng.random()

    slam.register("own", Own)  # pyright: ignore
    assert slam.variants()[-1] == "own"
    one, same, other = (slam.make("own", Pose2(1.0), seed) for seed in (4, 4, 5))
    assert isinstance(one, Own)
    assert one.pose == Pose2(1.0)
    assert one.drawn == same.drawn != other.drawn  # pyright: ignore


@pytest.mark.parametrize("name", ["", "my slam", "a,b", "tab\t", "line\n"])
def test_names_that_a_command_could_not_hold_are_refused(own_names, name: str) -> None:
    with pytest.raises(InputError, match="no spaces or commas"):
        slam.register(name, lambda start, rng: DeadReckoning(start))
    assert name not in slam.variants()


def test_the_name_of_a_built_in_variant_is_taken(own_names) -> None:
    with pytest.raises(InputError, match="'static-ml' is one of dynslam's own"):
        slam.register("static-ml", lambda start, rng: DeadReckoning(start))
    assert isinstance(slam.make("static-ml"), MaximumLikelihood)


def test_a_map_model_of_ones_own_brings_its_variants(own_names) -> None:
    """Built as dynslam's own are: the same map under another name gives the same run."""
    before = slam.variants()
    slam.register_map("mine", Static)
    assert slam.variants() == before + [
        "mine-ml", "mine-ml/beta1", "mine-ml/beam", "mine-ml/literal", "mine-pf", "mine-graph"
    ]  # fmt: skip
    episode = drive(30)
    for kind in ("ml", "ml/beta1", "pf", "graph"):
        own, static = (
            slam.run(slam.build(f"{name}-{kind}", episode, 3), episode)
            for name in ("mine", "static")
        )
        np.testing.assert_array_equal(own.poses, static.poses)
        np.testing.assert_array_equal(own.grid.occupied, static.grid.occupied)


def test_a_map_that_particles_cannot_share_has_no_particle_filter(own_names) -> None:
    slam.register_map("mine", Temporal, particle_filter=False)
    assert "mine-graph" in slam.variants()
    assert "mine-pf" not in slam.variants()
    assert "temporal-pf" not in slam.variants()


def test_a_map_model_is_refused_with_what_is_wrong(own_names) -> None:
    with pytest.raises(InputError, match="'static-ml' is one of dynslam's own"):
        slam.register_map("static", Static)
    with pytest.raises(InputError, match="map model 'mine' must be a function or a class"):
        slam.register_map("mine", Static())  # pyright: ignore
    with pytest.raises(InputError, match="no spaces or commas"):
        slam.register_map("my map", Static)
    with pytest.raises(
        InputError, match="the builder of 'mine' must be a function or a class, got 3"
    ):
        slam.register("mine", 3)  # pyright: ignore
    assert not any("mine" in name for name in slam.variants())
