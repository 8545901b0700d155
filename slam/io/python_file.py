"""Objects of a user's own Python file, named FILE.py:NAME."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

from slam.errors import InputError


def names_object(text: str) -> bool:
    """Whether `text` has the form FILE.py:NAME."""
    return text.rpartition(":")[0].endswith(".py")


def load_object(text: str) -> Any:
    """The object NAME of the file in `text`, FILE.py:NAME; the file is run.

    The file's module is not kept in `sys.modules`, so that cloudpickle copies its classes into
    other processes. Raises InputError for a missing file, an error in it, and an unknown NAME.
    """
    file, _, name = text.rpartition(":")
    path = Path(file)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise InputError(f"{path}: expected a Python file that defines {name!r}")
    module, before = importlib.util.module_from_spec(spec), sys.modules.get(path.stem)
    sys.modules[path.stem] = module  # dataclasses look their module up
    try:
        spec.loader.exec_module(module)
        return getattr(module, name)
    except Exception as error:  # a user's file may raise anything
        raise InputError(f"{path}: {name!r} cannot be loaded ({error!r})") from None
    finally:
        if before is None:
            del sys.modules[path.stem]
        else:
            sys.modules[path.stem] = before
