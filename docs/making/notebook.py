"""`python -m docs.making.notebook docs/quickstart.ipynb`: run a notebook and store its outputs.

Needs no Jupyter: the cells are run one after the other in one namespace, in an empty folder; what
they print and the figures they leave open become their outputs.
"""

from __future__ import annotations

import base64
import contextlib
import io
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

DPI = 80


def executed(notebook: dict[str, Any]) -> dict[str, Any]:
    """The notebook with the outputs of a new run. An exception of a cell is raised."""
    namespace: dict[str, Any] = {}
    cells, count = [], 0
    plt.close("all")  # figures of others are no output
    with _empty_folder():
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                count += 1
                found = _outputs("".join(cell["source"]), namespace)
                cell = {**cell, "execution_count": count, "outputs": found}
            cells.append(cell)
    return {**notebook, "cells": cells}


def _outputs(source: str, namespace: dict[str, Any]) -> list[dict[str, Any]]:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(source, "<cell>", "exec"), namespace)
    found = []
    if printed.getvalue():
        text = printed.getvalue().splitlines(keepends=True)
        found.append({"output_type": "stream", "name": "stdout", "text": text})
    for number in plt.get_fignums():
        image = base64.b64encode(_png(plt.figure(number))).decode()
        data = {"image/png": image, "text/plain": ["<Figure>"]}
        found.append({"output_type": "display_data", "data": data, "metadata": {}})
    plt.close("all")
    return found


def _png(figure: Any) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, dpi=DPI, bbox_inches="tight", metadata={"Software": None})
    return file.getvalue()


@contextlib.contextmanager
def _empty_folder() -> Iterator[None]:
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def written(notebook: dict[str, Any]) -> str:
    """A notebook as a file."""
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(written(executed(json.loads(path.read_text("utf-8")))), encoding="utf-8")
