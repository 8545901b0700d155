from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.io.carmen.reader import read_carmen
from slam.io.relations import read_relations
from slam.metrics.relations import score_relations
from slam.trajectory import Trajectory


def test_relations_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "a.relations"
    path.write_text("# t1 t2 ...\n1.5 2.25 1 2 9 9 9 0.5\n\n3 1 -1 0 0 0 0 -3\n")
    relations = read_relations(path)
    assert relations.first.tolist() == [1.5, 3]
    assert relations.second.tolist() == [2.25, 1]
    assert relations.displacement.tolist() == [[1, 2, 0.5], [-1, 0, -3]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no relation"),
        ("1 2 0 0 0 0 0 0\n1 2 0 0 0 0\n", r":2: expected 8 numbers `t1 t2 x y z roll pitch yaw`"),
        ("1 2 0 0 0 0 0 nan\n", ":1: expected 8"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.relations"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_relations(path)


@given(st.text(max_size=80))
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "a.relations"
    path.write_text(text, errors="replace")
    try:
        assert len(read_relations(path)) > 0
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017


def test_raw_odometry_of_the_intel_log_by_the_whole_path(shared_data: Path) -> None:
    episode = read_carmen(shared_data / "intel.log.gz").episode
    relations = read_relations(shared_data / "intel.relations")
    at_scans = Trajectory(episode.times, episode.odometry.at(episode.times))
    scores = score_relations(relations, at_scans, episode.odometry)
    found = np.array([scores.translation_mean, scores.translation_std, scores.rotation_mean_deg])
    assert found == pytest.approx([7.39, 14.34, 39.4], abs=0.05)
    assert (scores.relations, scores.left_out) == (2984, 0)
