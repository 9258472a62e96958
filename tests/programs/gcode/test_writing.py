"""Paths written as programs and read again: exact where the words allow it, and within the tolerance elsewhere."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of
from sample_curves import random_curve
from splinefeed.paths.fitting import distances
from splinefeed.programs.gcode.fit_arcs import circle_of
from splinefeed.runs.convert import convert


def again(path: sf.Path, folder: Path, **options: object) -> tuple[sf.Path, tuple[str, ...]]:
    """The path written and read again, and what the writer said."""
    file = folder / "again.ngc"
    said = sf.write(path, file, **{"feed": 10.0, **options})
    return sf.read(file), said


def apart(first: sf.Path, second: sf.Path) -> float:
    """Greatest distance between two paths, both ways, at many places, by SciPy's tree and Newton's method."""
    far = []
    for one, other in ((first, second), (second, first)):
        points = one(np.linspace(0.0, one.length, 2001))
        far.append(float(distances(other.curves, points).max()))
    return max(far)


@pytest.mark.parametrize("seed", [seed for seed in range(36) if seed % 12])
def test_g6_2_keeps_every_curve(tmp_path: Path, seed: int) -> None:
    curve = random_curve(seed)
    path = sf.Path([curve], ("x", "y", "z", "u", "v", "w")[: curve.axes])
    if curve.axes == 1:
        return  # a curve along one axis turns back, and its first place is no place of a plane
    back, said = again(path, tmp_path, as_="g6.2")
    assert said == () and len(back.curves) == 1 and back.axes == path.axes
    u, v = (np.linspace(*each.domain, 200) for each in (curve, back.curves[0]))
    scale = np.max(np.abs(curve.control_points))
    rounding = 1.0 + abs(curve.domain[0]) / np.ptp(curve.domain)  # of u itself, where parameters begin at 1000
    assert np.max(np.abs(curve(u) - back.curves[0](v))) < 1e-12 * (1.0 + scale) * rounding


@pytest.mark.parametrize("seed", [seed for seed in range(36) if seed % 12])
def test_g5_2_keeps_every_plane_curve(tmp_path: Path, seed: int) -> None:
    curve = random_curve(seed, axes=2)
    path = sf.Path([curve])
    back, said = again(path, tmp_path)
    assert all("knots are not uniform" in sentence for sentence in said)
    assert len(back.curves) in (1, len(curve.breaks) - 1)
    scale = 1.0 + np.max(np.abs(curve.control_points))
    parts = [(curve.domain, back.curves[0])]
    if len(back.curves) > 1:
        parts = list(zip(zip(curve.breaks[:-1], curve.breaks[1:], strict=True), back.curves, strict=True))
    for (low, high), part in parts:
        u, v = np.linspace(low, high, 50), np.linspace(*part.domain, 50)
        assert np.max(np.abs(curve(u) - part(v))) < 1e-11 * scale


@pytest.mark.slow
@pytest.mark.parametrize("as_", ["g1", "arcs"])
@pytest.mark.parametrize(
    ("shape", "tolerance"), [("butterfly", 0.05), ("naca", 1e-3), ("figure-eight", 0.01), ("ellipse", 3e-3)]
)
def test_lines_and_arcs_keep_the_tolerance(tmp_path: Path, as_: str, tolerance: float, shape: str) -> None:
    path = sf.shapes.naca("0025", chord=15.5) if shape == "naca" else sf.shapes.from_text(shape)
    back, said = again(path, tmp_path, as_=as_, tolerance=tolerance)
    assert apart(path, back) <= tolerance
    error = next(float(each.split()[6]) for each in said if each.startswith("what is approximated is at most"))
    assert error == pytest.approx(apart(path, back), rel=0.05)
    if as_ == "arcs":
        assert len(back.curves) < len(again(path, tmp_path, as_="g1", tolerance=tolerance)[0].curves)
        turns = [corner.angle for corner in back.corners]
        assert max(turns, default=0.0) < 1e-4 or len(path.corners) > 0  # arcs are tangent to each other


def test_curves_in_space_become_lines_where_there_is_no_word_for_them(tmp_path: Path) -> None:
    curve = sf.NurbsCurve.bezier([(0, 0, 0), (10, 0, 5), (10, 10, -5), (0, 10, 3)])
    back, said = again(sf.Path([curve]), tmp_path, tolerance=0.01)
    assert said[0] == "in none of the planes G17, G18, G19, written as lines (G1): curve 0"
    assert apart(sf.Path([curve]), back) <= 0.01


def test_arcs_and_helices_come_back_as_arcs(tmp_path: Path) -> None:
    lines = ["F60", "G2 X10 Y0 I5 J0", "G3 X10 Y8 Z5 I0 J4 P3", "G18 G2 X20 Z5 I5 K0",
             "G19 G3 Y8 Z9 J0 K2", "G17 G3 I3 J-2"]  # fmt: skip
    path = path_of(tmp_path, *lines)
    for as_ in ("g5.2", "arcs", "g6.2"):
        back, said = again(path, tmp_path, as_=as_)
        assert said == () and len(back.curves) == len(path.curves)
        for one, other in zip(path.curves, back.curves, strict=True):
            assert one.degree == other.degree
            assert np.allclose(one.control_points, other.control_points, atol=1e-12, rtol=0)
    text = (tmp_path / "again.ngc").read_text()
    assert "P3" in text and "G18" in text and "G19" in text


def test_feeds_rapids_markers_and_tolerances_come_back(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "T1 M6", "S1000 M3", "G64 P0.05", "G1 X1 F120", "G4 P0.5", "G0 Y2", "G61", "G3 X3 Y2 I1 J0 F333.3",
        "M8", "M62 P1", "G64", "G1 X9 A90", "G61.1", "G1 X10", "G1 X11", "M30",
    )  # fmt: skip
    back, said = again(path, tmp_path)
    assert said == () and back.axes == path.axes
    assert path.feeds is not None and back.feeds is not None
    assert np.allclose(back.feeds, path.feeds, rtol=1e-15)
    assert path.tolerances is not None and back.tolerances is not None
    assert back.tolerances.tolist() == path.tolerances.tolist()
    assert [(m.before, m.text, m.dwell, m.stop) for m in back.markers] == [
        (m.before, m.text, m.dwell, m.stop) for m in path.markers
    ]
    for one, other in zip(path.curves, back.curves, strict=True):
        assert np.allclose(one.control_points, other.control_points, atol=1e-12, rtol=0)


def test_real_programs_come_back(tmp_path: Path, data_dir: Path) -> None:
    for name in ("gcodetoolpath_one-inch-circle.nc", "linuxcnc_nurbs.ngc"):
        path = sf.read(data_dir / "gcode" / name)
        back, said = again(path, tmp_path)
        assert said == () and len(back.curves) == len(path.curves)
        for one, other in zip(path.curves, back.curves, strict=True):
            assert np.allclose(one.control_points, other.control_points, atol=1e-12, rtol=0)
            assert one.rational == other.rational
            if one.rational:
                assert np.allclose(one.weights, other.weights, atol=1e-12, rtol=0)


def test_fanuc_has_cubics_at_most_and_six_decimals(tmp_path: Path) -> None:
    path = sf.shapes.naca("0025", chord=15.5)
    back, said = again(path, tmp_path, dialect="fanuc")
    assert any(each.startswith("of a degree above 3") for each in said)
    assert "numbers have 6 decimals, so that places are rounded" in said
    assert apart(path, back) < 1e-3 and back.curves[0].degree == 3
    text = (tmp_path / "again.ngc").read_text()
    assert "G06.2 P4 K0." in text and text.endswith("M30\n%\n")


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "siemens", "mach3", "printer"])
def test_every_dialect_is_told_again_and_keeps_feeds_and_waits(tmp_path: Path, dialect: str) -> None:
    path = path_of(tmp_path, "M3 S100", "G1 X1 F120", "G4 P0.5", "G0 Y2", "G3 X3 Y2 I1 J0", "G1 A90", "M30")
    findings = sf.write(path, tmp_path / "again.ngc", dialect=dialect, as_="arcs")
    printer = dialect == "printer"
    assert detect((tmp_path / "again.ngc").read_bytes()).name == ("marlin" if printer else dialect)
    back = sf.read(tmp_path / "again.ngc")
    assert back.feeds is not None and path.feeds is not None
    feeds = [2.0 if printer and feed == np.inf else feed for feed in path.feeds.tolist()]  # printers move G0 at F
    assert any("moves at the feed in force" in each for each in findings) == printer
    assert back.feeds.tolist() == feeds and back.dwells == path.dwells
    words = [[sorted(marker.text.split()) for marker in each.markers] for each in (back, path)]
    assert words[0] == words[1]
    for one, other in zip(path.curves, back.curves, strict=True):
        assert np.allclose(one.control_points, other.control_points, atol=1e-8, rtol=0)


def test_options_that_do_not_go_together(tmp_path: Path) -> None:
    path = sf.shapes.circle()
    for options, reason in (
        ({"dialect": "apt"}, "dialect 'apt' cannot be written; there are linuxcnc, fanuc, siemens, mach3, printer"),
        ({"as_": "bspline"}, "'bspline' is no form of linuxcnc (option as); choose from g5.2, g6.2, arcs, g1"),
        ({"tolerance": 1e-9}, "tolerance is 1e-09; it must be at least 1e-06"),
        ({"tolerance": 0}, "tolerance is 0; it must be greater than 0"),
        ({"decimals": 0}, "decimals is 0; expected a whole number from 1 to 17"),
    ):
        with pytest.raises(sf.errors.InputError) as caught:
            sf.write(path, tmp_path / "x.ngc", **options)
        assert str(caught.value) == reason
    odd = sf.Path([sf.NurbsCurve.bezier([(0, 0), (1, 1)])], ("q", "y"))
    with pytest.raises(sf.errors.InputError, match="axis 'q' has no letter in a program"):
        sf.write(odd, tmp_path / "x.ngc")


def test_a_marker_that_is_no_line_is_refused(tmp_path: Path) -> None:
    path = sf.Path(sf.shapes.line().curves, markers=[sf.paths.Marker(0, "M3 é")])
    with pytest.raises(sf.errors.InputError, match="marker 'M3 é' is not a line of G-code"):
        sf.write(path, tmp_path / "x.ngc")
    assert not (tmp_path / "x.ngc").exists()


def test_convert_to_a_dialect(tmp_path: Path) -> None:
    _, _, distance = convert(
        [sf.shapes.ellipse()], tmp_path / "x.nc", tolerance=0.01, writing={"dialect": "fanuc", "feed": 5}
    )
    assert distance is not None and distance < 0.01
    assert "G06.2" in (tmp_path / "x.nc").read_text()


def test_a_path_without_a_feed_is_written_and_said(tmp_path: Path) -> None:
    said = sf.write(sf.shapes.line(), tmp_path / "x.ngc")
    assert said == ("no feed is given, and most controls refuse lines without F; give the option feed",)


def test_several_paths_are_joined_by_rapid_moves(tmp_path: Path) -> None:
    paths = [sf.shapes.circle(), sf.shapes.circle(center=(40, 0))]
    said = sf.write(paths, tmp_path / "x.ngc", feed=10)
    assert said == ("path 2 begins elsewhere: a straight rapid move leads there",)
    back = sf.read(tmp_path / "x.ngc")
    assert back.feeds is not None and back.feeds.tolist() == [10, math.inf, 10]


def test_circles_are_found_and_nothing_else() -> None:
    angle = np.linspace(0.2, 4.0, 65)
    places = 3 + 1j + 2 * np.exp(1j * angle)
    found = circle_of(places)
    assert found is not None and found[0] == pytest.approx(3 + 1j) and found[1] == pytest.approx(3.8)
    assert circle_of(places + 1e-6 * np.random.default_rng(0).normal(size=places.shape)) is None
    assert circle_of(angle + 1j * angle) is None
