"""The studio says what it does: since when, with a button that stops it, and what is old is dimmed."""

from __future__ import annotations

import pytest

from studio_tools import rest

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]

#: A plan that takes some seconds: very slow along the butterfly, a tick each 0.1 ms.
LONG = {"feed": "0.4", "period": "0.1 ms"}

#: Two changes, the second while the first is planned.
CHANGES = """({ period, feed }) => {
  const set = (input, value) => { input.value = value; input.dispatchEvent(new Event("change", { bubbles: true })); };
  new MutationObserver((_, own) => { own.disconnect(); set(document.querySelector("#limit-feed"), feed); })
    .observe(document.body, { attributeFilter: ["data-busy"] });
  set(document.querySelector("#period"), period);
}"""


def test_a_long_plan_says_so_and_stops(opened):
    page = opened()
    assert "Nothing is planned" not in page.inner_text("#verdict")
    rest(page, lambda: (page.fill("#period", LONG["period"]), page.press("#period", "Enter")))
    before = page.inner_text("#cards")
    page.locator("#limits input[type=text]").first.fill(LONG["feed"])
    page.locator("#limits input[type=text]").first.press("Enter")
    page.wait_for_selector("#doing:not([hidden])")
    assert page.locator("#doing-words").inner_text().endswith(" s")
    assert float(page.evaluate("getComputedStyle(document.getElementById('cards')).opacity")) == 0.5
    page.click("#stop-plan")
    page.wait_for_selector("#doing", state="hidden")
    assert page.inner_text("#verdict").startswith("Stopped")
    assert page.inner_text("#cards") == before
    page.fill("#period", "1 ms")
    page.locator("#limits input[type=text]").first.fill("60")
    page.locator("#limits input[type=text]").first.press("Enter")
    page.wait_for_selector("body[data-shown=final]")
    assert "Checked" in page.inner_text("#verdict")


def test_a_change_while_a_plan_is_made_is_still_being_planned_when_the_first_plan_comes(opened):
    page = opened()
    page.evaluate(CHANGES, LONG)
    page.wait_for_selector("body[data-shown=preview]")
    assert page.get_attribute("body", "data-busy") is not None
    page.click("#stop-plan")
    page.wait_for_selector("body[data-shown=stopped]")


def test_all_views_of_the_studio_have_one_time(opened):
    page = opened()
    end = page.evaluate("clock.end")
    page.click("#tab-motion")
    page.wait_for_selector("#figure .readout")
    page.locator(".time-scrub").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("clock.t") == pytest.approx(0.01 * end)
    assert page.evaluate("picture.now.t") == pytest.approx(0.01 * end)
    assert "mm" in page.locator("#figure").inner_text()
    page.get_by_label("speed", exact=True).select_option("20")
    page.click(".time-play")
    page.wait_for_selector(".time-play:has-text('Pause')")
    page.wait_for_selector(".time-play:has-text('Play')")
    assert page.evaluate("clock.t === clock.end")


def test_on_a_telephone_the_settings_are_a_link_away(opened):
    page = opened(390, 800)
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    page.click(".to-settings")
    box = page.locator("#settings").bounding_box()
    assert 0 <= box["y"] < 400
