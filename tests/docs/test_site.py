"""The site builds without a warning, offline, and the pictures of its gallery can be drawn."""

from __future__ import annotations

import runpy
import shutil
import subprocess
import sys

import pytest

from docs_pages import ROOT

pytestmark = pytest.mark.slow

sphinx = pytest.importorskip("sphinx", reason="Sphinx is not installed: pip install splinefeed[docs]")
pytest.importorskip("myst_parser")
pytest.importorskip("furo")


def test_the_site_builds_without_a_warning_and_loads_nothing_from_elsewhere(tmp_path):
    words = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    built = subprocess.run([*words, ROOT / "docs", tmp_path / "site"], capture_output=True, text=True, timeout=240)
    assert built.returncode == 0, built.stderr
    page = (tmp_path / "site/api/nurbs-curve.html").read_text(encoding="utf-8")
    assert "<strong>CurveError</strong></a>" in page
    assert "C(u) = sum_i N_i,p(u) w_i P_i / sum_i N_i,p(u) w_i\n" in page
    assert "Where C' = 0, the limit" in page
    assert "docs/check.md</span></a>" in (tmp_path / "site/api/check.html").read_text(encoding="utf-8")
    for line in page.split("<"):
        if line.startswith(("script", "link", "img")):
            assert "http" not in line.split(">")[0].replace('rel="canonical"', ""), line


#: Widths of the page and of its text, and what sticks out of the text without a scroller of its own.
WIDTHS = """() => {
    const text = document.querySelector(".content"), edge = text.getBoundingClientRect().right + 0.5;
    const scrolls = (e) => e !== text && (getComputedStyle(e).overflowX !== "visible" || scrolls(e.parentElement));
    const out = [...text.querySelectorAll("*")].filter((e) => {
        const box = e.getBoundingClientRect();
        return box.width > 0 && box.right > edge && !scrolls(e.parentElement);
    });
    const root = document.documentElement;
    return [root.scrollWidth - root.clientWidth, text.scrollWidth - text.clientWidth, out.map((e) => e.outerHTML)];
}"""


@pytest.mark.browser
def test_pages_fit_windows_of_every_width(chromium, tmp_path):
    """Long code, wide tables and formulas scroll inside themselves: a page that is wider is cut at its right."""
    docs = tmp_path / "docs"
    shutil.copytree(ROOT / "docs/_static", docs / "_static")
    pages = ("math/override.md", "tests.md", "benchmarks/planning.md")
    for page in ("conf.py", *pages):
        (docs / page).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / "docs" / page, docs / page)
    contents = "\n".join(page.removesuffix(".md") for page in pages)
    (docs / "index.md").write_text(f"# Pages\n\n```{{toctree}}\n{contents}\n```\n", encoding="utf-8")
    words = [sys.executable, "-m", "sphinx", "-Q", "-b", "html", docs, tmp_path / "site"]
    subprocess.run(words, check=True, timeout=240)
    for width in (1400, 1312, 1100, 1008, 800, 400):
        page = chromium.new_page(viewport={"width": width, "height": 900})
        for name in pages:
            page.goto((tmp_path / "site" / name).with_suffix(".html").as_uri())
            assert page.evaluate(WIDTHS) == [0, 0, []], (width, name)
        page.close()


@pytest.mark.browser
def test_figures_are_dark_where_the_page_is(chromium, tmp_path):
    docs = tmp_path / "docs"
    shutil.copytree(ROOT / "docs/_static", docs / "_static")
    for file in ("conf.py", "figures/overview.svg"):
        (docs / file).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / "docs" / file, docs / file)
    (docs / "index.md").write_text("# A page\n\n![a figure](figures/overview.svg)\n", encoding="utf-8")
    words = [sys.executable, "-m", "sphinx", "-Q", "-b", "html", docs, tmp_path / "site"]
    subprocess.run(words, check=True, timeout=240)
    for system, theme, dark in (("light", "dark", True), ("dark", "light", False), ("dark", "auto", True)):
        page = chromium.new_page(viewport={"width": 1000, "height": 800}, color_scheme=system)
        page.goto((tmp_path / "site/index.html").as_uri())
        page.evaluate(f"document.body.dataset.theme = '{theme}'")
        box = page.locator("article img").bounding_box()
        corner = {"x": box["x"] + 3, "y": box["y"] + 3, "width": 2, "height": 2}
        alike = page.screenshot(clip={**corner, "x": box["x"] - 8}) == page.screenshot(clip=corner)
        assert alike, (system, theme)
        sent = page.evaluate("getComputedStyle(document.querySelector('article img')).colorScheme")
        assert (sent == "dark") is dark
        page.close()


def test_every_picture_of_the_gallery_can_be_drawn(tmp_path):
    draw = runpy.run_path(str(ROOT / "docs/gallery/draw.py"))
    for script in draw["scripts"]():
        assert draw["drawn"](script).panels, script  # each asserts a number


#: Screens that a page may be long; the index is a list of names.
SCREENS = 10


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.timeout(900)
def test_no_page_is_taller_than_ten_screens_and_formulas_are_typeset(chromium, tmp_path):
    words = [sys.executable, "-m", "sphinx", "-Q", "-b", "html", ROOT / "docs", tmp_path / "site"]
    subprocess.run(words, check=True, timeout=600)
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    tall, formulas = [], 0
    for file in sorted((tmp_path / "site").rglob("*.html")):
        page.goto(file.as_uri())
        high = page.evaluate("document.documentElement.scrollHeight")
        tall += [file.name] if high > 900 * SCREENS else []
        formulas += page.locator("math").count()
    page.close()
    assert tall == []
    assert formulas > 25
