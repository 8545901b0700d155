import json
from functools import partial

import slam
from slam.algorithms.graph_slam import GraphSlam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.configuration import configuration
from slam.maps.histogram import Histogram
from slam.maps.log_odds import Evidence
from slam.motion.gaussian import GaussianMotion
from slam.search.random_restart import RandomRestart
from slam.sensor_models.endpoint import Endpoint


def test_every_part_is_told_with_its_parameters() -> None:
    made = MaximumLikelihood(
        map_model=Histogram(evidence=Evidence(0.9, -0.5, 0.3), delta_t=2.5, bins=2),
        sensor_model=Endpoint(beta=0.35),
        motion_model=GaussianMotion(rotation_floor=0.01),
        search=RandomRestart(7),
    )
    found = configuration(made)
    assert found["type"] == "MaximumLikelihood"
    assert found["map_model"]["type"] == "Histogram"
    assert (found["map_model"]["delta_t"], found["map_model"]["bins"]) == (2.5, 2)
    assert found["map_model"]["evidence"] == {
        "type": "Evidence",         "hit": 0.9,
        "free": -0.5,
        "prior": 0.3,

    }  # fmt: skip
    assert found["search"]["restarts"] == 7
    assert found["search"]["climber"]["type"] == "HillClimb"
    assert found["sensor_model"]["beta"] == 0.35
    assert found["motion_model"]["type"] == "GaussianMotion"
    assert found["motion_model"]["rotation_floor"] == 0.01


def test_the_configuration_of_every_variant_is_json_and_tells_them_apart() -> None:
    found = [
        json.dumps(configuration(slam.make(name)), allow_nan=False)
        for name in ("odometry", "static-ml", "clamped-ml", "dynamic-ml", "static-ml/beta1")
    ]
    assert len(set(found)) == 5
    assert '"limit": "inf"' in found[1]


def test_what_makes_parts_is_told_as_what_it_makes() -> None:
    made = GraphSlam(
        map_model=partial(Histogram, bins=7), sensor_model=lambda: Endpoint(sigma=0.03)
    )
    found = configuration(made)
    assert (found["map_model"]["type"], found["map_model"]["bins"]) == ("Histogram", 7)
    assert (found["sensor_model"]["type"], found["sensor_model"]["sigma"]) == ("Endpoint", 0.03)
    assert found["loops"]["refine"] == configuration(made.loops.refine)
    assert found["loops"]["farthest"] == list(made.loops.farthest)
    assert configuration(Histogram)["type"] == "Histogram"


def test_what_needs_more_than_nothing_is_told_by_its_name() -> None:
    def wanting(more):
        raise AssertionError

    assert configuration(wanting).endswith("wanting")
    assert configuration(partial(wanting)) == "partial"


def test_the_configuration_of_what_revises_is_json_and_tells_them_apart() -> None:
    names = [name for name in slam.variants() if name.endswith(("-pf", "-graph"))]
    found = {name: configuration(slam.make(name)) for name in names}
    told = {json.dumps(one, allow_nan=False) for one in found.values()}
    assert len(told) == len(names)
    assert found["dynamic-graph"]["type"] == "GraphSlam"
    assert found["dynamic-graph"]["map_model"]["type"] == "Histogram"
    assert found["dynamic-graph"]["stretch"] == GraphSlam().stretch
    assert found["hmm-pf"]["type"] == "ParticleFilter"
    assert found["hmm-pf"]["particles"] == 30
    assert set(found["hmm-pf"]["keyframes"]) == {"type", "distance", "turn", "time"}
