"""The README can be read at one sitting: few words, few lines, none of them long."""

import re

import pytest

from tests.docs.pages import ROOT

MAX_WORDS, MAX_LINES, MAX_LINE_LENGTH = 700, 149, 200
README = (ROOT / "README.md").read_text(encoding="utf-8")


def prose_words(text: str) -> list[str]:
    """The words of a page outside of code blocks and tables; of a link only what is shown."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^\|.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return re.findall(r"\S*\w\S*", text)


def test_the_prose_is_short():
    assert len(prose_words(README)) <= MAX_WORDS


def test_the_lines_are_few_and_short():
    lines = README.splitlines()
    assert len(lines) <= MAX_LINES
    assert max(map(len, lines)) <= MAX_LINE_LENGTH


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Two words, [a link](docs/index.md#anchor).", 4),
        ("* `code` - ![picture](a.png)\n\n| a | table |\n|---|---|\nafter", 3),
        ("before\n```\nmany words in code\n```\nafter", 2),
    ],
)
def test_code_tables_and_targets_are_no_prose(text: str, words: int):
    assert len(prose_words(text)) == words
