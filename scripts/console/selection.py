"""Names that are chosen on the command line, with commas between."""

from __future__ import annotations

import slam
from slam.errors import InputError

ALL, PLAIN = "all", "plain"


def parse_variants(names: str) -> list[str]:
    """SLAM variants by name; `plain` are those without a slash in their name: one a map, each with
    the reading, search and motion model that it is meant to have."""
    known = slam.variants()
    plain = ",".join(name for name in known if "/" not in name)
    return parse_selection(
        "variant", plain if names.strip() == PLAIN else names, known, [ALL, PLAIN]
    )


def parse_selection(
    kind: str, names: str, known: list[str], words: list[str] | None = None
) -> list[str]:
    """Some of the `known`, each once; or all of them, if that is the one word.

    Raises InputError that lists the known ones (and `words` that stand for several) for any other
    name, and for none.
    """
    if names.strip() == ALL:
        return known
    listed = list(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    unknown = [name for name in listed if name not in known]
    if unknown or not listed:
        wrong = f"unknown {kind} {', '.join(map(repr, unknown))}" if unknown else f"no {kind} named"
        raise InputError(f"{wrong}; known: {', '.join([*(words or [ALL]), *known])}")
    return listed
