"""Pages of HTML: a folder's template filled in, one file without network requests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jinja2


def filled_in(folder: Path, template: str = "page.html", **content: Any) -> str:
    """A template of `folder` with `content`, and with page.css as `css`."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    css = (folder / "page.css").read_text(encoding="utf-8")
    return environment.get_template(template).render(css=css, **content)


def json_for_script(value: Any) -> str:
    """JSON that cannot end a script element. Raises ValueError for NaN and infinite numbers."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")
