"""What stands between markers on a page is made by the script that they name, and nothing that it makes is missing."""

from __future__ import annotations

import re
import runpy

import pytest
from benchmarks import __main__ as benchmarks

from docs_pages import PAGES, ROOT, name

#: A line of its own: on pages that tell of markers they stand within one.
MARKER = re.compile(r"^<!-- (/?)(\w+):([\w-]+) -->$", re.MULTILINE)
#: The names of the parts that a script fills, as the calls that fill them have them.
FILLED = re.compile(r"""(?:\bput\(|@tells\(|write_into\(PAGE, )"([\w-]+)\"""")
FIGURES = ROOT / "docs" / "figures"


def parts(maker: str) -> set[str]:
    """Names of the parts that a maker fills."""
    if maker == "benchmarks":
        others = [(ROOT / "tests" / file).read_text(encoding="utf-8") for file in ("lines.py", "mutants.py")]
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


def run(script, monkeypatch) -> dict:
    monkeypatch.syspath_prepend(FIGURES)
    return runpy.run_path(str(FIGURES / script))


def assert_stands(page, maker: str, part: str, made: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert f"<!-- {maker}:{part} -->\n{made}\n<!-- /{maker}:{part} -->" in text


@pytest.mark.parametrize("part", ["pieces", "nose", "pulses", "slow-clock", "velocities"])
def test_sentences_are_those_that_their_script_makes(part, monkeypatch):
    made, page = run("sentences.py", monkeypatch)["SENTENCES"][part]
    assert_stands(page, "sentences", part, made())


def test_the_numbers_of_the_interpolators_page_are_those_of_its_script(monkeypatch):
    for part, made in run("interpolators.py", monkeypatch)["told"]().items():
        assert_stands("math/interpolators.md", "interpolators", part, made)
