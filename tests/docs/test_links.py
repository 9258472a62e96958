"""Links lead somewhere, and what pages call files are files."""

from __future__ import annotations

import re
import runpy

import pytest

from docs_pages import PAGES, ROOT, blocks, name, prose

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
#: `room/file.py`, `docs/x.md`, `tests/room/` and the like between backticks.
FILE = re.compile(r"`((?:[\w.-]+/)+(?:[\w.-]*\.py)?)`")


def anchors(page) -> set[str]:
    """The anchors of a page's headings, as GitHub and MyST make them."""
    heads = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.strip().lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_resolves(page):
    broken = []
    for target in LINK.findall(prose(page)):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        place = (page.parent / file).resolve() if file else page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            broken.append(target)
    assert not broken


@pytest.mark.parametrize("page", [page for page in PAGES if page.name == "code-overview.md"], ids=name)
def test_files_that_the_overview_names_are_there(page):
    named = FILE.findall(page.read_text(encoding="utf-8"))
    assert len(named) > 30
    missing = [file for file in named if not any((base / file).exists() for base in (ROOT, ROOT / "src/splinefeed"))]
    assert not missing


def test_every_public_name_is_in_the_api_reference():
    import splinefeed as sf

    page = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "docs/api").glob("*.md"))
    page += (ROOT / "docs/api.md").read_text(encoding="utf-8")
    documented = {found.rpartition(".")[2] for found in re.findall(r"auto\w+:: (\S+)", page)}
    documented |= set(re.findall(r"^\| `sf\.(\w+)` \|", page, re.MULTILINE))  # rooms, in their table
    assert set(sf.__all__) - documented - {"__version__", "SplinefeedError"} == set()


def test_every_script_has_its_picture_and_stands_in_the_gallery():
    gallery = ROOT / "docs/gallery"
    scripts = {file.stem for file in gallery.glob("*.py")} - {"draw"}
    draw = runpy.run_path(str(gallery / "draw.py"))
    assert {file.stem for file in gallery.glob("*.svg")} == scripts == {file.stem for file in draw["scripts"]()}
    assert len(scripts) == 25
    assert (gallery / "index.md").read_text(encoding="utf-8") == draw["contents"]()
    for script in draw["scripts"]():
        assert script.with_suffix(".md").read_text(encoding="utf-8") == draw["page"](script)
    for each in draw["NOTEBOOKS"]:
        assert (gallery / f"{each}.ipynb").read_text(encoding="utf-8") == draw["notebook"](gallery / f"{each}.py")
    lengths = sorted(len(file.read_text(encoding="utf-8").splitlines()) for file in draw["scripts"]())
    assert lengths[len(lengths) // 2] <= 60


def test_blocks_that_are_not_run_say_why():
    skipped = [(name(page), block.line) for page in PAGES for block in blocks(page) if block.skipped]
    assert len(skipped) <= 5, skipped
