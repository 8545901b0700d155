"""Docstrings on the API pages: blocks of two columns, name and meaning, become Markdown lists.

A docstring has, for example,

    ranges  (beams,) m; no echo is inf
    time    s, when it was
            taken

which Markdown would join into one paragraph.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

ROW = re.compile(r"^(?P<name>[a-z_*][\w*]*(?:, [a-z_*][\w*]*)*) {2,}(?P<what>\S.*)$")


def listed(text: str) -> str:
    """The text with each block of two columns replaced by a Markdown list."""
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
    """A griffe extension that applies `listed` to every docstring."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Rewrite the docstring of one module, class, function or attribute."""
        if obj.docstring is not None:
            obj.docstring.value = listed(obj.docstring.value)
