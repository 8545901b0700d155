"""The pages of the documentation, and the code blocks and commands in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
FENCE = re.compile(r"^( *)```(\w*|\{.*\})\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`((?:\.venv/bin/)?dynslam [^`]+)`")
SHELL = ("", "sh", "bash")


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    text: str


def name(page: Path) -> str:
    """The path of a page in the repository."""
    return str(page.relative_to(ROOT))


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, or of the docstrings of a source, in their order."""
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    return [Block(language, dedent(f"{indent}{text.lstrip()}" if indent else text))
            for indent, language, text in found]  # fmt: skip


def lines(block: Block) -> list[str]:
    """The commands of a shell block, without comments."""
    if block.language not in SHELL:
        return []
    bare = (re.split(r"\s+#", line, maxsplit=1)[0].strip() for line in block.text.splitlines())
    return [line for line in bare if line]


def commands(page: Path) -> list[str]:
    """Each `dynslam ...` of a page, in blocks and in running text."""
    shown = [line for block in blocks(page) for line in lines(block)]
    shown += INLINE.findall(page.read_text(encoding="utf-8"))
    ours = (re.match(r"(?:\.venv/bin/)?dynslam (?=[a-z])(.*)", line) for line in shown)
    return list(dict.fromkeys(match[1] for match in ours if match))


def arguments(command: str) -> list[str]:
    """The words of a command that can be parsed: the first of a choice, 1 for a single capital."""
    words = shlex.split(re.sub(r"[][]|\.\.\.", " ", command))
    return [re.sub(r"^[A-Z]$", "1", word.split("|")[0]) for word in words]
