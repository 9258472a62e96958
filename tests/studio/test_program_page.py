"""A program in a browser: its text, its path, and what is chosen on one is chosen on the other."""

from __future__ import annotations

import re

import pytest

import splinefeed as sf
from studio_tools import PATIENCE, rest, value

expect = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed").expect
expect.set_options(timeout=PATIENCE)
pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]

CYCLES = """G21 G90 G17 F300 S800 M3
T1 M6
G0 X0 Y0 Z20
G98 G83 X10 Y5 Z-12 R2 Q4
X30
G80
T2 M6
G1 X50 Y20 F600
M2
"""
#: Where the middle of a line's last move is on the picture.
MOVE = """(line) => { const p = window.picture; let k = p.points.x.length - 1; while (p.said[k][0] !== line) k -= 1;
  const [one, two] = [p.at(k - 1), p.at(k)]; return [two[0] * 0.99 + one[0] * 0.01, two[1] * 0.99 + one[1] * 0.01]; }"""


def test_a_program_is_dropped_timed_and_a_line_chosen_by_keys_and_on_the_path(opened, tmp_path):
    page = opened(1100, 900)
    file = tmp_path / "plate.ngc"
    file.write_text(CYCLES)
    rest(page, lambda: page.set_input_files("#file", str(file)))
    time = sf.cycle_time(file, page.input_value("#machine"))
    assert value(page, "total_s") == time.total
    tools = page.locator("#sheet tr[data-tool]").all_inner_texts()
    assert [each.split("\t")[:2] for each in tools] == [
        [each["tool"] or "no tool", f"{each['total_s']:.2f} s"] for each in time.tools
    ]
    said = page.locator("#line-said")
    at = {int(line): k for k, line in enumerate(time.by_line.line)}
    for key, line in (("End", 9), ("Home", 1), ("PageDown", 9), ("ArrowUp", 8)):
        page.press("#listing", key)
        expect(page.locator('#listing [aria-selected="true"]')).to_have_attribute("data-line", str(line))
    seconds, begin = time.by_line.seconds[at[8]], time.by_line.begin[at[8]]
    assert re.match(rf"Line 8: {seconds:.2f} s .*from {begin:.2f} s on, bound by \w+", said.inner_text())
    assert "T2, x 50.000, y 20.000, z 20.000 mm" in said.inner_text()
    page.locator("#path").click(position=dict(zip("xy", page.evaluate(MOVE, 5), strict=True)))
    expect(page.locator('#listing [aria-selected="true"]')).to_have_attribute("data-line", "5")
    assert "T1, x 30.000, y 5.000, z 20.000 mm" in said.inner_text()
    page.locator('#listing [data-line="4"]').click()
    assert said.inner_text().startswith(f"Line 4: {time.by_line.seconds[at[4]]:.2f} s")
    page.select_option("#colour", "feed")
    expect(page.locator("#path")).to_have_attribute("aria-label", re.compile(r"coloured by feed \(mm/min\) from 0"))
    page.click("#tab-places")
    page.locator("#sheet button").first.click()
    assert said.inner_text().startswith(f"Line {time.places(1)[0]['line']}:")
    rest(page, lambda: page.select_option("#machine", "hurco-04"))
    assert value(page, "total_s") == sf.cycle_time(file, "hurco-04").total
    rest(page, page.reload)
    assert value(page, "total_s") == sf.cycle_time(file, "hurco-04").total
    rest(page, lambda: page.uncheck("#by-control"))
    assert page.inner_text("#verdict").startswith("Checked: every limit holds")
    assert not page.is_visible("#listing")


def test_a_hundred_thousand_lines_are_few_rows_and_errors_name_theirs(opened, tmp_path):
    page = opened(420, 800, scheme="dark")
    file = tmp_path / "long.nc"
    file.write_text("G21 G90 F600\n" + "".join(f"G1 X{k % 7} Y{0.01 * k:.2f}\n" for k in range(100_000)) + "M30\n")
    rest(page, lambda: page.set_input_files("#file", str(file)))
    assert value(page, "total_s") == sf.cycle_time(file, "hurco-02").total
    page.press("#listing", "End")
    expect(page.locator('#listing [aria-selected="true"]')).to_have_text(re.compile("^100002M30"))
    assert page.locator("#listing [role=option]").count() < 100
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 420
    file.write_text("G21 G90\nG1 X10 F600\nG81 Z-3\nM30\n")
    page.set_input_files("#file", str(file))
    expect(page.locator("#error-source")).to_have_text("long.nc: line 3: G81 needs R")
