"""The rows `name  what it is` of a docstring."""

from __future__ import annotations

import re
from collections.abc import Iterator

ROW = re.compile(r"^(?P<names>[a-z_]\w*(?:, [a-z_]\w*)*) {1,}(?P<what>\S.*)$")
TWO_SPACES = re.compile(r"^(?P<names>[a-z_]\w*(?:, [a-z_]\w*)*) {2,}(?P<what>\S.*)$")
PAIR = "m", "rad"
SHORT = re.compile(r"^`(?P<names>\w+)`: (?P<what>.*)$")  # of one that a sentence describes


def rows(text: str) -> Iterator[tuple[str, str]]:
    """Each name of a docstring's blocks of two columns with its description, in one line.

    A name is followed by two spaces at least, and by one in a block whose first line has two.
    """
    for block in re.split(r"\n\s*\n", text):
        for names, what in _of_block(block.split("\n")):
            yield from zip(names, _of_each(names, what), strict=True)


def _of_each(names: list[str], what: str) -> list[str]:
    """The description for each of the names: two of them have the units `m and rad`."""
    if len(names) == len(PAIR) and what.startswith(" and ".join(PAIR)):
        rest = what.removeprefix(" and ".join(PAIR))
        return [unit + rest for unit in PAIR]
    return [what] * len(names)


def _of_block(lines: list[str]) -> Iterator[tuple[list[str], str]]:
    sentence = SHORT.match(lines[0])
    if sentence:
        yield [sentence["names"]], " ".join([sentence["what"], *(x.strip() for x in lines[1:])])
        return
    if not any(TWO_SPACES.match(line) for line in lines):
        return
    names: list[str] = []
    what = ""
    for line in lines:
        row = TWO_SPACES.match(line) or (ROW.match(line) if names else None)
        if row and not line.startswith(" "):
            if names:
                yield names, what
            names, what = row["names"].split(", "), row["what"]
        elif names:
            what += f" {line.strip()}"
    if names:
        yield names, what
