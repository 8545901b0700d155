"""The notebook runs from its first cell to its last, and prints what is stored in it."""

import json
import re
from typing import Any

from docs.making.notebook import executed
from tests.docs.pages import DOCS

NUMBER = re.compile(r"\d+(\.\d+)?")


def outputs(notebook: dict[str, Any]) -> list[list[str]]:
    """Of each cell of code: its text, and a word for each picture."""
    return [
        ["".join(one.get("text", ["a picture"])) for one in cell["outputs"]]
        for cell in notebook["cells"]
        if cell["cell_type"] == "code"
    ]


def test_the_notebook_gives_what_is_stored_in_it() -> None:
    stored = json.loads((DOCS / "quickstart.ipynb").read_text("utf-8"))
    found, expected = outputs(executed(stored)), outputs(stored)
    assert sum("a picture" in cell for cell in found) == 3
    words = [[NUMBER.sub("#", text) for text in cell] for cell in found]
    assert words == [[NUMBER.sub("#", text) for text in cell] for cell in expected]
    for now, then in zip(found, expected, strict=True):
        for a, b in zip(NUMBER.findall(" ".join(now)), NUMBER.findall(" ".join(then)), strict=True):
            assert a == b  # decimals of all that is printed


def test_links_of_the_notebook_lead_to_pages() -> None:
    text = (DOCS / "quickstart.ipynb").read_text("utf-8")
    linked = re.findall(r"\]\(([\w.-]+\.md)\)", text)
    assert linked
    assert all((DOCS / page).is_file() for page in linked)
