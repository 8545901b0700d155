"""Formulas of the pages: LaTeX in a ```math fence becomes MathML, which needs no script."""

from __future__ import annotations

from html import escape
from typing import Any

from latex2mathml.converter import convert


def fence(source: str, language: str, css_class: str, *_: Any, **__: Any) -> str:
    """What pymdownx.superfences puts where a ```math block was: a formula on a line of its own."""
    mathml = convert(source.strip(), display="block")
    return (
        f'<div class="{css_class}" role="math" aria-label="{escape(source.strip())}">{mathml}</div>'
    )
