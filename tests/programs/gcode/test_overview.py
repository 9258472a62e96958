"""What is said of a program without making its path is what its path says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import program
from splinefeed.errors import FormatError
from splinefeed.programs.gcode import reader, state
from splinefeed.programs.gcode.overview import summary
from splinefeed.programs.gcode.reader import Reading

MIXED = (
    "G21 G17 F600", "G0 X0 Y0 Z0", "G1 X10", "G2 X20 Y0 I5 J0", "G3 X20 Y20 Z4 I0 J10 P2", "M3 S100", "G0 Z10",
    "G5.2 P1 L3", "X25 Y5 P2", "X30 Y0", "X35 Y9", "G5.3", "G18 G2 X40 Z12 R9", "G61.1", "G1 X50", "X60", "G4 P0.25",
    "G1 X60", "G1 Y30", "M2",
)  # fmt: skip


@pytest.mark.parametrize("name", ["tball.gcode", "calibration.gcode", "circle.nc", "milling.nc", "nurbs.ngc", "mixed"])
def test_it_agrees_with_the_path(tmp_path: Path, data_dir: Path, name: str) -> None:
    files = {file.name: file for file in (data_dir / "gcode").iterdir()}
    file = next((files[each] for each in files if each.endswith(name)), None) or program(tmp_path, *MIXED)
    path = sf.read(file, repair=True)
    found = summary(file, reading=Reading(repair=True))
    page = found.page(file)["paths"][0]
    assert page["length_mm"] == pytest.approx(path.length, rel=1e-9)
    assert page["curves"] == len(path.curves) and page["axes"] == list(path.axes)
    assert page["degrees"] == sorted({curve.degree for curve in path.curves})
    assert page["corners"] == len(path.corners) and page["stops"] == len(path.stops)
    low, high = path.bounding_box()
    assert np.allclose(page["bbox_min"], low, atol=1e-9) and np.allclose(page["bbox_max"], high, atol=1e-9)
    assert page["closed"] == path.closed
    radius = path.minimum_radius()
    assert page["min_radius_mm"] == (pytest.approx(radius, rel=1e-6) if np.isfinite(radius) else None)
    assert found.markers == sum(bool(marker.text) for marker in path.markers)
    assert found.dwell_time == sum(wait for _, wait in path.dwells)


@pytest.mark.parametrize("name", ["tball.gcode", "calibration.gcode", "mixed"])
def test_its_curves_are_those_of_the_path_as_many_as_are_asked_for(tmp_path: Path, data_dir: Path, name: str) -> None:
    files = {file.name: file for file in (data_dir / "gcode").iterdir()}
    file = next((files[each] for each in files if each.endswith(name)), None) or program(tmp_path, *MIXED)
    path = sf.read(file, repair=True)
    page = summary(file, reading=Reading(repair=True), most_listed=10**9).page(file)
    lengths = np.diff(path.curve_starts)
    assert page["curves_left_out"] == 0 and len(page["curves"]) == len(path.curves)
    for said, curve, length in zip(page["curves"], path.curves, lengths, strict=True):
        # arcs that miss their circle are spirals, whose length is that of the mean radius but for the second order
        assert said.pop("length_mm") == pytest.approx(length, rel=1e-6)
        assert said == {
            "path": 1, "degree": curve.degree, "control_points": len(curve.control_points),
            "spans": len(curve.breaks) - 1, "rational": curve.rational, "closed": curve.closed,
        }  # fmt: skip
    few = summary(file, reading=Reading(repair=True), most_listed=3).page(file)
    assert len(few["curves"]) == 3 and few["curves_left_out"] == len(path.curves) - 3


def test_parts_make_no_difference(tmp_path: Path, data_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mixed = program(tmp_path, *MIXED)
    files = [mixed, data_dir / "gcode" / "cncjs_tball.gcode"]
    pages = [summary(file).page(file) for file in files]
    monkeypatch.setattr(state, "CAPACITY", 16)
    monkeypatch.setattr(reader, "BLOCK", 256)
    for file, page in zip(files, pages, strict=True):
        again = summary(file).page(file)
        assert again["paths"][0].pop("length_mm") == pytest.approx(page["paths"][0].pop("length_mm"), rel=1e-12)
        for each in (again, page):
            each["program"].pop("lengths_mm"), each["program"].pop("feed_time_s")
        assert again == page


def test_time_at_the_programmed_feeds(tmp_path: Path) -> None:
    found = summary(program(tmp_path, "G1 X10 F600", "G93 X30 F2", "G94 X30 Y60 F60", "G0 X0"))
    assert found.feed_time == pytest.approx(1.0 + 30.0 + 60.0)
    assert found.feeds == (pytest.approx(20 / 30), 10.0)
    assert found.lengths["G0"] == 30.0 and found.ends is False


def test_what_moves_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no line moves an axis"):
        summary(program(tmp_path, "G21", "M3"))
    with pytest.raises(FormatError, match="no move has a length"):
        summary(program(tmp_path, "G1 X0 F1"))
