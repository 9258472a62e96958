"""Report and studio for everyone: by keys alone, words that can be read, on a telephone; the loop beside its steps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import splinefeed as sf
from studio_tools import PATIENCE

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]

ACCESS = (Path(__file__).parent.parent / "access.js").read_text(encoding="utf-8")
#: A program with two tools.
PROGRAM = """G21 G90 G94
T1 M6
G0 X0 Y0 Z5
G1 Z-1 F300
X40 F1200
Y30
X0
Y0
G0 Z5
T2 M6
G0 X10
G1 Z-2 F200
G0 Z5
M30
"""


def ask(page: Any, function: str, given: Any = None) -> Any:
    """What a function of access.js says of a page."""
    call = f"{function}(given)" if given is not None else f"{function}()"
    return page.evaluate(f"(given) => {{ {ACCESS}\nreturn {call}; }}", given)


def walk(page: Any) -> None:
    """Tab through all that can have the focus: everything is reached, and shows that it is."""
    wanted = set(ask(page, "reachable"))
    assert len(wanted) > 5
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0)")
    seen = set()
    for _ in range(2 * len(wanted) + 5):
        page.keyboard.press("Tab")
        stop, shown, what = ask(page, "here")
        assert shown, what
        seen.add(stop)
    missed = ask(page, "named", sorted(wanted - seen))
    assert missed == []


@pytest.fixture
def report(tmp_path, chromium) -> Iterator[Any]:
    """Opens the report of a program or of a run with a machine."""
    contexts = []

    def show(width: int = 1280, scheme: str = "light", program: bool = False) -> Any:
        name = tmp_path / ("program" if program else "run")
        if program:
            file = tmp_path / "part.nc"
            file.write_text(PROGRAM)
            run = sf.run(sf.read(file), sf.Limits(feed=100, acceleration=500, jerk=20000))
        else:
            run = sf.run(
                sf.shapes.butterfly(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000), machine="xytheta"
            )
        if not name.exists():
            sf.report(run, name)
        context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto((name / "report.html").as_uri())
        page.wait_for_selector("html[data-ready=yes]")
        return page

    yield show
    for each in contexts:
        each.close()


@pytest.mark.parametrize("program", [False, True], ids=["run", "program"])
def test_the_report_is_read_by_keys_alone(report, program):
    walk(report(program=program))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("program", [False, True], ids=["run", "program"])
def test_words_of_the_report_can_be_read(report, scheme, program):
    assert ask(report(scheme=scheme, program=program), "faint") == []


@pytest.mark.parametrize("program", [False, True], ids=["run", "program"])
def test_the_report_fits_on_a_telephone(report, program):
    assert report(390, program=program).evaluate("document.documentElement.scrollWidth") == 390


def test_the_studio_is_used_by_keys_alone(opened):
    page = opened()
    page.set_default_timeout(60_000)
    walk(page)
    feed = page.locator("#limits input[type=text]").first
    feed.focus()
    page.keyboard.press("Control+A")
    page.keyboard.type("50")
    page.evaluate("document.body.dataset.shown = 'waiting'")
    page.keyboard.press("Enter")
    page.wait_for_selector("body[data-shown=final]:not([data-busy])")
    page.locator("#tabs [aria-selected=true]").focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#tab-motion").get_attribute("aria-selected") == "true"
    page.locator("#path").focus()
    before = page.evaluate("picture.view.scaleX")
    page.keyboard.press("+")
    assert page.evaluate("picture.view.scaleX") == pytest.approx(1.25 * before)
    page.keyboard.press("0")
    page.locator(".time-play").focus()
    page.keyboard.press("Space")
    page.wait_for_selector(".time-play:has-text('Pause')")
    page.keyboard.press("Space")
    page.locator("#show-history").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog[open]", state="detached")
    page.locator("#save").focus()
    page.keyboard.press("Enter")
    page.get_by_text("Report, HTML").focus()
    with page.expect_download() as found:
        page.keyboard.press("Enter")
    assert found.value.suggested_filename == "report.html"


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_of_the_studio_can_be_read(opened, theme):
    page = opened()
    page.set_default_timeout(60_000)
    if page.evaluate("document.documentElement.dataset.theme") != theme:
        page.click("#theme")
    for tab in page.locator("#tabs button").all():
        tab.click()
        page.wait_for_timeout(300)
        assert ask(page, "faint") == []
    for name in ("#show-history", "#show-share"):
        page.click(name)
        page.wait_for_selector("dialog[open]")
        assert ask(page, "faint") == []
        page.keyboard.press("Escape")


def test_the_studio_fits_on_a_telephone(opened):
    page = opened(390, 800)
    for tab in page.locator("#tabs button").all():
        tab.click()
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") == 390
    for name in ("#show-history", "#show-share"):
        page.click(name)
        box = page.locator("dialog[open]").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        page.keyboard.press("Escape")


def test_loops_stand_beside_steps(opened):
    page = opened()
    page.set_default_timeout(60_000)
    page.select_option("#machine", "xytheta")
    page.wait_for_selector("body[data-shown=final]:not([data-busy])")
    page.click("#tune-start")
    page.wait_for_selector("#beside .main-svg")
    steps, loops = (page.locator(each).bounding_box() for each in ("#figure", "#beside"))
    assert steps["y"] == loops["y"]
    assert steps["x"] + steps["width"] <= loops["x"]
    assert "x: loop gain (dB)" in page.locator("#beside").text_content()
    page.click("#tab-motion")
    page.wait_for_selector("#beside", state="hidden")
