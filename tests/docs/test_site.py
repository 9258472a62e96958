"""The site builds without a warning, offline, and the pictures of its gallery can be drawn."""

from __future__ import annotations

import runpy
import subprocess
import sys

import pytest

from docs_pages import ROOT

sphinx = pytest.importorskip("sphinx", reason="Sphinx is not installed: pip install splinefeed[docs]")
pytest.importorskip("myst_parser")
pytest.importorskip("furo")


def test_the_site_builds_without_a_warning_and_loads_nothing_from_elsewhere(tmp_path):
    words = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    built = subprocess.run([*words, ROOT / "docs", tmp_path / "site"], capture_output=True, text=True, timeout=240)
    assert built.returncode == 0, built.stderr
    page = (tmp_path / "site/api.html").read_text(encoding="utf-8")
    assert "Raises CurveError" in page
    for line in page.split("<"):
        if line.startswith(("script", "link", "img")):
            assert "http" not in line.split(">")[0].replace('rel="canonical"', ""), line


@pytest.mark.parametrize("name", ["override", "short_lines"])
def test_pictures_of_the_gallery_can_be_drawn(name):
    figure = runpy.run_path(str(ROOT / f"docs/gallery/{name}.py"))["picture"]()
    assert all(axes.lines for axes in figure.axes)


@pytest.mark.torture
def test_every_picture_of_the_gallery_can_be_drawn(tmp_path):
    draw = runpy.run_path(str(ROOT / "docs/gallery/draw.py"))
    for script in draw["scripts"]():
        assert runpy.run_path(str(script))["picture"]().axes, script
