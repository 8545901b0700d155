"""Objects of a user's own Python file, named FILE.py:NAME."""

import sys

import pytest

from slam import InputError
from slam.io.python_file import load_object, names_object

OWN = """
from __future__ import annotations
from dataclasses import dataclass

@dataclass
class Own:
    size: int = 3
"""


def test_the_form_is_a_file_and_a_name():
    assert names_object("some/where.py:Own")
    assert not names_object("some/where.py")
    assert not names_object("best.zip")


def test_a_dataclass_is_loaded_and_its_module_is_not_kept(tmp_path):
    (tmp_path / "own_module.py").write_text(OWN)
    assert load_object(f"{tmp_path}/own_module.py:Own")().size == 3
    assert "own_module" not in sys.modules


def test_a_module_of_the_same_name_stays(tmp_path):
    (tmp_path / "json.py").write_text(OWN)
    before = sys.modules["json"]
    load_object(f"{tmp_path}/json.py:Own")
    assert sys.modules["json"] is before


@pytest.mark.parametrize(
    ("text", "told"),
    [("1 / 0", "ZeroDivisionError"), ("x = 1", "'Own' cannot be loaded"), (None, "expected a Py")],
)
def test_a_wrong_file_is_refused(tmp_path, text, told):
    path = tmp_path / "own_module.py"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=told):
        load_object(f"{path}:Own")
    assert "own_module" not in sys.modules
