"""A folder for what this user's processes keep where there is no home: in the system's folder for
temporary files, and nobody else's."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path


@cache
def own_folder() -> Path:
    """`dynslam-UID` among the temporary files, or a new folder if that is somebody else's.

    What lies in it is trusted (numba loads pickles from its cache), so only its owner may enter it.
    Raises OSError where nothing can be written.
    """
    path = Path(tempfile.gettempdir()) / f"dynslam-{_user()}"
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        if _is_private(path):
            return path
    except OSError:  # a file of that name
        pass
    return Path(tempfile.mkdtemp(prefix="dynslam-"))


def provide_home() -> None:
    """Give a user without a home, here and in processes that this one starts, `own_folder` as one:
    numba and others would make a folder named ~ where the command is run."""
    if os.path.expanduser("~") != "~":
        return
    with suppress(OSError):
        os.environ["HOME"] = str(own_folder())
        print(f"dynslam: this user has no home; used instead: {own_folder()}", file=sys.stderr)


def is_writable(folder: Path) -> bool:
    """Whether a file can be made in `folder`, which is made if it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")


def _is_private(path: Path) -> bool:
    """Whether it is a folder, no link, of this user, that no other user can write to."""
    found = path.lstat()
    if not hasattr(os, "getuid"):
        return stat.S_ISDIR(found.st_mode)
    mine = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return mine and not found.st_mode & 0o077
