"""What moves: sliders, playback with its override and hold, and control points."""

from __future__ import annotations

import json
import re

import pytest

import splinefeed as sf
from studio_tools import rest, value

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]


def test_while_a_slider_moves_look_ahead_stands_in_and_says_so(opened):
    page = opened()
    rest(page, lambda: page.select_option("#strategy", "time-optimal"))
    slider = page.locator('[aria-label="feed, slider"]').bounding_box()
    y = slider["y"] + slider["height"] / 2
    page.mouse.move(slider["x"] + 0.5 * slider["width"], y)
    page.mouse.down()
    page.mouse.move(slider["x"] + 0.4 * slider["width"], y)
    page.wait_for_selector("body[data-shown=preview]")
    assert page.inner_text("#shown") == "preview: look-ahead"
    rest(page, page.mouse.up)
    feed = float(page.input_value("#limit-feed"))
    limits = sf.Limits(feed=feed, axis_acceleration=500, axis_jerk=20000)
    made = sf.run(sf.shapes.butterfly(), limits, strategy="time-optimal")
    # what was planned before the button went up may come in between
    page.wait_for_selector(f'#cards dd[data-key="duration_s"][data-value="{made.law.duration}"]')
    assert page.inner_text("#shown") == "time-optimal"
    assert value(page, "lower_bound_s") == made.law.settings["lower_bound_s"]


#: Where the motion is; whether news of it came ten times and it stayed there; whether it is beyond a place.
WHERE = "(/plan time ([0-9.]+)/.exec(document.getElementById('play-state').textContent) ?? [])[1]"
AT_REST = f"""() => {{ const [row, at] = [document.body.dataset.row, {WHERE}];
  if (row === window.rowBefore) return false;
  window.stayed = at === window.atBefore ? (window.stayed ?? 0) + 1 : 0;
  [window.rowBefore, window.atBefore] = [row, at];
  return window.stayed >= 10; }}"""
BEYOND = f"(place) => Number({WHERE}) > place"


def test_it_plays_with_override_and_hold_and_comes_to_rest(opened):
    page = opened()
    # slow enough that no machine is so busy that it misses the end
    rest(page, lambda: (page.fill("#period", "5 ms"), page.press("#period", "Enter")))
    rest(page, lambda: (page.fill("#limit-feed", "1"), page.press("#limit-feed", "Enter")))
    state = page.locator("#play-state")

    def rate(percent: int) -> None:
        page.locator("#play-state", has_text=f"rate {percent} %").wait_for()

    page.click("#play")
    rate(100)
    page.evaluate("const o = document.getElementById('override'); o.value = 50; o.dispatchEvent(new Event('input'))")
    rate(50)
    page.click("#hold")
    rate(0)
    page.wait_for_function(AT_REST, polling=50)
    where = float(page.evaluate(WHERE))
    assert 0.0 < where < 350.0  # of some 383 s
    page.click("#hold")
    rate(50)
    page.wait_for_function(BEYOND, arg=where)
    page.click("#stop")
    page.wait_for_selector("body[data-played]")
    assert re.fullmatch(r"stopped at plan time [0-9.]+ s: \d+ rows, \d+ late", state.inner_text())
    assert page.is_enabled("#play")


def test_control_points_are_moved_by_table_and_by_hand_and_back(opened):
    page = opened()
    rest(page, lambda: (page.fill("#shape", "circle?radius=10"), page.press("#shape", "Enter")))
    before = value(page, "duration_s")
    page.click("#edit")
    weight = page.locator('#editor tr[data-point="1"] input').nth(2)
    rest(page, lambda: (weight.fill("0.5"), weight.press("Tab")))
    document = json.loads(page.evaluate("JSON.parse(sessionStorage.settings).source.curves"))
    assert document["weights"][1] == 0.5
    curve = sf.NurbsCurve(document["degree"], document["knots"], document["control_points"], document["weights"])
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    assert value(page, "duration_s") == sf.run(sf.Path([curve]), limits).law.duration
    rest(page, lambda: page.click("#undo"))
    assert value(page, "duration_s") == before
    # the corner beyond the upper right of the circle, where the picture has it
    point = document["control_points"][1]
    page.evaluate("scrollTo(0, 0)")  # from under the bar at the top
    box = page.locator("#path").bounding_box()
    at = page.evaluate("([x, y]) => window.picture?.view.screen(x, y, 0)", point)
    assert at, "the page tells where its points are"
    page.mouse.move(box["x"] + at[0], box["y"] + at[1])
    page.mouse.down()
    page.mouse.move(box["x"] + at[0] - 30, box["y"] + at[1] + 20)
    rest(page, page.mouse.up)
    moved = json.loads(page.evaluate("JSON.parse(sessionStorage.settings).source.curves"))["control_points"][1]
    assert moved[0] < point[0] - 1.0
    assert moved[1] < point[1] - 0.5
