"""Formulas of the pages: LaTeX in a ```math fence becomes MathML, which needs no JavaScript."""

from __future__ import annotations

from html import escape
from typing import Any

from latex2mathml.converter import convert


def fence(source: str, language: str, css_class: str, *_: Any, **__: Any) -> str:
    """HTML of one ```math block, as pymdownx.superfences calls it: a displayed formula."""
    mathml = convert(source.strip(), display="block")
    return (
        f'<div class="{css_class}" role="math" aria-label="{escape(source.strip())}">{mathml}</div>'
    )
