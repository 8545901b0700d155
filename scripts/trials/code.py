"""The code of a variant: whose it is, its version, a digest of its files."""

from __future__ import annotations

import functools
import hashlib
import inspect
import os
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Any, NamedTuple

import slam
from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS
from slam.registry import builder_of

from ..outside.adapter import Adapter
from .sources import code_digest

OURS = "dynslam"
UNKNOWN = "unknown"  # the module of code that was typed in, or run from a string


class Code(NamedTuple):
    """The code that a result came from, beside the episode's.

    package  distribution or module of a variant of the user's; `dynslam`; the adapter's name
    version  of it; empty if it has none
    digest   of its files, 16 hexadecimal digits
    """

    package: str
    version: str
    digest: str

    def __str__(self) -> str:
        return " ".join(filter(None, (self.package, self.version, self.digest[:8])))

    @staticmethod
    def of(row: Mapping[str, Any]) -> Code | None:
        """The code that a row of results names; None of a row that names none."""
        kept = row.get("code")
        return Code(*(str(kept.get(n, "")) for n in Code._fields)) if kept else None


def code_of(variant: str) -> Code:
    """The code of one of our variants, or of one that a user or a package registered."""
    if variant in BUILDERS or variant in CEILINGS:
        return our_code()
    modules = sorted({name.split(".")[0] for name in _modules(builder_of(variant))} - {"slam"})
    if not modules:  # made of our parts alone, with other parameters: in the row's `slam`
        return our_code()
    names = ", ".join(map(_distribution, modules))
    digests = "".join(module_digest(name) for name in modules)
    found = hashlib.sha256((our_code().digest + digests).encode()).hexdigest()[:16]
    return Code(names, ", ".join(filter(None, map(_version, modules))), found)


def code_of_adapter(adapter: Adapter, told: str) -> Code:
    """The code of an outside system: its adapter and the files beside it that its commands name.

    told  the version that the program tells of itself
    """
    found = hashlib.sha256(repr(sorted(adapter.plain.items())).encode() + told.encode())
    for path in sorted(adapter.folder.iterdir()):
        if path.is_file() and any(
            path.name in command for command in (*adapter.prepare, *adapter.commands)
        ):
            found.update(path.read_bytes())
    return Code(adapter.name, told, found.hexdigest()[:16])


@cache
def our_code() -> Code:
    """The code of `slam`, and of the libraries that it depends on."""
    return Code(OURS, _version(OURS), code_digest(Path(str(slam.__file__)).parent))


def _modules(part: Any, depth: int = 4) -> Iterator[str]:
    """Modules of a builder: its own, and those of the functions and classes that it holds."""
    if isinstance(part, functools.partial):
        for one in (part.func, *part.args, *part.keywords.values()):
            yield from _modules(one, depth - 1)
    elif inspect.isclass(part) or inspect.isfunction(part) or inspect.ismethod(part):
        yield part.__module__ or UNKNOWN
        cells = getattr(part, "__closure__", None) or ()
        for cell in cells if depth else ():
            yield from _modules(cell.cell_contents, depth - 1)
    elif callable(part):
        yield type(part).__module__


def _distribution(module: str) -> str:
    return ", ".join(packages_distributions().get(module, [module]))


def _version(name: str) -> str:
    try:
        return version(_distribution(name))
    except PackageNotFoundError:
        return ""


def module_digest(module: str) -> str:
    """Of the files of a module or package; another one every time where there are none."""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return os.urandom(8).hex()
    path = Path(file)
    files = sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]
    return hashlib.sha256(b"".join(one.read_bytes() for one in files)).hexdigest()
