"""`from slam import ...` gives all that a variant of one's own needs, and costs nothing before."""

import ast
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import slam
from tests.slam.worlds import drive


def test_the_names_for_editors_are_those_at_run_time() -> None:
    """pyright reads the imports under TYPE_CHECKING, Python the table."""
    tree = ast.parse(Path(str(slam.__file__)).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imported = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert imported == slam._MODULES
    assert list(slam.__all__) == list(slam._MODULES)


def test_each_name_is_there_and_says_what_it_is() -> None:
    for name in slam.__all__:
        found = getattr(slam, name)
        assert name == "Builder" or found.__doc__, name
        assert name in dir(slam)


def test_no_name_is_hidden_by_a_module() -> None:
    """`import slam.x` would put the module `x` in the place of the name `x`."""
    modules = {module.name for module in pkgutil.iter_modules(slam.__path__)}
    assert not modules & set(slam.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'slam' has no attribute 'nothing'"):
        slam.nothing  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]


def test_the_import_alone_loads_neither_numpy_nor_numba() -> None:
    code = "import sys, slam; print(sorted({'numpy', 'numba', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_one_import_line_makes_runs_and_scores_a_variant() -> None:
    from slam import HMM, Correlative, Endpoint, MaximumLikelihood, run, score, true_start

    episode = drive(20)
    robot = MaximumLikelihood(
        true_start(episode), map_model=HMM(), sensor_model=Endpoint(), search=Correlative()
    )
    scores = score(run(robot, episode), episode)
    assert scores["ate"] is not None
    assert scores["ate"] < 0.1
    assert {"f1_5cm", "f1_5cm_aligned", "brier_now_all"} <= scores.keys()
