import json
from pathlib import Path

import pytest

from slam.benchmark import results
from slam.errors import InputError


def test_what_was_appended_is_read_in_order(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    for k in range(3):
        results.append(path, {"seed": k, "ate": 0.1 * k, "name": "Tür", "none": None})
    assert [row["seed"] for row in results.read(path)] == [0, 1, 2]
    assert results.read(path)[1] == {"seed": 1, "ate": 0.1, "name": "Tür", "none": None}
    assert len(path.read_text().splitlines()) == 3


def killed_while_writing(path: Path) -> None:
    results.append(path, {"seed": 0})
    with path.open("a") as file:
        file.write('{"seed": 1, "at')


def test_an_unfinished_last_line_is_passed_over(tmp_path: Path) -> None:
    killed_while_writing(tmp_path / "results.jsonl")
    assert results.read(tmp_path / "results.jsonl") == [{"seed": 0}]


def test_a_run_that_goes_on_after_a_kill_loses_no_other_line(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    killed_while_writing(path)
    results.append(path, {"seed": 2})
    assert results.read(path) == [{"seed": 0}, {"seed": 2}]


def test_what_is_no_json_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    with pytest.raises(ValueError, match="JSON"):
        results.append(path, {"ate": float("nan")})
    assert not path.exists()


@pytest.mark.parametrize("line", [b"no json", b'{"ate": NaN}', b"{", b"\xff\xfe"])
def test_a_line_that_is_no_result_is_told(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "results.jsonl"
    path.write_bytes(b'{"seed": 0}\n' + line + b"\n")
    with pytest.raises(InputError, match=r"results.jsonl:\d: not a line of results"):
        results.read(path)
    with pytest.raises(InputError, match="this is a directory"):
        results.read(tmp_path)


def test_versions_name_what_a_result_depends_on() -> None:
    found = results.versions()
    assert {"python", "dynslam", "numpy", "numba", "scipy"} <= found.keys()
    assert json.loads(json.dumps(found)) == found


def test_an_absent_package_is_told_as_absent(monkeypatch) -> None:
    monkeypatch.setattr(results, "PACKAGES", ("numpy", "no-such-package-here"))
    assert results.versions()["no-such-package-here"] == "absent"
