"""Members of zip archives, unpacked within the budget of the file."""

from __future__ import annotations

import zipfile

from slam.errors import InputError
from slam.io.guard import take
from slam.io.one_line import one_line

BOUNDED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What `zipfile` unpacks up to a size. Of bzip2 and LZMA it unpacks all that 4 kB hold, which can
be gigabytes."""


def check_packing(archive: zipfile.ZipFile) -> None:
    """Raises InputError if a member is packed in another way than `BOUNDED`."""
    for member in archive.infolist():
        if member.compress_type not in BOUNDED:
            name = one_line(member.filename, 60)
            raise InputError(f"{name} in it is packed by a method that dynslam does not read")


def read_member(archive: zipfile.ZipFile, name: str, copies: int) -> bytes:
    """The bytes of a member, no more than the archive says it has; `copies` of them are taken from
    the budget. Raises InputError, and what `zipfile` does for a damaged archive."""
    size = archive.getinfo(name).file_size
    take(copies * size)
    with archive.open(name) as file:  # `read` of the archive would unpack all that is in it
        return file.read(size)
