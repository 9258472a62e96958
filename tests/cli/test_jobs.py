"""A drawing of several contours on the command line: one motion, its check, its figure, its program."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.machine.machine import MachineError

#: A plate of 60 by 40 mm, drawn first, with two square holes.
PLATE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    '<path fill="none" stroke="black" d="M0 0h60v40h-60z M5 5h5v5h-5z M45 30h5v5h-5z"/></svg>'
)
LIMITS = ("--axis-accel", "500", "--axis-jerk", "20000")


@pytest.fixture
def plate(folder):
    (folder / "plate.svg").write_text(PLATE)
    return "plate.svg"


def test_run_makes_one_motion_of_all_contours_and_check_holds_it_against_the_drawing(splinefeed, folder, plate):
    result = splinefeed("run", plate, "--clearance", "3mm", *LIMITS, "--json", "-o", "out")
    assert result.exit_code == 0, result.stderr
    page = json.loads(result.stdout)
    # around: 20 + 20 + 200; down and up three times 3 mm; the rest from hole to hole and to the plate's corner
    across = page["length_mm"] - 240.0 - 18.0
    notes = " ".join(page["notes"])
    assert float(re.search(r"([\d.]+) mm of rapid moves between them, at z 3 mm", notes)[1]) == pytest.approx(
        across + 9
    )
    assert "3 contours are one motion: inner before outer, nearest next" in notes
    assert page["ok"]
    assert "--cut-feed 60.0" in page["command"]
    assert "--clearance 3.0" in page["command"]
    assert "stroke-dasharray" in (folder / "out" / "path.svg").read_text()
    checked = splinefeed("check", "out/setpoints.h5", "--json")
    assert checked.exit_code == 0, checked.stdout


def test_rapid_moves_are_faster_than_the_feed_of_the_contours_if_that_is_said(splinefeed, plate):
    page = json.loads(splinefeed("plan", plate, "--cut-feed", "20", "--feed", "100", *LIMITS, "--json").stdout)
    slow = json.loads(splinefeed("plan", plate, "--feed", "20", *LIMITS, "--json").stdout)
    assert page["length_mm"] == slow["length_mm"]
    assert page["duration_s"] < slow["duration_s"]
    assert max(piece["feed_from_mm_s"] for piece in page["pieces"]) > 60.0


def test_convert_writes_the_program_that_does_it(splinefeed, folder, plate):
    assert splinefeed("convert", plate, "plate.ngc", "--clearance", "3", "--feed", "600mm/min").exit_code == 0
    written = sf.read(folder / "plate.ngc")
    job = sf.read(folder / plate).job(clearance=3, feed=10.0)
    assert written.length == pytest.approx(job.length, rel=1e-12)
    rapids = [float(np.diff(each.curve_starts)[np.isinf(each.feeds)].sum()) for each in (written, job)]
    assert rapids[0] == pytest.approx(rapids[1], rel=1e-12)
    assert rapids[0] > 20.0
    assert set(written.feeds[np.isfinite(written.feeds)].tolist()) == {10.0}
    outline = splinefeed("convert", plate, "plate.dxf")
    assert outline.exit_code == 0
    assert "3 paths" in outline.stdout  # a drawing stays one


def test_a_machine_says_its_clearance(splinefeed, folder, plate):
    router = sf.Machine.load("router").to_text()
    (folder / "mill.toml").write_text('clearance = "4mm"\n' + router)
    assert sf.Machine.load(folder / "mill.toml").clearance == 4.0
    assert 'clearance = "4mm"' in sf.Machine.load(folder / "mill.toml").to_text()
    page = json.loads(splinefeed("plan", plate, "--machine", "mill.toml", "--json").stdout)
    assert any("at z 4 mm" in note for note in page["notes"])
    page = json.loads(splinefeed("plan", plate, "--machine", "mill.toml", "--clearance", "6", "--json").stdout)
    assert any("at z 6 mm" in note for note in page["notes"])
    single = json.loads(splinefeed("plan", plate, "--path", "2", "--machine", "mill.toml", "--json").stdout)
    assert single["length_mm"] == 20.0


def test_the_order_of_the_file_and_the_first_contour(splinefeed, plate):
    page = json.loads(splinefeed("plan", plate, "--keep-order", "--json").stdout)
    assert any("in the order of the file" in note for note in page["notes"])
    assert page["length_mm"] == pytest.approx(240.0 + math.hypot(5, 5) + math.hypot(40, 25))
    other = json.loads(
        splinefeed("plan", plate, "--first", "3", "--json").stdout
    )  # SVG has y downward: from (45, 5) to (10, 30) to (0, 40)
    assert other["length_mm"] == pytest.approx(240.0 + math.hypot(35, 25) + math.hypot(10, 10))


def test_what_does_not_go_together_is_refused(refused, folder, plate):
    (folder / "part.ngc").write_text("G1 X10 F60\nM2\n")
    assert refused("plan", "part.ngc", "--clearance", "5").startswith("--clearance: is for drawings; part.ngc has")
    assert refused("plan", plate, "--first", "9").startswith("plate.svg: first: there is no contour '9'")
    assert refused("convert", plate, "out.dxf", "--keep-order").startswith("--keep-order: is for programs")
    with pytest.raises(MachineError, match="clearance: is a height of the axis z"):
        sf.Machine.parse('clearance = "4mm"\n[axis.x]\n')
