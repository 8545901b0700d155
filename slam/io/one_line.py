"""Format texts from files and libraries for a message: one line of limited length."""

from __future__ import annotations


def one_line(what: object, max_length: int = 200) -> str:
    """`what` as one line of printable text; an error without a text by its type."""
    text = str(what)[: 4 * max_length]
    text = "".join(one if one.isprintable() else " " for one in text)
    text = " ".join(text.split()) or type(what).__name__
    return text if len(text) <= max_length else text[: max_length - 3] + "..."


def listed(names: list[str], max_length: int = 200) -> str:
    """Names with commas between, as many as fit; at least one."""
    shown = one_line(", ".join(one_line(name, 100) for name in names[:1]) or "none", max_length)
    for number, name in enumerate(names[1:], 1):
        if len(shown) + len(name) + 2 > max_length:
            return f"{shown} and {len(names) - number} more"
        shown = f"{shown}, {one_line(name)}"
    return shown
