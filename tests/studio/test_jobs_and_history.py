"""Jobs that take long, pages that come and go, what is remembered, and what a page is for everyone."""

from __future__ import annotations

import re
import sqlite3

import pytest

import splinefeed as sf
from studio_tools import PATIENCE, rest, value

expect = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed").expect
expect.set_options(timeout=PATIENCE)
pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]

#: Every control has a name that a screen reader can say.
NAMELESS = """[...document.querySelectorAll('input, select, textarea, button, canvas, [role=tab]')].filter((each) =>
  !(each.labels?.length || each.getAttribute('aria-label') || each.textContent.trim())).map((each) => each.outerHTML)"""


def test_fifty_megabytes_are_taken_and_read(opened, tmp_path):
    page = opened()
    head = "999\n" + "x" * 1000 + "\n"
    body = "  0\nSECTION\n  2\nENTITIES\n  0\nCIRCLE\n  8\n0\n 10\n0.0\n 20\n0.0\n 40\n10.0\n  0\nENDSEC\n  0\nEOF\n"
    large = tmp_path / "large.dxf"
    large.write_text(head * 50_000 + body)
    assert large.stat().st_size > 50_000_000
    rest(page, lambda: page.set_input_files("#file", str(large)))
    assert page.inner_text("#source-name") == "large.dxf"
    made = sf.run(sf.read(large), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000))
    assert value(page, "duration_s") == made.law.duration


def test_a_link_shows_the_same_to_whoever_opens_it(opened, studio):
    page = opened()
    rest(page, lambda: page.select_option("#machine", "xytheta"))
    page.click("#show-share")
    link = page.input_value("#share-link")
    expect(page.locator("#share-toml")).to_have_value(re.compile(r"\[limits\]"))
    text = page.input_value("#share-toml")
    fragment = link[link.index("#") :]
    other = opened(400, 800, address=f"{studio.address}{fragment}", scheme="dark")
    assert value(other, "contour_error_max_mm") == value(page, "contour_error_max_mm")
    assert other.evaluate("document.scrollingElement.scrollWidth") <= 400
    assert other.evaluate("document.documentElement.dataset.theme") == "dark"
    assert other.evaluate(NAMELESS) == []
    rest(other, lambda: other.select_option("#machine", ""))
    other.click("#show-share")
    other.fill("#share-open", text)
    rest(other, lambda: other.click("#open-text"))
    assert value(other, "contour_error_max_mm") == value(page, "contour_error_max_mm")


def test_plans_are_remembered_opened_compared_and_deleted(opened, studio):
    page = opened()
    rest(page, lambda: (page.fill("#limit-feed", "31"), page.press("#limit-feed", "Enter")))
    took = value(page, "duration_s")
    rest(page, lambda: (page.fill("#limit-feed", "45"), page.press("#limit-feed", "Enter")))
    page.click("#show-history")
    entry = page.locator(".entry").nth(1)
    assert "butterfly" in entry.inner_text()
    rest(page, lambda: entry.get_by_role("button", name="Compare").click())
    assert value(page, "duration_s") == took
    rows = page.locator("#compare tr.setting").all_inner_texts()
    assert rows == ["feed\t45\t31"]
    page.click("#show-history")
    count = page.locator(".entry").count()
    page.locator(".entry").first.get_by_role("button", name="delete").click()
    expect(page.locator(".entry")).to_have_count(count - 1)
    with sqlite3.connect(studio.history) as base:
        assert base.execute("select count(*) from plan").fetchone() == (count - 1,)
    base.close()


def test_a_long_job_outlives_a_refresh_is_seen_by_other_tabs_and_can_be_cancelled(opened):
    page = opened()
    rest(page, lambda: page.select_option("#machine", "xytheta"))
    page.select_option("#tune-rule", "path")
    page.fill("#tune-runs", "5000")
    page.click("#tune-start")
    page.wait_for_selector(".job progress")
    page.reload()
    page.wait_for_selector(".job progress")
    other = opened(1000, 700)  # its plan does not wait for the job of the first
    job = other.locator(".job", has_text="tune xytheta")
    job.get_by_role("button", name="Cancel").click()
    for each in (page, other):
        expect(each.locator(".job", has_text="tune xytheta")).to_have_count(0)
    page.select_option("#tune-rule", "ziegler-nichols")
    page.click("#tune-start")
    page.wait_for_selector(".tuned")
    after = float(page.get_attribute(".tuned", "data-after"))
    assert after < float(page.get_attribute(".tuned", "data-before"))
    rest(page, lambda: page.click("#take-gains"))
    assert value(page, "contour_error_max_mm") == after


def test_tuning_says_when_it_is_worse_and_when_it_is_of_another_motion(opened):
    page = opened()
    rest(page, lambda: page.select_option("#machine", "lintable"))
    assert page.input_value("#tune-kind") == ""  # the controller stays what it is, here P-PI
    page.click("#tune-start")
    page.wait_for_selector(".tuned")
    before, after = (float(page.get_attribute(".tuned", f"data-{when}")) for when in ("before", "after"))
    said = page.inner_text(".tuned")
    assert (": worse. Keep the old gains" in said) == (after > before)
    assert after > before  # a move from rest to rest does not turn back, this path does
    for words in ("kv 60 1/s", "V*s/mm", "may fall", "swing at rest"):
        assert words in said
    assert not page.locator(".tuned.past").count()
    page.click("#tab-spectra")
    page.wait_for_function("() => document.getElementById('figure').data?.some((each) => /new gains/.test(each.name))")
    rest(page, lambda: (page.fill("#limit-feed", "30"), page.press("#limit-feed", "Enter")))
    page.click("#tab-tuning")
    assert "Tuned on the motion before" in page.inner_text(".tuned.past")
