"""What somebody else's file or library says, fit to be shown: one line, and not a long one."""

from __future__ import annotations


def one_line(what: object, most: int = 200) -> str:
    """`what` in words, an error by its kind where it has none."""
    text = str(what)[: 4 * most]
    text = "".join(one if one.isprintable() else " " for one in text)
    text = " ".join(text.split()) or type(what).__name__
    return text if len(text) <= most else text[: most - 3] + "..."


def listed(names: list[str], most: int = 200) -> str:
    """Names with commas between, as many as fit; at least one."""
    shown = one_line(", ".join(one_line(name, 100) for name in names[:1]) or "none", most)
    for number, name in enumerate(names[1:], 1):
        if len(shown) + len(name) + 2 > most:
            return f"{shown} and {len(names) - number} more"
        shown = f"{shown}, {one_line(name)}"
    return shown
