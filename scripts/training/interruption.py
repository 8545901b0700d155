"""What Ctrl-C does to a training."""

from __future__ import annotations

import sys

from ..console.exits import EXIT_INTERRUPTED


def interrupted() -> int:
    """Tell on standard error how an interrupted training goes on; the exit status."""
    print(
        "train: interrupted; the same command with --resume continues from the last evaluation",
        file=sys.stderr,
    )
    return EXIT_INTERRUPTED
