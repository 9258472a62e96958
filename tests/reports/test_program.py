"""The report of a program: its lines, tools, operations and feeds, and places of limits by line."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.smoothing import smoothed
from splinefeed.reports.files import of_run
from splinefeed.reports.html import page
from splinefeed.reports.program import line_at, operations, starts
from splinefeed.reports.record import about, record
from studio_tools import PATIENCE

PROGRAM = """%
G21 G90 G17
T1 M6
S1000 M3
G0 X0 Y0 Z5
G1 Z-1 F300
X40 F1200
Y30
G0 Z5
T2 M6
G0 X50
G1 Z-2 F150
G2 X60 Y20 I0 J-10 F600
G0 Z5
M30
"""
LIMITS = sf.Limits(feed=100, axis_acceleration=500, axis_jerk=20000)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    file = tmp_path_factory.mktemp("program") / "part.ngc"
    file.write_text(PROGRAM)
    run = sf.run(sf.read(file), LIMITS)
    said = record(run, about(run.settings, str(file), {}, ["hdf5"]))
    return run, said, page(run, said, of_run(run))


def test_each_curve_knows_its_line(made):
    run = made[0]
    assert run.path.lines.tolist() == [6, 7, 8, 9, 11, 12, 13, 14]
    assert run.path.reversed().lines.tolist() == [14, 13, 12, 11, 9, 8, 7, 6]
    begin, lines = starts(run)
    for t, line in zip(begin[1:], lines[1:], strict=True):
        assert line_at(run, t + 2e-3) == line


def test_smoothed_programs_know_their_lines():
    points = np.array([[0, 0], [10, 0], [20, 3], [30, 3], [40, 0]], dtype=np.float64)
    path = sf.Path.polyline(points, ("x", "y"), lines=[5, 6, 8, 9])
    lines = smoothed(path, 0.1).lines
    assert lines[0] == 5
    assert lines[-1] == 9
    assert np.all(np.diff(lines) >= 0)


def test_operations_have_tools_lines_feeds_and_all_of_the_time(made):
    run = made[0]
    one, two = operations(run)
    assert (one.tool, one.lines, one.feeds) == ("T1", (6, 9), (300.0, 1200.0))
    assert (two.tool, two.lines, two.feeds) == ("T2", (11, 14), (150.0, 600.0))
    assert one.seconds + two.seconds == pytest.approx(run.law.duration)
    assert one.cut_mm == pytest.approx(6.0 + 40.0 + 30.0)
    assert 0.0 < one.rapid_s < one.seconds


def test_the_page_says_them_and_feeds_as_programmed(made):
    run, said, text = made
    for words in ("T1</td><td>6 to 9", "300 to 1200 mm/min", "rapid moves", 'data-view="program"', "G2 X60 Y20"):
        assert words in text
    assert "feed ripple</dt>" not in text
    assert sf.plot.motion(run).panels[1].y.label == "feed (mm/min)"
    over = sf.check(run.points, run.path, dataclasses.replace(LIMITS, feed=float(run.points.feed.max()) / 1.01))
    broken = dataclasses.replace(run, verdict=over)
    (told,) = re.findall(r"Not kept[^<]*", page(broken, {**said, "ok": False}, of_run(run)))
    assert told.startswith("Not kept: feed 1 % over at ")
    assert any(f" s, line {line}." in told for line in run.path.lines)


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.timeout(900)
def test_the_line_follows_the_time_and_sets_it(made, chromium, tmp_path):
    run, _, text = made
    file = tmp_path / "report.html"
    file.write_text(text, encoding="utf-8")
    shown = chromium.new_page(viewport={"width": 1280, "height": 900})
    shown.set_default_timeout(PATIENCE)
    shown.goto(file.as_uri())
    shown.wait_for_selector("html[data-ready=yes]")
    begin, lines = starts(run)
    shown.evaluate("(t) => clock.to(t)", float(begin[5]) + 0.01)
    assert shown.locator('#listing [aria-selected="true"]').get_attribute("data-line") == str(lines[5])
    assert f"line {lines[5]}" in shown.locator(".time-now").inner_text()
    shown.locator('#listing [data-line="8"]').click()
    assert shown.evaluate("clock.t") == pytest.approx(begin[2])
    assert shown.evaluate("picture.rapid.x.length") > 2
    shown.close()
