import numpy as np
import pytest

from dynslam_env.reset_options import episode_options, reset_mask
from slam import InputError, Pose2


@pytest.mark.parametrize("options", [None, {}, {"start": None}])
def test_nothing_said_no_start(options):
    assert episode_options(options).start is None


@pytest.mark.parametrize(
    "start", [(1, 2, 0.5), [1.0, 2.0, 0.5], np.array([1, 2, 0.5]), Pose2(1, 2, 0.5)]
)
def test_a_start_is_three_numbers_in_any_form(start):
    pose = episode_options({"start": start}).start
    assert pose is not None
    assert pose == Pose2(1.0, 2.0, 0.5)
    assert all(type(value) is float for value in pose)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"begin": (1, 2, 3)}, "an option of reset must be one of 'start', 'split'"),
        ({"start": (1, 2)}, r"options\['start'\] must be three numbers x, y in m, theta in rad"),
        ({"start": 3.0}, r"options\['start'\] must be three numbers"),
        ({"start": (1, 2, np.nan)}, r"options\['start'\] must hold finite numbers only"),
        ({"start": ("a", "b", "c")}, r"options\['start'\] must hold finite numbers only"),
        ({"start": [[1, 2, 3]]}, r"options\['start'\] must be three numbers"),
    ],
)
def test_anything_else_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        episode_options(options)


def test_all_worlds_are_reset_unless_a_mask_says_otherwise():
    mask, others = reset_mask(None, 3)
    assert mask.tolist() == [True] * 3
    assert others == {}
    options = {"reset_mask": np.array([False, True, False]), "start": (0, 0, 0)}
    mask, others = reset_mask(options, 3)
    assert mask.tolist() == [False, True, False]
    assert others == {"start": (0, 0, 0)}
    assert set(options) == {"reset_mask", "start"}  # what was given stays as it is


@pytest.mark.parametrize(
    "mask",
    [
        [True, False, True],
        np.array([1, 0, 1]),
        np.array([True, False]),
        np.ones((3, 1), bool),
        None,
    ],
)
def test_a_mask_is_a_bool_array_with_an_entry_a_world(mask):
    with pytest.raises(InputError, match=r"must be a bool array of shape \(3,\)"):
        reset_mask({"reset_mask": mask}, 3)


def test_a_mask_names_a_world():
    with pytest.raises(InputError, match="must name at least one world, got none"):
        reset_mask({"reset_mask": np.zeros(3, dtype=bool)}, 3)
