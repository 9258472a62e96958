"""Programs of others: counts, lengths and boxes as their manifest has them, found by an independent reader."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect


def lines_and_arcs(path: sf.Path) -> tuple[float, float]:
    """Length of the straight feed moves and of the arcs, mm."""
    assert path.feeds is not None
    lengths = np.diff(path.curve_starts)
    straight = np.array([curve.degree == 1 for curve in path.curves])
    cutting = np.isfinite(path.feeds)
    return float(lengths[straight & cutting].sum()), float(lengths[~straight].sum())


def test_a_dense_chain_of_lines(data_dir: Path) -> None:
    path = sf.read(data_dir / "gcode" / "cncjs_tball.gcode")
    assert len(path.curves) == 2681 - 2
    assert path.length == pytest.approx(1496.1496431554417, rel=1e-12)
    low, high = path.bounding_box()
    assert low.tolist() == [0.0, -179.5361, -2.0] and high.tolist() == [179.7492, 0.0, 5.0]
    assert path.feeds is not None and sorted(set(path.feeds.tolist())) == [127 / 60, 1016 / 60, 2540 / 60]
    assert "2 move(s) without length are left out: line 916, 1086" in path.findings
    assert [marker.text for marker in path.markers] == ["M2"] and path.markers[0].before == len(path.curves)


def test_an_inch_program_with_four_arcs(data_dir: Path) -> None:
    path = sf.read(data_dir / "gcode" / "gcodetoolpath_one-inch-circle.nc")
    lines, arcs = lines_and_arcs(path)
    assert lines == pytest.approx(5.08, rel=1e-12) and arcs == pytest.approx(25.4 * math.pi, rel=1e-12)
    low, high = path.bounding_box()
    assert np.allclose(low, [-12.7, -12.7, 0.0], atol=1e-12) and np.allclose(high, [12.7, 12.7, 6.35], atol=1e-12)
    assert path.feeds is not None and 2.5 * 25.4 / 60 in path.feeds.tolist()


def test_arcs_that_end_off_their_circles_are_refused_or_become_spirals(data_dir: Path) -> None:
    file = data_dir / "gcode" / "cncjs_calibration.gcode"
    with pytest.raises(sf.errors.FormatError) as caught:
        sf.read(file)
    assert str(caught.value) == (
        f"{file}: line 624: the arc ends 1.41377 mm off its circle: radius 29 mm at its start, 27.5862 mm at its end "
        "(tolerance 0.02828 mm and 0.1% of the radius, at most 2.828 mm)"
    )
    path = sf.read(file, repair=True)
    assert sum("off its circle" in finding for finding in path.findings) == 5
    low, high = path.bounding_box()
    assert np.allclose(low, [-25, -25, -10]) and np.allclose(high, [25, 25, 1])
    assert lines_and_arcs(path)[0] == pytest.approx(9665.991294980975, rel=1e-12)


def test_helices_by_radius_in_relative_words(data_dir: Path) -> None:
    file = data_dir / "gcode" / "gcodetoolpath_helical-thread-milling.nc"
    with pytest.raises(sf.errors.FormatError, match=r"line 2: G42 is cutter compensation.*\(G40\)$"):
        sf.read(file)
    path = sf.read(file, repair=True)
    lines, arcs = lines_and_arcs(path)
    assert lines == pytest.approx(0.7500959709905325, rel=1e-12)
    assert arcs == pytest.approx(1.8161170034855103, rel=1e-9)
    low, high = path.bounding_box()
    assert np.allclose(low, [-0.1212, -0.1219, -0.6533], atol=1e-9)
    assert np.allclose(high, [0.1219, 0.1201, 0.0], atol=1e-9)


def test_a_plasma_program_of_mach3_with_probes_and_radii_too_small(data_dir: Path) -> None:
    file = data_dir / "gcode" / "gcodepreview_mach3.gcode"
    assert detect(file.read_bytes()).name == "mach3"
    with pytest.raises(sf.errors.FormatError, match="line 15: G31 is a probe move"):
        sf.read(file)
    path = sf.read(file, repair=True)
    assert sum("2.68286 mm too small for ends 18.3197 mm apart" in finding for finding in path.findings) == 2
    texts = [marker.text for marker in path.markers if marker.text]
    assert texts[:3] == ["S900", "S510", "S3128"] and "M11 P1" in texts and texts[-1] == "M30"
    assert path.dwells[0][1] == 0.2


def test_a_nurbs_that_linuxcnc_has_run(data_dir: Path) -> None:
    path = sf.read(data_dir / "gcode" / "linuxcnc_nurbs.ngc")
    (curve,) = path.curves
    assert curve.degree == 3 and len(curve.control_points) == 15
    assert curve.knots.tolist() == [0, 0, 0, *range(13), 12, 12, 12]
    assert curve.control_points[0].tolist() == [80.0, 0.0, 0.0]
    assert curve.weights is not None and curve.weights[7] == 1.5
    assert path.length == pytest.approx(167.893, abs=1e-3)
    assert path.feeds is not None and path.feeds.tolist() == [60.0]
    assert path.tolerances is not None and path.tolerances.tolist() == [0.01]
    assert [(m.before, m.text, m.dwell) for m in path.markers] == [(0, "", 0.2), (1, "M2", 0.0)]


def test_a_marker_and_a_corner_at_one_place_are_one_stop(data_dir: Path) -> None:
    path = sf.read(data_dir / "gcode" / "gcodepreview_mach3.gcode", repair=True)
    assert np.diff(path.stops).min() > 0.1 and len(path.stops) == 16
    assert set(path.stops) <= set(path.curve_starts.tolist())
