"""What stands between markers on a page is made by the script that they name, and nothing that it makes is missing."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys

import pytest
from benchmarks import __main__ as benchmarks

from docs_pages import PAGES, ROOT, name

#: A line of its own: on pages that tell of markers they stand within one.
MARKER = re.compile(r"^<!-- (/?)(\w+):([\w-]+) -->$", re.MULTILINE)
#: The names of the parts that a script fills, as the calls that fill them have them.
FILLED = re.compile(r"""(?:\bput\(|@tells\(|write_into\(PAGE, )"([\w-]+)\"""")
#: Programs of the tests that fill parts as the benchmarks do.
MAKERS = ("torture.py",)
FIGURES = ROOT / "docs" / "figures"


def parts(maker: str) -> set[str]:
    """Names of the parts that a maker fills."""
    if maker == "benchmarks":
        others = [(ROOT / "tests" / file).read_text(encoding="utf-8") for file in MAKERS]
        return {*benchmarks.NAMES, "speed", *(found for text in others for found in FILLED.findall(text))}
    script = FIGURES / f"{maker}.py"
    return set(FILLED.findall(script.read_text(encoding="utf-8"))) if script.exists() else set()


def marked(page) -> list[tuple[str, str, str]]:
    return MARKER.findall(page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_markers_come_in_pairs_and_name_a_script_that_fills_them(page):
    found = marked(page)
    opening, closing = found[::2], found[1::2]
    assert [("/", *rest) for _, *rest in opening] == closing
    assert all(slash == "" for slash, _, _ in opening)
    unknown = [(maker, part) for _, maker, part in opening if part not in parts(maker)]
    assert not unknown


@pytest.mark.parametrize("script", sorted(FIGURES.glob("*.py")), ids=lambda script: script.stem)
def test_each_part_that_a_script_fills_stands_on_one_page(script):
    placed = [part for page in PAGES for slash, maker, part in marked(page) if maker == script.stem and not slash]
    assert sorted(placed) == sorted(parts(script.stem))


def test_each_benchmark_has_its_place():
    placed = {part for page in PAGES for _, maker, part in marked(page) if maker == "benchmarks"}
    assert placed == parts("benchmarks")


#: `override` measures 200 random holds to the millisecond, which the last bit of a plan moves: it is not compared.
LONG = [pytest.param(script, marks=pytest.mark.slow) for script in ("paper", "tune")]


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("script", ["interpolators", "milne_simpson", "sentences", *LONG])
def test_a_script_that_runs_again_leaves_its_pages_as_they_are(script, tmp_path):
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    shutil.copytree(ROOT / "benchmarks", tmp_path / "benchmarks", ignore=shutil.ignore_patterns("suite", "__pycache__"))
    words = [sys.executable, tmp_path / "docs" / "figures" / f"{script}.py"]
    ran = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    for page in (ROOT / "docs").rglob("*.md"):
        again = tmp_path / page.relative_to(ROOT)
        assert again.read_text(encoding="utf-8") == page.read_text(encoding="utf-8"), page
