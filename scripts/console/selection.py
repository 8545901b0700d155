"""Names chosen on the command line, separated by commas."""

from __future__ import annotations

from collections.abc import Sequence

import slam
from slam.errors import InputError
from slam.validation import unknown_name

ALL, PLAIN = "all", "plain"
LIST_VARIANTS = 'python -c "import slam; print(*slam.variants())"'


def check_variant(name: str) -> None:
    """Raise InputError, with the nearest known names, unless `name` is a SLAM variant."""
    if name not in slam.variants():
        raise InputError(unknown_name("SLAM variant", name, slam.variants(), LIST_VARIANTS))


def parse_variants(names: str) -> list[str]:
    """SLAM variants by name.

    `plain` selects the names without a slash: each map model once, with its default sensor model,
    search and motion model.
    """
    known = slam.variants()
    plain = ",".join(name for name in known if "/" not in name)
    names = plain if names.strip() == PLAIN else names
    return parse_selection("SLAM variant", names, known, LIST_VARIANTS, [ALL, PLAIN])


def parse_selection(
    kind: str,
    names: str,
    known: list[str],
    source: str = "",
    keywords: Sequence[str] = (ALL,),
) -> list[str]:
    """The named ones of `known`, each once; `all` of them if that is the only word.

    kind      what is selected, for messages
    source    where all names are listed, for messages
    keywords  words that stand for several names, for messages

    Raises InputError for an unknown name, with the nearest known ones, and if nothing is named.
    """
    if names.strip() == ALL:
        return known
    listed = list(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    if not listed:
        raise InputError(f"no {kind} named; known: {', '.join([*keywords, *known][:10])}")
    for name in listed:
        if name not in known:
            raise InputError(unknown_name(kind, name, [*keywords, *known], source))
    return listed
