# pyright: reportMissingImports=false
"""Episodes are recorded into a folder of the tests' own, and a bench is small."""

from pathlib import Path

import pytest
from dynslam_cli import main
from dynslam_cli.bench import run_bench


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DYNSLAM_CACHE", str(tmp_path_factory.mktemp("episodes")))
        yield


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Runs `dynslam bench ARGUMENTS` into a folder, and gives its exit status; the report, which
    takes longer than the runs, is written on request."""

    def run(*arguments: str, out: Path = tmp_path / "out", report: bool = False) -> int:
        if not report:
            monkeypatch.setattr(run_bench, "write_report", lambda rows, out, order: iter(()))
        return main.status(["bench", *arguments, "--out", str(out)])

    return run
