"""report.html in a browser, opened from a file: it draws, it tells, it fits, it prints, and it complains of nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest

import motions
import splinefeed as sf
from splinefeed.report.html import page
from splinefeed.report.record import record

pytestmark = pytest.mark.browser

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_acceleration=450, axis_jerk=18000)


@pytest.fixture(scope="module")
def address(tmp_path_factory) -> str:
    """A report with everything in it, as a file."""
    path = motions.smooth()
    run = sf.run(path, LIMITS, strategy="look-ahead")
    response = sf.follow(run.points, sf.Table.load("xytheta"), path=path)
    traces = list(sf.compare(path, run.law, methods=["taylor-2", "arc-length"]))
    said = record(run, traces, "smooth.json", {}, ["hdf5"])
    said["contour_error_max_mm"] = float(response.contour_error.max())
    said["tracking_error_max"] = {"x": float(abs(response.tracking_error[:, 0]).max())}
    file = tmp_path_factory.mktemp("report") / "report.html"
    results = [each.result for each in traces]
    file.write_text(page(run, said, results, {"arc-length": response, "taylor-2": response}), encoding="utf-8")
    return file.as_uri()


@pytest.fixture
def opened(chromium, address) -> Iterator[Any]:
    """Open the report; no network is there, and what the console says fails the test."""
    contexts, said = [], []

    def open_page(width: int = 1280, height: int = 900, scheme: str = "light") -> Any:
        context = chromium.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, offline=True)
        contexts.append(context)
        shown = context.new_page()
        shown.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        shown.on("pageerror", lambda error: said.append(str(error)))
        shown.goto(address)
        shown.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        return shown

    yield open_page
    for context in contexts:
        context.close()
    assert said == []


def lines_of(drawn: Any) -> str:
    """The text of a drawing, a line for each of its own."""
    return "\n".join(drawn.locator("text, tspan.line").all_text_contents())


def test_all_figures_are_drawn_and_the_first_screen_tells_what_came_out(opened):
    shown = opened()
    for name in ("path", "motion", "errors", "spectra", "binding"):
        assert shown.locator(f"#{name} .main-svg").count() > 0
    for words in ("cycle time", "largest share", "feed ripple", "contour error", "tracking error x"):
        box = shown.locator(".cards").get_by_text(words, exact=True).bounding_box()
        assert box["y"] + box["height"] < 900, words
    verdict = shown.locator(".verdict")
    assert "every limit holds" in verdict.inner_text()
    assert verdict.evaluate("e => getComputedStyle(e).color") == "rgb(0, 112, 79)"


def test_hovering_over_the_path_tells_time_place_parameter_and_feed(opened):
    shown = opened()
    shown.evaluate("document.getElementById('path').scrollIntoView({block: 'center'})")
    place = shown.evaluate(
        """() => { const p = document.getElementById("path"), d = p._fullData[1], k = 40, l = p._fullLayout;
        const box = p.getBoundingClientRect();
        return [box.x + l.xaxis._offset + l.xaxis.c2p(d.x[k]), box.y + l.yaxis._offset + l.yaxis.c2p(d.y[k])]; }"""
    )
    shown.mouse.move(*place, steps=3)
    shown.wait_for_selector("#path .hovertext")
    told = lines_of(shown.locator("#path .hovertext"))
    for name in ("t = ", "s = ", "u = ", "feed = ", "x = ", "y = "):
        assert re.search(rf"{name}-?[0-9.]+", told), (name, told)


def test_one_cursor_runs_through_all_panels_over_time(opened):
    shown = opened(height=1400)
    shown.evaluate("document.getElementById('motion').scrollIntoView({block: 'start'})")
    box = shown.locator("#motion").bounding_box()
    shown.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 120, steps=3)
    shown.wait_for_selector("#motion .hoverlayer .legend, #motion .hoverlayer .hovertext")
    told = lines_of(shown.locator("#motion .hoverlayer"))
    for name in ("s", "feed", "acceleration", "jerk", "x velocity", "y jerk"):
        assert re.search(rf"^{name}\s*:", told, re.MULTILINE), (name, told)
    assert shown.locator("#motion .spikeline").count() > 0


def test_the_colour_of_the_path_is_chosen(opened):
    shown = opened()
    for name in ("curvature", "contour error", "share of axis jerk x"):
        shown.select_option("#colour", name)
        title = shown.evaluate("document.getElementById('path')._fullData[1].marker.colorbar.title.text")
        assert name.removeprefix("share of ") in title


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_telephone_in_light_and_dark(opened, scheme):
    shown = opened(400, 800, scheme)
    assert shown.evaluate("document.documentElement.scrollWidth") == 400
    paper = "rgb(255, 255, 255)" if scheme == "light" else "rgb(21, 24, 27)"
    assert shown.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    assert (
        shown.evaluate("document.getElementById('path')._fullLayout.paper_bgcolor").lower()
        == {
            "light": "#ffffff",
            "dark": "#15181b",
        }[scheme]
    )
    shown.get_by_role("button", name="light and dark").click()
    assert shown.evaluate("getComputedStyle(document.body).backgroundColor") != paper


def test_it_prints_white_and_whole(opened):
    shown = opened(scheme="dark")
    shown.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert shown.evaluate("document.getElementById('motion')._fullLayout.paper_bgcolor").lower() == "#ffffff"
    shown.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert shown.evaluate("document.getElementById('motion')._fullLayout.paper_bgcolor").lower() == "#15181b"
    pages = len(re.findall(rb"/Type\s*/Page\b", shown.pdf(format="A4", print_background=True)))
    assert 3 <= pages <= 12
