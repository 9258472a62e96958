"""Formulas in the sentences of the maths pages are typeset, as those that stand alone are."""

from __future__ import annotations

import re

import pytest

from docs_pages import ROOT

MATHS = sorted((ROOT / "docs/math").glob("*.md"))
#: What is typeset, code, and generated sentences.
SET = re.compile(r"\$\$.*?\$\$|\$[^$]+\$|```.*?```|`[^`]*`|<!-- (\S+:\S+) -->.*?<!-- /\1 -->", re.DOTALL)
#: What only formulas have: roots, powers, primes of letters, Greek words, bars.
PLAIN = re.compile(r"sqrt\(|\w\^[\d(]|\b[a-zA-Z]''|\b(?:sigma|lambda|kappa|tau)\b|\|\w+'?\|")


@pytest.mark.parametrize("page", MATHS, ids=lambda page: page.stem)
def test_formulas_in_sentences_are_typeset(page):
    text = SET.sub("", page.read_text(encoding="utf-8"))
    assert [found[0] for found in PLAIN.finditer(text)] == []


def test_every_formula_in_a_sentence_can_be_read():
    converter = pytest.importorskip("latex2mathml.converter")
    for page in MATHS:
        text = re.sub(r"\$\$.*?\$\$|```.*?```|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        formulas = re.findall(r"\$([^$]+)\$", text)
        assert formulas
        for formula in formulas:
            assert "\n" not in formula, (page.name, formula)
            assert converter.convert(formula).startswith("<math"), (page.name, formula)
