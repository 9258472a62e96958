"""Every bound of docs/security.md has a file that is beyond it, or a test that holds it."""

from __future__ import annotations

import re
from pathlib import Path

import beyond_bounds
from docs_pages import ROOT

TESTS = Path(__file__).parent


def test_every_bound_of_the_page_is_tried() -> None:
    page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    table = page[page.index("| what | bound |") :].partition("\n\n")[0]
    bounds = {line.split("|")[1].strip().replace("`", "") for line in table.splitlines()[2:]}
    tried = {what.partition(":")[0] for what in (*beyond_bounds.HELD, *(what for what, *_ in beyond_bounds.BOUNDS))}
    assert "studio" in bounds and len(bounds) > 15
    assert {bound.replace(" of stream", "") for bound in bounds} == tried
    measured = set(re.findall(r"^\| (.*?) +\|", page[page.index("| a file with") :], re.MULTILINE))
    assert {what for what, *_ in beyond_bounds.BOUNDS} <= measured


def test_the_tests_that_hold_bounds_are_there() -> None:
    for tests in beyond_bounds.HELD.values():
        for test in tests:
            file, _, name = test.partition("::")
            assert f"def {name}(" in (TESTS / file).read_text(encoding="utf-8"), test
