"""What the README shows is what runs."""

import re
from pathlib import Path

import pytest

from slam import registry

README = Path(__file__).parents[1] / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.split("\n", 1)[0])
def test_each_python_block_runs(block: str, capsys, monkeypatch):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    exec(compile(block, str(README), "exec"), {})
    assert capsys.readouterr().out.strip()


def test_there_are_blocks_and_the_page_stays_short():
    assert len(BLOCKS) == 2
    assert len(README.read_text(encoding="utf-8").splitlines()) < 150


def test_each_link_leads_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README.read_text(encoding="utf-8")):
        assert (README.parent / target).exists(), target
