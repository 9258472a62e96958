"""The words of the glossary: pages, messages, docstrings, comments and names keep the old ones out."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs_pages import PAGES, ROOT, name
from strings import SOURCE, strings

GLOSSARY = (ROOT / "docs/glossary.md").read_text(encoding="utf-8").split("## The field's words")[1]
#: The last column of the glossary's second table: the words that the project does not use.
OLD = [
    word.strip()
    for row in GLOSSARY.splitlines()
    if row.startswith("| ") and not row.startswith("| term")
    for word in row.strip()[:-1].rpartition("|")[2].split(",")
    if word.strip()
]
PATTERN = re.compile(rf"\b({'|'.join(OLD)})\b", re.IGNORECASE)
#: Pages of records: they say what was, in the words of their day.
RECORDS = ("docs/glossary.md", "docs/decisions/", "docs/peers.md", "CHANGELOG.md")
#: Names of the API and keys of `--json`, which stay.
STABLE = ("tracking_error",)


def prose(file: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string of a module, and of its docstrings, comments and names."""
    yield from strings(file)
    for token in tokenize.generate_tokens(io.StringIO(file.read_text(encoding="utf-8")).readline):
        text = token.string
        if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and text.startswith('"""')):
            yield token.start[0], " ".join(text.split())
        elif token.type == tokenize.NAME and not text.startswith(STABLE):
            yield token.start[0], text.replace("_", " ")


def test_the_list_is_that_of_the_glossary():
    for word in ("told", "knob", "besides", "asked", "tracking error", "slip of the hand", "comes out", "axis rests"):
        assert word in OLD
        assert PATTERN.search(f"it was {word} here")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_pages(page: Path):
    if name(page).startswith(RECORDS):
        return
    text = page.read_text(encoding="utf-8")
    found = [f"line {text.count(chr(10), 0, m.start()) + 1}: {m[0]}" for m in PATTERN.finditer(text)]
    assert not found, found


def test_messages_docstrings_comments_and_names():
    found = [
        f"{file.relative_to(ROOT)}:{line}: {match[0]}"
        for file in sorted(SOURCE.rglob("*.py"))
        for line, text in prose(file)
        for match in PATTERN.finditer(text)
    ]
    assert not found, "\n".join(found)


def test_the_studio():
    pages = sorted(file for file in (SOURCE / "studio/page").iterdir() if file.suffix in (".html", ".js"))
    assert pages
    for file in pages:
        text = file.read_text(encoding="utf-8")
        shown = [text] if file.suffix == ".html" else re.findall(r"""["`][^"`\n]* [^"`\n]*["`]""", text)
        assert not [match[0] for each in shown for match in PATTERN.finditer(each)], file.name
