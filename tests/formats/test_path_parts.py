"""Files read part by part: the path of the whole, curve for curve, with everything that stands between the curves."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

import splinefeed as sf
from motions import vertices
from splinefeed.errors import FormatError, InputError
from splinefeed.formats import points as points_of_a_table
from splinefeed.programs.gcode import to_path

DATA = pathlib.Path(__file__).parents[1] / "data"

PROGRAM = """
G21 G90 G17
G0 Z5
G0 X1
T1 M6
G0 X0 Y0
M3 S1000
G64 P0.01
G1 Z0 F300
G1 Z0
X10 F600
M8
G2 X12 Y2 R2
G61.1
G1 X12 Y5
X13
G64 P0.02
G4 P0.5
G1 X13
M9
(a spline)
G5 I1 J0 P-1 Q0 X15 Y6
G0 X20 Y6
G1 X20 Y6
M5
M2
"""


def markers(path: sf.Path, first: int = 0) -> list[tuple[int, str, float, bool]]:
    return [(m.before + first, m.text, m.dwell, m.stop) for m in path.markers]


@pytest.mark.parametrize("size", [1, 2, 5, 4096])
@pytest.mark.parametrize("name", ["own", "cncjs_tball.gcode", "gcodetoolpath_one-inch-circle.nc", "linuxcnc_nurbs.ngc"])
def test_the_parts_of_a_program_are_its_path(tmp_path, monkeypatch, name, size):
    monkeypatch.setattr(to_path, "PART", size if name == "own" else 40 * size)
    file = DATA / "gcode" / name
    if name == "own":
        file = tmp_path / "own.ngc"
        file.write_text(PROGRAM)
    whole, parts = sf.read(file), sf.formats.read_parts(file)
    assert (parts.axes, parts.name, parts.findings) == (whole.axes, whole.name, whole.findings)
    found = list(parts)
    assert all(len(part.curves) <= to_path.PART for part in found)
    assert np.array_equal(np.concatenate([part.flat.points for part in found]), whole.flat.points)
    assert np.array_equal(np.concatenate([part.flat.knots for part in found]), whole.flat.knots)
    assert np.array_equal(np.concatenate([part.feeds for part in found]), whole.feeds)
    assert parts.feeds == (np.max(whole.feeds[np.isfinite(whole.feeds)]), bool(np.any(np.isinf(whole.feeds))))
    if whole.tolerances is None:
        assert parts.tolerance is None
        assert all(part.tolerances is None for part in found)
    else:
        assert parts.tolerance == np.max(whole.tolerances)
        assert np.array_equal(np.concatenate([part.tolerances for part in found]), whole.tolerances)
    starts = np.cumsum([0, *(len(part.curves) for part in found)])
    between = [each for part, first in zip(found, starts, strict=False) for each in markers(part, int(first))]
    assert sorted(between) == sorted(markers(whole))
    assert [part.length for part in parts] == [part.length for part in found]  # as often as it is asked for


def test_a_faulty_line_is_told_before_anything_is_made(tmp_path):
    file = tmp_path / "bad.nc"
    file.write_text("G1 F100 X1\nX2\nX3 Y4 W\n")
    with pytest.raises(FormatError, match=r"bad\.nc: line 3: "):
        sf.formats.read_parts(file)
    file.write_text("G1 F100 X1\nG2 X3 Y4 R0.1\n")
    with pytest.raises(FormatError, match=r"bad\.nc: line 2: "):
        sf.formats.read_parts(file)
    file.write_text("M3\n")
    with pytest.raises(FormatError, match="no line moves an axis"):
        sf.formats.read_parts(file)
    with pytest.raises(InputError, match="option 'chord' is not one of a G-code file"):
        sf.formats.read_parts(DATA / "gcode/cncjs_tball.gcode", chord=3.0)
    with pytest.raises(FormatError, match="JSON curve is read as a whole"):
        sf.formats.read_parts(next(pathlib.Path(DATA / "json").glob("*.json")))


def test_the_points_of_a_table_are_joined_by_lines(tmp_path, monkeypatch):
    monkeypatch.setattr(points_of_a_table, "PART", 7)
    file = tmp_path / "scan.csv"
    at = np.arange(50.0)
    points = np.column_stack([0.5 * at, np.sin(at)])
    rows = [f"{x!r},{y!r},9" for x, y in points.tolist()]
    file.write_text("\n".join(["x [in],y [in],note", *rows[:20], rows[19], *rows[20:]]) + "\n")
    parts = sf.formats.read_parts(file)
    assert (parts.axes, parts.count, parts.feeds) == (("x", "y"), 52, None)
    assert parts.findings == ("1 of 3 columns are not named as axes and are left out",)
    found = list(parts)
    assert len(found) == 8
    joined = np.concatenate([vertices(found[0])[:1], *(vertices(part)[1:] for part in found)])
    assert np.allclose(joined, 25.4 * points, rtol=1e-15)
    file.write_text("1 2\n1 2\n")
    with pytest.raises(FormatError, match="one point only"):
        list(sf.formats.read_parts(file))
    file.write_text("1 2\n" * 9 + "1 nan\n")
    with pytest.raises(FormatError, match="line 10: is not a finite point"):
        list(sf.formats.read_parts(file))
    file.write_text("1 2\n" * 9 + "1 2 3\n")
    with pytest.raises(FormatError, match="line 10: holds 3 numbers, the lines above 2"):
        list(sf.formats.read_parts(file))
