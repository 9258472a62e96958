"""The words of the glossary: pages, messages and docstrings keep the old ones out."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs_pages import PAGES, name

ROOT = Path(__file__).resolve().parents[2]
#: The last column of the glossary's second table, as it stands in a sentence.
OLD = re.compile(r"\b(told|knobs?|besides|asked|tracking error|(?:tool|motion|axis) rests|slips? of the hand)\b", re.I)
#: Pages of records: they say what was, in the words of their day.
RECORDS = ("docs/glossary.md", "docs/decisions/", "docs/peers.md", "CHANGELOG.md")


def strings(file: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string with a blank in it: messages, help and docstrings."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield node.lineno, node.value


def test_the_list_is_that_of_the_glossary():
    glossary = (ROOT / "docs/glossary.md").read_text(encoding="utf-8")
    last = [
        row.rstrip(" |").rsplit("|", 1)[-1].strip() for row in glossary.split("## The field's words")[1].splitlines()
    ]
    for word in ("told", "knob", "besides", "asked", "tracking error"):
        assert word in last and OLD.search(f"it was {word} here")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_pages(page: Path):
    if name(page).startswith(RECORDS):
        return
    text = page.read_text(encoding="utf-8")
    found = [f"line {text.count(chr(10), 0, m.start()) + 1}: {m[0]}" for m in OLD.finditer(text)]
    assert not found, found


def test_messages_and_docstrings():
    found = [
        f"{file.relative_to(ROOT)}:{line}: {match[0]}"
        for file in sorted((ROOT / "src").rglob("*.py"))
        for line, text in strings(file)
        for match in OLD.finditer(text)
    ]
    assert not found, "\n".join(found)
