"""A hook of mkdocs: the menu stands beside the text from 1,120 pixels on, not from 1,220 on.

The theme's stylesheets and scripts state the width in their media queries, and offer no setting.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

NARROWER = {"76.25em": "70em", "76.234375em": "69.984375em"}
FILES = ("assets/stylesheets/*.css", "assets/javascripts/bundle*.js")


def on_post_build(config: Any) -> None:
    """Change the width in the files of the built site."""
    for pattern in FILES:
        for path in Path(config.site_dir).glob(pattern):
            text = path.read_text(encoding="utf-8")
            for wide, narrow in NARROWER.items():
                text = text.replace(wide, narrow)
            path.write_text(text, encoding="utf-8")
