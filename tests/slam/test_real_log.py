"""The first scans of a real building, against relations measured by hand."""

import gzip
from pathlib import Path

import pytest

import slam
from slam.algorithms.graph_slam import GraphSlam
from slam.benchmark.run import run
from slam.io.carmen.reader import read_carmen
from slam.io.relations import read_relations
from slam.metrics.relations import RelationScores, score_relations
from slam.trajectory import Trajectory

SCANS = 2000  # among them the first time that the odometry slips


@pytest.fixture(scope="module")
def intel(shared_data: Path, tmp_path_factory):
    """An episode of the log's first scans, and the relations."""
    path = tmp_path_factory.mktemp("intel") / "head.log"
    scans = 0
    with gzip.open(shared_data / "intel.log.gz", "rt") as log, path.open("w") as head:
        while scans < SCANS:
            line = log.readline()
            head.write(line)
            scans += line.startswith("FLASER")
    return read_carmen(path).episode, read_relations(shared_data / "intel.relations")


def scores(name: str, intel) -> RelationScores:
    episode, relations = intel
    poses = run(slam.make(name), episode).poses
    return score_relations(relations, Trajectory(episode.times, poses), episode.odometry)


def test_the_relations_tell_the_odometrys_errors(intel) -> None:
    raw = scores("odometry", intel)
    assert raw.relations > 200
    assert raw.translation_mean > 0.1
    assert raw.rotation_mean_deg > 2.0


@pytest.mark.parametrize("name", ["static-ml", "dynamic-ml"])
def test_maximum_likelihood_keeps_the_relations(name: str, intel) -> None:
    found = scores(name, intel)
    assert found.relations > 200
    assert found.translation_mean < 0.025
    assert found.rotation_mean_deg < 0.5


@pytest.mark.parametrize("skipped", [0, 3])
def test_the_graph_closes_the_loops_of_aces_wherever_it_begins(
    shared_data: Path, skipped: int
) -> None:
    """Scans lie 0.7 m apart: what was matched wrong on the way is chance, the loops must not be."""
    episode, _ = read_carmen(shared_data / "aces.log.gz")
    robot = GraphSlam()
    for displacement, scan in list(zip(episode.displacements(), episode.scans, strict=True))[
        skipped:
    ]:
        robot.update(displacement, scan)
    robot.finish()
    trusted = robot.graph.trust() > 0.5
    apart = [edge.second - edge.first for edge in robot.graph.edges if edge.loop]
    assert trusted.mean() > 0.95  # the robust kernel switches off the rest
    assert max(apart) > 12  # stretches: around the block, not there and back
