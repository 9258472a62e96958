"""Corners inside a curve are corners for smoothing and rounding, as those between curves are (LaserGRBL#810)."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.parts import cut_at_corners
from splinefeed.paths.smoothing import smoothed

LIMITS = sf.Limits(feed=50.0, axis_acceleration=500.0, axis_jerk=20000.0)
POLYGON = 30.0 * np.stack([np.cos(np.linspace(0.0, 2 * np.pi, 121)), np.sin(np.linspace(0.0, 2 * np.pi, 121))], axis=1)


def _as_one(points: np.ndarray) -> sf.Path:
    """A polyline as one curve of degree 1."""
    count = len(points)
    return sf.Path([sf.NurbsCurve(1, [0, *range(count), count - 1], points)])


def test_a_polyline_in_one_curve_is_smoothed_as_its_lines_are() -> None:
    one, lines = _as_one(POLYGON), sf.Path.polyline(POLYGON)
    assert len(one.stops) == len(lines.stops) == 119
    smooth, expected = smoothed(one, 0.02), smoothed(lines, 0.02)
    assert len(smooth.stops) == len(expected.stops) == 0
    assert smooth.length == expected.length
    times = [sf.run(path, LIMITS).law.duration for path in (smooth, expected, one)]
    assert times[0] == times[1] < 0.3 * times[2]


CORNERED = {
    "cubic, a knot of multiplicity 3": sf.NurbsCurve(
        3, [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2], [[0, 0], [10, 0], [20, 0], [30, 0], [30, 10], [30, 20], [30, 30]]
    ),
    "rational parabolas": sf.NurbsCurve(
        2, [0, 0, 0, 1, 1, 2, 2, 2], [[0, 0], [10, 5], [20, 0], [20, 10], [30, 20]], [1, 1, 1, 0.7, 1]
    ),
    "degree 1 with weights": sf.NurbsCurve(1, [0, 0, 1, 2, 2], [[0, 0], [20, 0], [20, 20]], [1, 2, 1]),
}


@pytest.mark.parametrize("name", CORNERED)
def test_corners_of_any_curve_are_rounded_where_they_are_to_be(name: str) -> None:
    path = sf.Path([CORNERED[name]])
    assert len(path.stops) == 1
    apart = sf.Path(list(cut_at_corners(path)[0].curves))
    for corners in ("keep", "round"):
        assert len(smoothed(path, 0.1, corners=corners).stops) == len(smoothed(apart, 0.1, corners=corners).stops)
    rounded = smoothed(path, 0.1, corners="round")
    assert len(rounded.stops) == 0
    places = rounded(np.linspace(0.0, rounded.length, 2000))
    curve = CORNERED[name]
    assert np.max(curve.nearest(places)[1]) < 0.1


def test_what_is_said_of_a_curve_is_said_of_its_parts() -> None:
    one = CORNERED["cubic, a knot of multiplicity 3"]
    line = sf.NurbsCurve(1, [0, 0, 1, 1], [[30, 30], [50, 30]])
    markers = [sf.paths.Marker(1, "M8", stop=False), sf.paths.Marker(2, "M9")]
    path = sf.Path([one, line], feeds=[10.0, 20.0], tolerances=[0.1, 0.2], markers=markers, lines=[3, 4], name="two")
    parts, counts = cut_at_corners(path)
    assert counts.tolist() == [2, 1]
    assert parts.feeds is not None and parts.feeds.tolist() == [10.0, 10.0, 20.0]
    assert parts.tolerances is not None and parts.tolerances.tolist() == [0.1, 0.1, 0.2]
    assert parts.lines is not None and parts.lines.tolist() == [3, 3, 4]
    assert [marker.before for marker in parts.markers] == [2, 3]
    assert parts.length == pytest.approx(path.length, rel=1e-12)
    s = np.linspace(0.0, path.length, 500)
    assert np.max(np.abs(parts(s * parts.length / path.length) - path(s))) < 1e-9


def test_what_has_no_corner_inside_stays_itself() -> None:
    butterfly = sf.shapes.butterfly()
    assert cut_at_corners(butterfly)[0] is butterfly
    circle = sf.shapes.from_text("circle?radius=10")
    assert cut_at_corners(circle)[0] is circle
    assert smoothed(circle, 0.01).length == pytest.approx(circle.length, rel=1e-9)
