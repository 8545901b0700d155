# pyright: reportMissingImports=false, reportMissingModuleSource=false
# pyright: reportAttributeAccessIssue=false
"""Files that nobody would write, for as long as you like: all readers, led by what they cover.

    pip install atheris
    python tests/fuzz/fuzz_readers.py -max_total_time=600
    python tests/fuzz/fuzz_readers.py ros1.bag -max_total_time=60    (one kind of file)

Whatever is not an episode, or one line of InputError that names the file, is a finding: the input
is left in the folder as crash-..., and its kind is its first byte where all are fuzzed. Options are
libFuzzer's. Not run by pytest.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path

import atheris

sys.path.insert(0, str(Path(__file__).parents[2]))

with atheris.instrument_imports(
    include=["slam.io", "slam.episode", "slam.preprocessing.deskewing", "rosbags"]
):
    import slam.io.bags  # noqa: F401 (imported late by the readers, and then not instrumented)
    from slam.errors import InputError
    from slam.io.loaded_recording import LoadedRecording
    from slam.preprocessing.deskewing import deskewed
    from tests.slam.io.samples import reader_of, samples

NAMES = tuple(samples())
FOLDER = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))


def check(name: str, data: bytes) -> None:
    """Read `data` as a file of this name."""
    path = FOLDER / name
    path.write_bytes(data)
    try:
        result = reader_of(name)(path)
    except InputError as error:
        text = str(error)
        assert "\n" not in text, text
        assert len(text) < 400, text
        assert str(FOLDER) in text, text  # the file, or the picture that it names
        return
    if isinstance(result, LoadedRecording):
        result.episode.displacements()
        deskewed(result.episode)
        assert all("\n" not in str(warned) for warned in result.warnings)


def main() -> None:
    """Fuzz one kind of file, if its name is the first argument, or all."""
    warnings.simplefilter("error", RuntimeWarning)
    only = sys.argv.pop(1) if sys.argv[1:] and sys.argv[1] in NAMES else None
    seeds = FOLDER / "seeds"
    seeds.mkdir()
    for number, (name, data) in enumerate(samples().items()):
        (FOLDER / name).write_bytes(data)
        if only in (None, name):
            (seeds / name).write_bytes(data if only else bytes([number]) + data)

    def one(data: bytes) -> None:
        if only:
            check(only, data)
        elif data:
            check(NAMES[data[0] % len(NAMES)], data[1:])

    limits = ["-max_len=40000", "-timeout=20", "-rss_limit_mb=3000"]
    atheris.Setup([sys.argv[0], *limits, *sys.argv[1:], str(seeds)], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
