"""Tables for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import HORIZONTALS
from rich.table import Table

WIDTH = 80  # characters
EDGES = 2  # characters beside the first and the last column
LEAST = 12  # characters of the first column


def plain_table(headings: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> Table:
    """A table of at most 80 columns: the first column is folded where it is too long, the others,
    which hold numbers, are never cut."""
    table = Table(title=title or None, title_justify="left", box=HORIZONTALS, padding=0)
    table.add_column(headings[0], overflow="fold")
    for heading in headings[1:]:
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    rest = sum(1 + max(len(row[k]) for row in (headings, *rows)) for k in range(1, len(headings)))
    table.columns[0].max_width = max(WIDTH - rest - EDGES, LEAST)
    return table
