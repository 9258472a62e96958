"""report.html in a browser, opened from a file: it draws, it tells, it fits, it prints, and it complains of nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.reports.files import of_run
from splinefeed.reports.html import page
from splinefeed.reports.record import about, record
from studio_tools import PATIENCE

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_acceleration=450, axis_jerk=18000)


@pytest.fixture(scope="module")
def address(tmp_path_factory) -> str:
    """A report with everything in it, as a file."""
    path = motions.smooth()
    run = sf.run(path, LIMITS, strategy="look-ahead")
    response = sf.runs.follow(run.points, sf.Machine.load("xytheta"), path=path)
    traces = list(sf.runs.compare(path, run.law, methods=["taylor-2", "arc-length"]))
    said = record(run, about(run.settings, "smooth.json", {}, ["hdf5"]), traces)
    said["contour_error_max_mm"] = float(response.contour_error.max())
    said["tracking_error_max"] = {"x": float(abs(response.tracking_error[:, 0]).max())}
    file = tmp_path_factory.mktemp("report") / "report.html"
    results = [each.result for each in traces]
    figures = of_run(run, {"arc-length": response, "taylor-2": response})
    file.write_text(page(run, said, figures, results), encoding="utf-8")
    return file.as_uri()


@pytest.fixture(scope="module")
def in_space(tmp_path_factory) -> str:
    """The report of a helix, as a file."""
    run = sf.run(sf.shapes.helix(), LIMITS, strategy="look-ahead")
    file = tmp_path_factory.mktemp("report") / "helix.html"
    file.write_text(page(run, record(run, about(run.settings, "helix", {}, ["hdf5"])), of_run(run)), encoding="utf-8")
    return file.as_uri()


#: What Chromium says of drawing in space without a graphics card, which is not about the page.
NO_CARD = re.compile(r"GL Driver Message|willReadFrequently|software WebGL|SwiftShader", re.IGNORECASE)


@pytest.fixture
def opened(chromium, address) -> Iterator[Any]:
    """Open the report; no network is there, and what the console says fails the test."""
    contexts, said = [], []

    def hear(message: Any) -> None:
        if message.type in ("error", "warning") and not NO_CARD.search(message.text):
            said.append(message.text)

    def open_page(width: int = 1280, height: int = 900, scheme: str = "light", address: str = address) -> Any:
        context = chromium.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, offline=True)
        contexts.append(context)
        shown = context.new_page()
        shown.set_default_timeout(PATIENCE)
        shown.on("console", hear)
        shown.on("pageerror", lambda error: said.append(str(error)))
        shown.goto(address)
        shown.wait_for_selector("html[data-ready=yes]", timeout=PATIENCE)
        return shown

    yield open_page
    for context in contexts:
        context.close()
    assert said == []


#: Where a point of the path is on the screen.
ON_PATH = """(k) => { const box = document.getElementById("path").getBoundingClientRect(), [x, y] = picture.at(k);
  return [box.x + x, box.y + y]; }"""


def test_all_figures_are_drawn_and_the_first_screen_tells_what_came_out(opened):
    shown = opened()
    for name in ("motion", "errors", "spectra", "limits"):
        assert shown.locator(f"#{name} .main-svg").count() > 0
    assert shown.evaluate("picture.points.x.length") > 1000
    for words in ("cycle time", "largest share", "feed ripple", "contour error", "following error x"):
        box = shown.locator(".cards").get_by_text(words, exact=True).bounding_box()
        assert box["y"] + box["height"] < 900, words
    verdict = shown.locator(".verdict")
    assert "every limit holds" in verdict.inner_text()
    assert verdict.evaluate("e => getComputedStyle(e).color") == "rgb(0, 112, 79)"


def test_hovering_over_the_path_tells_time_place_parameter_and_feed(opened):
    shown = opened()
    shown.evaluate("document.getElementById('path').scrollIntoView({block: 'center'})")
    shown.mouse.move(*shown.evaluate(ON_PATH, 40), steps=3)
    told = shown.locator("#hover").inner_text()
    for name in ("t ", "s ", "u ", "feed ", "x ", "y "):
        assert re.search(rf"{name}-?[0-9.]+", told), (name, told)


def test_one_cursor_runs_through_all_views(opened, address):
    shown = opened(height=1400)
    shown.evaluate("document.getElementById('motion').scrollIntoView({block: 'start'})")
    box = shown.locator("#motion").bounding_box()
    shown.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 120, steps=3)
    t = shown.evaluate("clock.t")
    assert 0.3 < t / shown.evaluate("clock.end") < 0.7
    run = sf.run(motions.smooth(), LIMITS, strategy="look-ahead")
    readouts = shown.locator("#motion .readout")
    assert float(readouts.nth(0).inner_text()) == pytest.approx(float(run.law(t)), rel=6e-3)
    assert "feed" in readouts.nth(1).inner_text()
    assert re.search(r"x -?[0-9.]+\D+y -?[0-9.]+", readouts.nth(4).text_content())
    for name in ("motion", "limits", "errors"):
        at = "(id) => { const p = document.getElementById(id); return [p._fullLayout.xaxis, p.querySelector('.cursor')]"
        at += ".reduce((x, c) => x.p2l(parseFloat(c.style.left) - x._offset)); }"
        assert shown.evaluate(at, name) == pytest.approx(t, abs=1e-4)
    place = [np.interp(t, run.points.t, column) for column in run.points.position.T]
    assert shown.evaluate("picture.tool.slice(0, 2)") == pytest.approx(place, abs=1e-3)
    assert f"{t:.3f} of" in shown.locator(".time-now").inner_text()


def test_it_plays_to_the_end_and_is_scrubbed_by_keys(opened):
    shown = opened()
    end = shown.evaluate("clock.end")
    shown.locator(".time-scrub").focus()
    shown.keyboard.press("ArrowRight")
    assert shown.evaluate("clock.t") == pytest.approx(0.01 * end)
    shown.get_by_label("speed").select_option("20")
    shown.locator(".time-play").click()
    shown.wait_for_function("clock.t === clock.end && !clock.playing")
    assert shown.locator(".time-play").inner_text() == "▶ Play"


def test_zooming_one_time_axis_zooms_all(opened):
    shown = opened()
    shown.evaluate("Plotly.relayout('limits', {'xaxis.range[0]': 0.2, 'xaxis.range[1]': 0.3})")
    for name in ("motion", "errors"):
        shown.wait_for_function("(id) => document.getElementById(id)._fullLayout.xaxis.range[0] === 0.2", arg=name)
    assert "every one is drawn" in shown.locator("#motion + .told").inner_text()
    shown.evaluate("Plotly.relayout('motion', {'xaxis.autorange': true})")
    shown.wait_for_function("document.getElementById('limits')._fullLayout.xaxis.range[0] <= 0")


def test_the_colour_of_the_path_is_chosen(opened):
    shown = opened()
    for name in ("curvature", "contour error", "share of axis jerk x"):
        shown.select_option("#colour", name)
        shown.wait_for_function(
            "(name) => document.getElementById('path').ariaLabel.includes(`coloured by ${name}`)",
            arg=name.removeprefix("share of "),
        )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_telephone_in_light_and_dark(opened, scheme):
    shown = opened(400, 800, scheme)
    assert shown.evaluate("document.documentElement.scrollWidth") == 400
    paper = "rgb(255, 255, 255)" if scheme == "light" else "rgb(21, 24, 27)"
    assert shown.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    drawn = shown.evaluate("document.getElementById('motion')._fullLayout.paper_bgcolor").lower()
    assert drawn == {"light": "#ffffff", "dark": "#15181b"}[scheme]
    shown.get_by_role("button", name="light and dark").click()
    assert shown.evaluate("getComputedStyle(document.body).backgroundColor") != paper


@pytest.mark.parametrize(("width", "scheme"), [(1280, "dark"), (400, "light")])
def test_a_path_in_space_is_drawn_whole_and_tells_where_it_is(opened, in_space, width, scheme):
    shown = opened(width, 900, scheme, in_space)
    figure = shown.locator("#path")
    figure.scroll_into_view_if_needed()
    box = figure.bounding_box()
    count = shown.evaluate("picture.points.x.length")
    for k in range(0, count, count // 20):
        x, y = shown.evaluate(ON_PATH, k)
        assert box["x"] < x < box["x"] + box["width"]
        assert box["y"] < y < box["y"] + box["height"]
    shown.mouse.move(*shown.evaluate(ON_PATH, count // 2), steps=3)
    told = shown.locator("#hover").inner_text()
    for name in ("t ", "s ", "u ", "feed ", "x ", "y ", "z "):
        assert re.search(rf"{name}-?[0-9.]+", told), (name, told)


def contrast(one: str, other: str) -> float:
    """WCAG's contrast of two colours, #rrggbb, https://www.w3.org/TR/WCAG22/#dfn-contrast-ratio."""

    def luminance(colour: str) -> float:
        parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))

    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


#: A colour of the page, and the colours of the lines of a figure.
STYLE = "(name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()"
LINES = "(id) => document.getElementById(id).data.map((each) => each.line?.color).filter((c) => typeof c === 'string')"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_and_lines_stand_out_from_the_paper(opened, scheme):
    shown = opened(scheme=scheme)
    worn = {name: shown.evaluate(STYLE, name) for name in ("ink", "faint", "good", "bad", "bar", "paper", "panel")}
    for paper in (worn["paper"], worn["panel"]):
        for name in ("ink", "faint", "good", "bad"):
            assert contrast(worn[name], paper) >= 4.5, (name, paper)
    lines = [colour for name in ("motion", "errors", "spectra") for colour in shown.evaluate(LINES, name)]
    assert len(lines) > 10
    for colour in {*lines, worn["bar"]}:
        assert contrast(colour, worn["paper"]) >= 3.0, colour


#: Width, height and colour of a figure as it is drawn.
LAYOUT = "(id) => ((l) => [l.width, l.height, l.paper_bgcolor])(document.getElementById(id)._fullLayout)"


def test_it_prints_white_and_whole(opened):
    shown = opened(scheme="dark")
    shown.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    for name in ("motion", "errors", "spectra", "limits"):
        width, height, paper = shown.evaluate(LAYOUT, name)
        assert paper.lower() == "#ffffff"
        assert width <= 700  # A4 has 718 pixels between its margins, and 1047 from top to bottom
        assert height <= 1000
    shown.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert shown.evaluate("document.getElementById('motion')._fullLayout.paper_bgcolor").lower() == "#15181b"
    shown.wait_for_function("document.getElementById('motion')._fullLayout.width > 1000")
    pages = len(re.findall(rb"/Type\s*/Page\b", shown.pdf(format="A4", print_background=True)))
    assert 3 <= pages <= 7


def test_the_mouse_tells_values_to_three_digits_with_their_units(opened):
    shown = opened()
    shown.evaluate("document.getElementById('path').scrollIntoView({block: 'center'})")
    shown.mouse.move(*shown.evaluate(ON_PATH, 40), steps=3)
    told = shown.locator("#hover").inner_text()
    assert re.search(r"t \d+\.\d{3} s, s \d+\.\d{3} mm", told)
    assert re.search(r"x -?\d+\.\d{3}, y -?\d+\.\d{3} mm", told)
    assert re.search(r"feed [\d.]{1,4} mm/s", told)
    shown.evaluate("Plotly.Fx.hover('spectra', [{curveNumber: 0, pointNumber: 50}])")
    shown.wait_for_selector("#spectra .hovertext")
    assert re.search(r"at [\d.]{1,4} Hz", shown.locator("#spectra .hovertext").first.text_content())
