"""Paths with rotary axes: alone they count in degrees; beside linear ones the tip's arc length and feed are said."""

from __future__ import annotations

import json
import math
import re

import pytest

import splinefeed as sf
from splinefeed.reports.path_figures import path_figure
from splinefeed.reports.svg import to_text

LIMITS = ["--feed", "90", "--accel", "500", "--jerk", "20000"]
MILLIMETRES = re.compile(r"\d mm\b|\bmm/s|\(mm|\(1/mm")


@pytest.fixture
def table(folder):
    turns = [sf.NurbsCurve.bezier([[0.0], [1.0], [3.0]]), sf.NurbsCurve.bezier([[3.0], [2.0]])]
    path = sf.Path(turns, axes=("a",), name="table")
    sf.write(path, folder / "table.json")
    return path


@pytest.mark.parametrize("command", ["run", "plan", "compare", "info"])
def test_it_is_said_in_degrees(splinefeed, table, command):
    words = [] if command == "info" else [*LIMITS, *(["--methods", "taylor-1"] if command == "compare" else [])]
    if command == "run":
        words += ["-o", "out", "--no-figures"]
    result = splinefeed(command, "table.json", *words)
    assert result.exit_code == 0, result.output
    assert "229.1831 deg" in result.output
    assert not MILLIMETRES.search(result.output.replace("0.00e+00 mm", "")), result.output
    if command == "run":
        check = splinefeed("check", "out/setpoints.h5", "--jerk", "19000")
        assert check.exit_code == 1
        assert "along 229.1831 deg of" in check.output
        blame = r"problem   jerk: 19\d+.* deg/s\^3 is .* over the limit of 19000 deg/s\^3 at s = .* deg, t"
        assert re.search(blame, check.output)
        assert not MILLIMETRES.search(check.output)


def test_the_report_is_in_degrees(splinefeed, table, folder):
    pytest.importorskip("plotly")
    assert splinefeed("run", "table.json", *LIMITS, "-o", "out", "--strategy", "time-optimal").exit_code == 0
    page = (folder / "out/report.html").read_text(encoding="utf-8")
    shown = page[page.index("<body") :]
    figures = re.findall(r"(?:feed|s|acceleration|jerk) \((?:deg|mm|°)[^)]*\)", shown)
    assert "feed (deg/s)" in figures
    assert not [each for each in figures if "mm" in each]
    cells = re.findall(r"<t[dh]>([^<]*)</t[dh]>|<dd>([^<]*)<", shown)
    assert not [each for each in cells if MILLIMETRES.search("".join(each)) and "chord" not in "".join(each)]
    assert json.loads((folder / "out/run.json").read_text())["length_mm"] == pytest.approx(229.1831, abs=1e-4)


def test_figures_are_in_degrees(table):
    run = sf.run(table, sf.Limits(feed=90, acceleration=500, jerk=20000), period=1e-3)
    for figure in (
        sf.plot.motion(run),
        sf.plot.limits(run),
        sf.plot.binding(run),
        path_figure(run),
    ):
        assert not [text for text in re.findall(r"<text[^>]*>([^<]*)<", to_text(figure)) if MILLIMETRES.search(text)]


MIXED = "G21 G90\nF600\nG1 X0 Y0 A0\nG1 X10 Y0 A0\nG1 A90\nG1 X20 Y5 A120\nG1 X30 Y0 A100\nM2\n"


def test_plan_and_info_say_where_the_tip_is(splinefeed, folder):
    """The path's own parameter counts rotary axes by 50 mm a rad: no length or feed of it is for people."""
    (folder / "mixed.ngc").write_text(MIXED)
    lines = [10.0, 90.0, math.hypot(10, 5), math.hypot(10, 5)]  # the turn counts in degrees, as LinuxCNC's F does
    result = splinefeed("plan", "mixed.ngc", "--feed", "10", "--axis-accel", "500", "--axis-jerk", "20000", "--json")
    assert result.exit_code == 0, result.output
    page = json.loads(result.stdout)
    assert page["length_mm"] == pytest.approx(sum(lines), rel=1e-9)
    assert page["stops_mm"] == pytest.approx([10.0, 100.0, 100.0 + lines[2]], rel=1e-9)
    assert max(piece["feed_from_mm_s"] for piece in page["pieces"]) == pytest.approx(10.0, rel=1e-4)
    assert page["pieces"][-1]["to_mm"] == pytest.approx(sum(lines), rel=1e-9)
    for piece, after in zip(page["pieces"], page["pieces"][1:], strict=False):
        assert piece["to_mm"] == pytest.approx(after["from_mm"], abs=1e-6)
    curves = json.loads(splinefeed("info", "mixed.ngc", "--json").stdout)["curves"]
    assert [each["length_mm"] for each in curves] == pytest.approx(lines, rel=1e-9)
