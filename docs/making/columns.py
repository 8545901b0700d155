"""Docstrings for the API pages: the house's two columns of names and meanings become lists.

In a docstring stands

    ranges  (beams,) m; no echo is inf
    time    s, when it was
            taken

which Markdown would run together into one paragraph.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

ROW = re.compile(r"^(?P<name>[a-z_*][\w*]*(?:, [a-z_*][\w*]*)*) {2,}(?P<what>\S.*)$")


def listed(text: str) -> str:
    """The same text with each block of two columns as a Markdown list."""
    blocks = re.split(r"\n\s*\n", text)
    return "\n\n".join(_block(block) for block in blocks)


def _block(block: str) -> str:
    lines = block.split("\n")
    if not ROW.match(lines[0]):
        return block
    rows: list[str] = []
    for line in lines:
        row = ROW.match(line)
        if row:
            names = ", ".join(f"`{name}`" for name in row["name"].split(", "))
            rows.append(f"- {names}: {row['what']}")
        elif line.startswith("  "):
            rows[-1] += f" {line.strip()}"
        else:
            return block  # running text
    return "\n".join(rows)


class Columns(griffe.Extension):
    """Rewrites every docstring that griffe has read."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Called for each module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = listed(obj.docstring.value)
