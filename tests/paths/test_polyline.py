"""Path.polyline and paths of many curves: the same, to the bit, as the curves one by one."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest

from motions import vertices
from sample_curves import KNOWN, ROOT_HALF, STILL, butterfly, random_curve
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import Flat, lines_through
from splinefeed.curves.tables import arc_pieces
from splinefeed.errors import CurveError, InputError
from splinefeed.kernels import layout
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path

AXES = [("x", "y"), ("x", "y", "z"), ("x", "a"), ("a",), ("x", "y", "z", "a", "b")]


def walk(axes, count: int = 200, seed: int = 0) -> np.ndarray:
    """Points at random; every fifth step moves the last axis only, and every eleventh turns straight back."""
    random = np.random.default_rng(seed)
    steps = random.normal(size=(count, len(axes)))
    steps[::5, :-1] = 0.0
    steps[11::11] = -steps[10:-1:11]
    return np.vstack([np.zeros(len(axes)), np.cumsum(steps, axis=0)]) + 3.0


def one_by_one(points, axes, **said) -> Path:
    return Path([NurbsCurve.bezier(pair) for pair in itertools.pairwise(points)], axes, **said)


def assert_same(one: Path, other: Path) -> None:
    """The same bits in everything that a path says of itself."""
    for name in ("table", "curve_rows", "curve_starts"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("shape", "length", "size", "closed", "stops", "dwells", "gaps", "axes", "name", "findings", "markers"):
        assert getattr(one, name) == getattr(other, name), name
    assert list(one.corners) == list(other.corners)
    assert one.minimum_radius() == other.minimum_radius()
    for a, b in zip(one.bounding_box(), other.bounding_box(), strict=True):
        assert np.array_equal(a, b)
    s = np.concatenate([np.linspace(0.0, one.length, 777), one.curve_starts])
    assert np.array_equal(one(s), other(s))
    curve, u = one.locate(s)
    for order, side in itertools.product(range(4), ("left", "right")):
        assert np.array_equal(one.evaluate(curve, u, order, side=side), other.evaluate(curve, u, order, side=side))
    assert np.array_equal(one.arc_length(curve, u), other.arc_length(curve, u))


@pytest.mark.nojit
@pytest.mark.parametrize("axes", AXES, ids="".join)
def test_a_polyline_is_its_lines_to_the_bit(axes):
    points = walk(axes)
    said = {
        "name": "walk",
        "findings": ("seen",),
        "feeds": np.linspace(1.0, 2.0, len(points) - 1),
        "tolerances": np.zeros(len(points) - 1),
        "markers": [Marker(7, "M0"), Marker(2, "G4", dwell=0.5)],
    }
    path, plain = Path.polyline(points, axes, **said), one_by_one(points, axes, **said)
    assert_same(path, plain)
    assert_same(path.reversed(), plain.reversed())
    assert_same(pickle.loads(pickle.dumps(path)), plain)
    assert np.array_equal(path.reversed().feeds, path.feeds[::-1])
    moved = path.transformed(2.0, np.ones(len(axes)))
    assert np.array_equal(moved.table, plain.transformed(2.0, np.ones(len(axes))).table)


@pytest.mark.nojit
def test_curves_of_a_polyline_are_made_when_they_are_looked_at():
    points = walk("xyz", 30)
    path, plain = Path.polyline(points), one_by_one(points, None)
    assert len(path.curves) == 30 and tuple(path.curves) == plain.curves
    assert path.curves[-1] == plain.curves[-1] and path.curves[3:5] == plain.curves[3:5]
    assert plain.curves[4] in path.curves and hash(path.curves[4]) == hash(plain.curves[4])
    for curve in (path.curves[2], pickle.loads(pickle.dumps(path.curves[2]))):
        assert curve.length == plain.curves[2].length and np.array_equal(curve(0.3), plain.curves[2](0.3))
    with pytest.raises(IndexError):
        path.curves[30]
    assert path.curves == lines_through(points) and path.curves != lines_through(points[:-1]) and path.curves != 3
    assert repr(path.curves) == "Packed(30 curves)"
    assert repr(path).startswith("Path('path', 30 curve(s), axes x y z,")


def test_a_hundred_thousand_lines():
    random = np.random.default_rng(3)
    points = np.cumsum(random.normal(size=(100_001, 3)), axis=0)
    path = Path.polyline(points)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    wanted = np.concatenate([[0.0], np.cumsum(lengths, dtype=np.longdouble).astype(float)])
    assert np.abs(path.curve_starts - wanted).max() <= 4.0 * np.finfo(float).eps * wanted[-1]
    s = np.linspace(0.0, path.length, 100_003)
    expected = np.column_stack([np.interp(s, wanted, points[:, axis]) for axis in range(3)])
    assert np.abs(path(s) - expected).max() <= 1e-9
    sides = np.diff(points, axis=0)
    cosine = np.sum(sides[1:] * sides[:-1], axis=1) / (lengths[1:] * lengths[:-1])
    assert np.abs(np.cos(path.corners.angle) - cosine).max() <= 1e-12
    assert len(path.stops) == 99_999 and path.minimum_radius() == np.inf


def test_curves_of_every_kind_in_one_table_are_as_each_alone():
    curves = [random_curve(seed, axes=3) for seed in range(36)] + [
        NurbsCurve(c.degree, c.knots, np.column_stack([c.control_points, c.control_points[:, 0]]), c.weights)
        for c in (butterfly(), *KNOWN.values(), *STILL.values())
        if c.axes == 2
    ]
    for axes in (("x", "y", "z"), ("x", "y", "a"), ("x", "a", "b")):
        chain, at = [], np.zeros(3)
        for curve in curves:
            chain.append(curve.transformed(1.0, at - curve.ends[0]))
            at = chain[-1].ends[1]
        path = Path(chain, axes)
        lengths, start, last_digit = [], 0.0, 4.0 * np.finfo(float).eps * path.length
        for i, curve in enumerate(path.joined):
            shape = (curve.degree, curve.axes, curve.axes, int(curve.rational))
            alone = arc_pieces(Flat.of([curve]).scaled(path.metric), shape, [curve])
            rows = path.table[path.curve_rows[i, 0] : path.curve_rows[i, 1] + 1]
            assert len(rows) == len(alone.table)
            for column in (layout.LOW, layout.HIGH, *range(layout.ARC, layout.ARC + layout.ARC_TERMS)):
                assert np.array_equal(rows[:, column], alone.table[:, column])
            assert abs(path.curve_starts[i] - start) <= last_digit
            assert np.abs(rows[:, layout.START] - (alone.table[:, layout.START] + start)).max() <= last_digit
            lengths.append(alone.length)
            start = math.fsum(lengths)
            u = np.linspace(*curve.domain, 31)
            for side in ("left", "right"):
                got = path.evaluate(i, u, 3, side=side)
                assert np.array_equal(got, curve.derivatives(u, 3, side=side))


def test_many_arcs_and_lines_have_their_corners():
    """Rounded squares: line, quarter of a circle, ...; each joint a jump of curvature and no stop."""
    arc, line = np.array([[3.0, 0], [4, 0], [4, 1]]) - [3.5, 0.5], np.array([[-0.5, -0.5], [-0.5, -0.5]])
    curves, at, turn = [], np.zeros(2), np.eye(2)
    for k in range(400):
        for points, weights in ((line + [[0, 0], [2.0 + k % 7, 0]], None), (arc, [1.0, ROOT_HALF, 1.0])):
            placed = (points - points[0]) @ turn.T + at
            curves.append(NurbsCurve.bezier(placed, weights))
            at = placed[-1]
        turn = turn @ [[0, -1], [1, 0]]
    path = Path(curves)
    assert path.length == pytest.approx(sum(2.0 + k % 7 + 0.5 * np.pi for k in range(400)), rel=1e-14)
    assert len(path.corners) == 799 and path.stops == ()
    assert np.abs(path.corners.curvature_jump - 1.0).max() <= 1e-9
    assert path.corners.angle.max() <= 1e-12
    assert path.minimum_radius() == pytest.approx(1.0, rel=1e-9)
    low, high = path.bounding_box()
    boxes = np.array([c.bounding_box() for c in curves])
    assert np.array_equal(low, boxes[:, 0].min(axis=0)) and np.array_equal(high, boxes[:, 1].max(axis=0))


@pytest.mark.nojit
def test_lines_without_length():
    points = np.array([[0, 0], [0, 0], [1, 0], [2, 0], [2, 0], [2, 0], [2, 3.0], [2, 3]])
    with pytest.raises(CurveError) as caught:
        Path.polyline(points)
    assert str(caught.value) == "line 0 from points[0] to points[1] has no length; leave one of them out"
    path = Path.polyline(
        points,
        findings=["read"],
        feeds=[1, 2, 3, 4, 5, 6, 7],
        tolerances=[0.1] * 7,
        markers=[Marker(0, "M3"), Marker(3, "M8"), Marker(5, "M9"), Marker(7, "M30")],
        repair=True,
    )
    assert np.array_equal(vertices(path), [[0, 0], [1, 0], [2, 0], [2, 3]])
    assert path.feeds.tolist() == [2, 3, 6] and len(path.tolerances) == 3
    assert [(m.before, m.text) for m in path.markers] == [(0, "M3"), (2, "M8"), (2, "M9"), (3, "M30")]
    assert path.findings == ("read", "4 line(s) without length left out, the first between points 0 and 1")
    assert_same(Path.polyline(points[[0, 2, 3, 6]], repair=True), Path.polyline(points[[0, 2, 3, 6]]))
    with pytest.raises(CurveError, match="line 0 from points\\[0\\] to points\\[1\\] has no length"):
        Path.polyline([[1, 1], [1, 1]], repair=True)


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([[0.0, 0.0]], "1 point(s) for a polyline; expected at least 2"),
        ([[0.0, 0.0], [np.nan, 1.0]], "points[1, 0] is nan; every value must be finite"),
        ([[0.0, 0.0], [1.0, -1e31]], "points[1, 1] is -1e+31; values up to 1e+30 are possible"),
        ([0.0, 1.0], "points: expected 2 dimension(s), got shape (2,)"),
        (np.zeros((3, 17)), "points have 17 axes; 1 to 16 are possible"),
        ([["a", "b"]], "points: expected numbers in 2 dimension(s), got list"),
    ],
)
def test_points_that_make_no_line(points, said):
    with pytest.raises(InputError) as caught:
        Path.polyline(points)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("place", [0.0, 1e6])
def test_sizes_from_a_nanometre_to_a_kilometre(size, place):
    """Everything scales: lengths, places and corners of the same drawing, small or large, near or far."""
    path = Path([c.transformed(size, [place, -place]) for c in [butterfly()]])
    plain = Path([butterfly()])
    rounding = 8.0 * np.finfo(float).eps * (1.0 + place / size)
    assert path.length == pytest.approx(size * plain.length, rel=1e-13 + 100.0 * rounding)
    s = np.linspace(0.0, 1.0, 101)
    apart = path(s * path.length) - [place, -place] - size * plain(s * plain.length)
    assert np.abs(apart).max() <= (1e-12 * plain.length + 30.0 * rounding) * size * 10.0
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]]) * size + place
    boxed = Path.polyline(square)
    assert boxed.length == pytest.approx(4.0 * size, rel=1e-15 + rounding) and boxed.closed
    assert len(boxed.stops) == 3 and boxed.corners.angle == pytest.approx([np.pi / 2] * 3, rel=1e-15 + rounding)
