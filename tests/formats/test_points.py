"""Points in a table: read as a path that passes them, or refused with the line."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.curves.nearest import Nearest
from splinefeed.errors import FormatError
from splinefeed.files import table_text
from splinefeed.formats.long_files import read_parts
from splinefeed.formats.registry import read_all
from splinefeed.paths.fitting import distances

ANGLE = np.linspace(0.0, 2.0 * math.pi, 201)
LOOP = np.round(np.column_stack([50.0 * np.cos(ANGLE), 30.0 * np.sin(ANGLE)]), 4)


def text_of(points, between=",", head=""):
    return head + "\n".join(between.join(f"{value:.4f}" for value in row) for row in points) + "\n"


@pytest.mark.parametrize("between", [",", ";", "\t", " ", " , "])
def test_a_closed_scan_is_a_closed_path(tmp_path, between):
    file = tmp_path / "scan.csv"
    file.write_text(text_of(LOOP, between, "# scanned\nx,y\n"))
    path = sf.read(file, tolerance=0.01)
    assert path.closed
    assert path.axes == ("x", "y")
    assert len(path.corners) == 0
    assert Nearest(path.table, path.shape).find(LOOP)[2].max() <= 0.01
    assert any("closed" in finding for finding in path.findings)


@pytest.mark.parametrize(("head", "count", "searches"), [("x,y\n", 400, 1), ("x,y,a\n", 60, 2)])
def test_the_distance_said_is_that_of_the_motion(tmp_path, monkeypatch, head, count, searches):
    """Places in no order: most curves pass 2 to 4 of them. What the fit measured is measured again only if need be."""
    places = np.random.default_rng(7).uniform(0.0, 100.0, (count, head.count(",") + 1))
    file = tmp_path / "places.csv"
    file.write_text(text_of(places, ",", head))
    calls, find = [], Nearest.find
    monkeypatch.setattr(Nearest, "find", lambda self, points: calls.append(len(points)) or find(self, points))
    path = sf.read(file)
    assert len(calls) == searches
    monkeypatch.undo()
    lines = [sf.NurbsCurve(c.degree, c.knots, c.control_points[:, : path.linear]) for c in path.joined]
    far = distances(lines, np.round(places, 4)[:, : path.linear]).max()
    said = float(path.findings[-1].split("of a point ")[1].split(" mm")[0])
    assert far <= said * 1.005 if path.linear < len(path.axes) else far == pytest.approx(said, rel=0.005)


def test_columns_may_have_names_and_units_and_others_are_left_out(tmp_path):
    file = tmp_path / "scan.xyz"
    rows = np.column_stack([np.arange(30.0), np.arange(30.0) / 25.4, 0.0 * np.arange(30), 90.0 + np.arange(30.0)])
    file.write_text(text_of(rows, " ; ", "time ; X [in] ; y ; A\n"))
    path = sf.read(file)
    assert path.axes == ("x", "y", "a")
    np.testing.assert_allclose(path(path.length), [29.0, 0.0, math.radians(119.0)], atol=2e-3)
    assert any("1 of 4 columns" in finding for finding in path.findings)
    file.write_text(text_of(rows, " "))
    assert sf.read(file).axes == ("x", "y", "z")


def test_ours_is_no_table_of_points(tmp_path):
    line = sf.Path.polyline([[0, 0], [5, 0]])
    points = sf.interpolate(line, sf.plan(line, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3))
    sf.save(points, tmp_path / "ours.csv")
    with pytest.raises(FormatError, match="holds setpoints"):
        sf.read(tmp_path / "ours.csv")


AS_WRITTEN = {
    "49,5;-3\n-7,25;1,5e1\n": [[49.5, -3.0], [-7.25, 15.0]],
    "1,5\t2\n3\t4,25\n": [[1.5, 2.0], [3.0, 4.25]],
    "1,5 2,5\n3,5  4\n": [[1.5, 2.5], [3.5, 4.0]],
    "1, 5\n2 ,7\n": [[1.0, 5.0], [2.0, 7.0]],
    "2\n1.5 2\n3 4\n": [[1.5, 2.0], [3.0, 4.0]],
    "1.5D+00 2\n3 -4d0\n": [[1.5, 2.0], [3.0, -4.0]],
    "X_in,Y_in\n1,2\n3,4\n": [[25.4, 50.8], [76.2, 101.6]],
    "time,pos_x,Y position (in)\n0,1,2\n9,3,4\n": [[1.0, 50.8], [3.0, 101.6]],
    "! by hand\n// y then x\ny x\n1 2\n3 4\n": [[2.0, 1.0], [4.0, 3.0]],
    "# y x\n# x is last\n1 2\n3 4\n": [[2.0, 1.0], [4.0, 3.0]],
}


@pytest.mark.parametrize("text", AS_WRITTEN)
def test_tables_mean_what_they_say_however_they_are_written(tmp_path, text):
    file = tmp_path / "points.csv"
    file.write_text(text)
    path = sf.read(file)
    assert path.curves[0].ends.tolist() == pytest.approx(np.array(AS_WRITTEN[text]))
    commas = any("commas are read as decimal points" in finding for finding in path.findings)
    assert commas == (text[:4] in ("49,5", "1,5\t", "1,5 "))


def test_two_columns_are_points_unless_they_look_like_a_section(tmp_path):
    file = tmp_path / "scan.txt"
    file.write_text(text_of(LOOP, " ", "Scan 5\n"))
    assert sf.read(file, tolerance=0.01).bounding_box()[1].tolist() == pytest.approx([50.0, 30.0], abs=0.02)
    file.write_text("nose\n" + text_of([0.5, 0.0] + 0.01 * LOOP @ np.diag([1.0, 0.2]), " "))
    assert sf.read(file).findings[0].startswith("Selig order")


REFUSED = {
    "east,north\n1,2\n3,4\n": "line 1: 'east,north' does not name 2 columns, one of them x, y or a joint",
    "1.234,5;2\n3;4\n": "line 1: expected numbers, got '1.234,5;2'",
    "3\n1 2\n3 4\n": "says 3 points, but 2 follow; is the file complete?",
    "1_0,2\n3,4\n": "line 1: expected numbers, got '1_0,2'",
    "x,y\n1,2\n3,nan\n4,5\n": "line 3: is not a finite point",
    "x,y\n1,2\n3\n": "line 3: holds 1 numbers, the lines above 2",
    "1,2\n3,4\nend\n": "line 3: expected numbers, got 'end'",
    "1,1\n1,1\n1,1\n": "1 distinct point(s) among 3; expected at least 2",
    "x,y,z\n1,2\n3,4\n": "line 1: 'x,y,z' does not name 2 columns",
    "x,x\n1,2\n3,4\n": "two columns are called x",
    "x [lb],y\n1,2\n3,4\n": "column x: ",
    "1,1\n2,1e12\n": "line 2: is not a finite point within 1e+09 mm",
    "x,y\n": "no points found",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_table_is_refused_with_its_line(tmp_path, text):
    file = tmp_path / "points.csv"
    file.write_text(text)
    with pytest.raises(FormatError) as refusal:
        sf.read(file)
    assert str(refusal.value).startswith(f"{file}: ")
    assert REFUSED[text] in str(refusal.value)


def test_tolerance_and_degree_are_those_asked_for(tmp_path):
    file = tmp_path / "scan.csv"
    file.write_text(text_of(LOOP))
    rough, fine = sf.read(file, tolerance="0.5mm"), sf.read(file, tolerance=1e-3, degree=5)
    assert rough.curves[0].degree == 3 and fine.curves[0].degree == 5
    assert len(rough.curves[0].control_points) < len(fine.curves[0].control_points)
    with pytest.raises(sf.SplinefeedError, match="tolerance is -1 mm"):
        sf.read(file, tolerance=-1)


LONG = ["1" + " " * 10**6 + "2", "x" + "_" * 10**6 + "!", '"' + "9" * 200_000 + '",1', "1;" * 10**6]


@pytest.mark.parametrize("line", LONG, ids=["blanks", "a name", "quotes", "columns"])
def test_very_long_lines_are_looked_at_once(line):
    assert table_text.names(line) == ([], False)
    found = table_text.numbers(line)
    assert found is None or not found[1]


@pytest.mark.parametrize(
    "text",
    [
        "0 0\n10 0\n10 10\n0 10\n0 0\n\n50 0\n60 0\n60 10\n50 10\n50 0\n",
        "x;y\n\n0;0\n10;0\n10;10\n0;10\n0;0\n \n# the second\n\n50;0\n60;0\n60;10\n50;10\n50;0\n\n\n",
        "x,y\n,\n0,0\n10,0\n10,10\n0,10\n0,0\n , \n50,0\n60,0\n60,10\n50,10\n50,0\n,\n",  # empty rows of a spreadsheet
        "x;y\n0;0\n10;0\n10;10\n0;10\n0;0\n;\n50;0\n60;0\n60;10\n50;10\n50;0\n",
        "x,y\r\n0,0\r\n10,0\r\n10,10\r\n0,10\r\n0,0\r\n\r\n50,0\r\n60,0\r\n60,10\r\n50,10\r\n50,0\r\n",
    ],
)
def test_blank_lines_part_contours(tmp_path, text):  # after CloudCompare#913
    file = tmp_path / "two.xyz"
    file.write_bytes(text.encode())
    paths = read_all(file)
    assert [(path.name, path.length, path.closed) for path in paths] == [("two#1", 40.0, True), ("two#2", 40.0, True)]
    assert "2 contours, parted by blank lines" in paths[0].findings
    with pytest.raises(FormatError, match="make a file of each"):
        list(read_parts(file))


def test_blank_lines_between_all_points_part_nothing_and_lone_points_are_left_out(tmp_path):
    file = tmp_path / "a.xyz"
    file.write_text("0 0\n\n5 0\n\n\n10 0\n\n")
    assert sf.read(file).length == pytest.approx(10.0)
    file.write_text("0 0\n5 0\n\n9 9\n\n0 5\n5 5\n")
    paths = read_all(file)
    assert [path.length for path in paths] == pytest.approx([5.0, 5.0])
    assert "1 contour(s) of one point are left out" in paths[0].findings


def test_a_column_that_counts_is_said(tmp_path):  # after CloudCompare#380
    file = tmp_path / "a.csv"
    file.write_text("1,30,0\n2,20,7\n3,0,9\n4,-20,7\n5,-30,0\n")
    assert any(each.startswith("column 1 counts by 1 and is read as x") for each in sf.read(file).findings)
    for text in ("n,x,y\n1,30,0\n2,20,7\n3,0,9\n", "1,30,0\n2,20,7\n4,0,9\n", "1,30\n2,20\n3,0\n"):
        file.write_text(text)
        assert not any("counts" in each for each in sf.read(file).findings)


@pytest.mark.parametrize("text", ["30,5,0,0\n20,5,7,1\n-20,5,7,1\n", "1,0,2,5,3,0\n2,0,3,5,4,0\n"])
def test_a_comma_that_is_both_is_refused(tmp_path, text):  # after geoda#123
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(FormatError, match=r"line 1: .* may have commas as decimal points and between numbers"):
        sf.read(file)


@pytest.mark.parametrize("text", ["30,5,0,-1\n20,5,7,1\n", "30,5,0.5,0\n2,5,7,1\n", "x,y,z,n\n30,5,0,0\n20,5,7,1\n"])
def test_commas_that_are_plainly_between_numbers(tmp_path, text):
    file = tmp_path / "a.csv"
    file.write_text(text)
    assert sf.read(file).axes == ("x", "y", "z")


@pytest.mark.parametrize(
    ("head", "length", "said"),
    [
        ("# x y z [m]\n", 10_000.0, "the unit behind the last name, m, is taken for x, y, z"),
        ("x,y,z (in)\n", 10.0, "columns without a unit beside others with one are in mm: x, y"),
        ("x [in], y, z\n", 254.0, "columns without a unit beside others with one are in mm: y, z"),
        ("x [in] y [in] z [in]\n", 254.0, ""),
        ("x,y,z\n", 10.0, ""),
    ],
)
def test_a_unit_said_once_is_that_of_all_places(tmp_path, head, length, said):
    file = tmp_path / "scan.csv"
    file.write_text(head + "0, 0, 0\n10, 0, 0\n")
    path = sf.read(file)
    assert path.length == pytest.approx(length)
    assert [each for each in path.findings if "unit" in each] == [said] * bool(said)


QUOTED = {
    'x,y\n"0,5","1,0"\n"10,5","1,0"\n': 10.0,  # after geoda#123
    'POLYID, X, Y\n1, "0,5", "1,2"\n2, "10,5", 1.2\n': 10.0,
    '"x";"y"\n"0,5";"1,0"\n"5,5";"1,0"\n': 5.0,
    '"x","y"\n"0.5","1.0"\n"5.5","1.0"\n': 5.0,
}


@pytest.mark.parametrize("text", QUOTED)
def test_numbers_in_quotes_may_have_decimal_commas(tmp_path, text):
    file = tmp_path / "scan.csv"
    file.write_text(text)
    path = sf.read(file)
    assert path.axes == ("x", "y") and path.length == pytest.approx(QUOTED[text])


def test_a_quote_that_is_not_closed_is_refused_with_its_line(tmp_path):
    file = tmp_path / "scan.csv"
    file.write_text('x,y\n0,1\n"5,1\n')
    with pytest.raises(FormatError, match="line 3: "):
        sf.read(file)
