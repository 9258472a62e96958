"""Kernels of arc length, matching and smoothing, one by one: against quadrature and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import BSpline
from scipy.optimize import minimize_scalar

import reference
from splinefeed.curves import tables
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import Flat
from splinefeed.curves.pieces import arc
from splinefeed.kernels import layout, matching
from splinefeed.paths import meetings, smoothing_runs
from splinefeed.paths.fitting.grid import graded, halved
from splinefeed.paths.path import Path

pytestmark = pytest.mark.nojit

#: A rational cubic without symmetry, one knot span.
CURVE = NurbsCurve.bezier([[0, 0], [1, 2], [3, 2.5], [4, 0.5]], [1.0, 0.7, 1.3, 0.9])


def speed(u: float) -> float:
    """|C'(u)| of CURVE with 40 digits."""
    return float(np.linalg.norm(reference.derivatives(CURVE, u, 1)[1]))


def test_the_speed_of_a_piece_is_fitted_and_its_integral_is_the_length():
    (spans,) = tables.Spans.of(Flat.of([CURVE]))
    shape = (3, 2, 2, 1)
    c = spans.columns(shape)
    assert not tables.fits(spans, c, shape, np.array([5.0]))  # one piece is too long for 14 digits, but not for 4
    slopes = c[layout.ARC : layout.ORIGIN, 0] * np.arange(layout.ARC_TERMS)
    for t in (-1.0, -0.4, 0.3, 1.0):
        u = 0.5 * (t + 1.0)
        wanted, _ = quad(speed, 0.0, u, epsabs=1e-10)
        assert arc(c, np.array([t])) == pytest.approx(wanted, abs=1e-3)
        assert np.polynomial.polynomial.polyval(t, slopes[1:]) == pytest.approx(0.5 * speed(u), rel=2e-3)
    (line,) = tables.Spans.of(Flat.of([NurbsCurve.bezier([[0, 0], [3, 4]])]))
    c = line.columns((1, 2, 2, 0))
    assert tables.fits(line, c, (1, 2, 2, 0), np.zeros(1))
    assert arc(c, np.array([-1.0, 0.0, 0.5, 1.0])) == pytest.approx([0.0, 2.5, 3.75, 5.0])


def test_the_length_at_a_parameter_and_back_is_the_integral_of_the_speed():
    u = np.array([0.0, 0.11, 0.37, 0.5, 0.83, 1.0])
    wanted = np.array([quad(speed, 0.0, x, epsabs=1e-12, epsrel=1e-12)[0] for x in u])
    pieces_of = Path([CURVE]).arc_pieces
    assert len(pieces_of.table) > 1
    assert pieces_of.lengths_at(None, u) == pytest.approx(wanted, abs=1e-12)
    assert np.array_equal(pieces_of.lengths_at(None, u), pieces_of.lengths_at(np.zeros(6, dtype=np.int64), u))
    assert pieces_of.parameters(wanted) == pytest.approx(u, abs=1e-12)
    assert pieces_of.parameters(np.array([-1.0, 99.0])).tolist() == [0.0, 1.0]


def test_a_line_a_curve_and_a_line_are_one_table():
    path = Path([NurbsCurve.bezier([[-3, -4], [0, 0]]), CURVE, NurbsCurve.bezier([[4, 0.5], [4, 2.5]])])
    length = quad(speed, 0.0, 1.0, epsabs=1e-12, epsrel=1e-12)[0]
    rows = len(CURVE.arc.table)
    assert path.curve_starts == pytest.approx([0.0, 5.0, 5.0 + length, 7.0 + length], rel=1e-14)
    assert path.curve_rows.tolist() == [[0, 0], [1, rows], [rows + 1, rows + 1]]
    assert path.table[:, layout.START][[0, 1, -1]] == pytest.approx([0.0, 5.0, 5.0 + length], rel=1e-14)
    assert path.span_pieces.rows.tolist() == [[0, 0], [1, 1], [2, 2]]


@pytest.mark.parametrize("seed", range(12))
def test_the_least_distance_of_two_chords_is_that_of_brute_force(seed: int):
    random = np.random.default_rng(seed)
    points = random.normal(size=(4, 2 + seed % 2))
    if seed % 4 == 3:
        points[3] = points[2] + 0.7 * (points[1] - points[0])  # parallel ones
    (found,), (shares,) = meetings.closest(points, np.array([0]), np.array([2]))
    x, y = (points[i] + shares[k] * (points[i + 1] - points[i]) for k, i in enumerate((0, 2)))
    assert found == pytest.approx(float(np.sum((x - y) ** 2)), rel=1e-12, abs=1e-15)

    def apart(s: float) -> float:
        """From the place s of the first chord to the nearest of the second one: a convex function."""
        off, step = points[0] + s * (points[1] - points[0]) - points[2], points[3] - points[2]
        t = np.clip(np.dot(off, step) / np.dot(step, step), 0.0, 1.0)
        return float(np.sum((off - t * step) ** 2))

    inner = minimize_scalar(apart, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-12}).fun
    assert found == pytest.approx(min(inner, apart(0.0), apart(1.0)), rel=1e-9, abs=1e-12)
    assert np.all((shares >= 0.0) & (shares <= 1.0))


def test_a_chord_runs_back_where_it_turns_by_more_than_its_cosine_says():
    for angle, back in (
        (0.0, False),
        (1.5, False),
        (3.0, False),
        (math.acos(-0.9959), False),
        (3.1, True),
        (-3.1, True),
    ):
        end = [1.0 + 3.0 * math.cos(angle), 3.0 * math.sin(angle)]
        points = np.array([[9.0, 9.0], [0.0, 0.0], [1.0, 0.0], end, [7.0, 7.0]])
        assert meetings.runs_back(points)[1] == back


def test_meetings_of_a_line_with_itself_are_where_its_chords_cross():
    """A figure eight of 40 chords, (cos t, sin 2 t): it meets itself in the middle once, and at its ends."""
    t = np.linspace(0.2, 0.2 + 2.0 * math.pi, 41)
    points = np.column_stack([np.cos(t), np.sin(2.0 * t)])
    found = meetings.meetings(points, 1e-9, 8)
    assert found is not None and len(found) == 2
    chord = t[1] - t[0]
    at = 0.2 + chord * found
    middle, ends = sorted(at.tolist(), key=lambda pair: pair[1] - pair[0])
    # chords cross near t = pi/2 and 3 pi/2, at the crossing of the two chords exactly
    assert middle == pytest.approx([0.5 * math.pi, 1.5 * math.pi], abs=chord)
    assert ends == pytest.approx([0.2, 0.2 + 2.0 * math.pi], abs=1e-9)
    for i, j in found:
        p, q = (np.array([np.interp(x, np.arange(41), points[:, k]) for k in range(2)]) for x in (i, j))
        assert p == pytest.approx(q, abs=1e-9)
    assert meetings.meetings(points, 1e-9, 1) is None  # too many


@pytest.mark.parametrize("seed", range(4))
def test_meetings_of_a_tangle_are_those_of_every_pair(seed: int):
    points = np.random.default_rng(seed).uniform(size=(60 + seed, 2))
    first, second = np.triu_indices(len(points) - 1, 2)
    square, shares = meetings.closest(points, first, second)
    wanted = (np.column_stack([first, second]) + shares)[square <= 1e-18]
    found = meetings.meetings(points, 1e-9, 10_000)
    assert found is not None and len(wanted) > 100
    found = found[np.floor(found[:, 1]) > np.floor(found[:, 0]) + 1.0]  # without neighbours that run back
    assert found == pytest.approx(wanted[np.lexsort((wanted[:, 1], wanted[:, 0]))], abs=1e-12)


def test_the_nearest_share_is_the_least_of_the_larger_distance():
    random = np.random.default_rng(3)
    for _ in range(20):
        p, q = random.normal(size=(3, 3)), random.normal(size=(4, 3))

        def apart(share: float, p=p, q=q) -> float:
            off = q[2] + share * (q[3] - q[2]) - p[1]
            return max(float(np.sum(off[:2] ** 2)), float(off[2] ** 2))

        found = matching.nearest_share(p, 1, q, 2, 2)
        sampled = min(apart(x) for x in np.linspace(0.0, 1.0, 301))
        assert apart(found) <= sampled + 1e-12
        # the distance at shares of both is that of the places, too
        here = matching.apart(p, 1, 0.0, q, 2, found, 2)
        assert here == pytest.approx(apart(found), rel=1e-12)
        x, y = p[1] + 0.3 * (p[2] - p[1]), q[0] + 0.8 * (q[1] - q[0])
        wanted = max(float(np.sum((x - y)[:2] ** 2)), float((x - y)[2] ** 2))
        assert matching.apart(p, 1, 0.3, q, 0, 0.8, 2) == pytest.approx(wanted, rel=1e-12)


def side_by_side(p: np.ndarray, q: np.ndarray, limit: float, room: int = 2000) -> np.ndarray | None:
    """The way through both lines, (n, 2), chord and share in one number, from the first point; None without one."""
    lows, starts = np.zeros(len(p), dtype=np.int64), np.zeros(len(p), dtype=np.int64)
    places, ways = np.empty((room, 2)), np.empty((room, 2), dtype=np.int64)
    used = matching.side_by_side(p, q, 2, limit, lows, starts, places, ways)
    if used < 0:
        assert used == -room
        return side_by_side(p, q, limit, 10 * room)
    if used == 0:
        return None
    out = np.empty((len(p) + len(q), 2))
    return out[: matching.traced(lows, starts, places, ways, out)][::-1]


@pytest.mark.parametrize("room", [5, 2000])
def test_a_line_beside_itself_is_passed_point_by_point(room: int):
    """The same wave in 13 chords and in 31: the way keeps to equal places, forwards only, and to the offset."""
    x, y = np.linspace(0.0, 6.0, 14), np.sort(np.append(np.linspace(0.0, 6.0, 30), [1.1, 4.4]))
    offset = 0.02
    p = np.column_stack([x, 0.5 * x])
    q = np.column_stack([y, 0.5 * y + offset])
    way = side_by_side(p, q, 0.01, room)
    assert way is not None
    assert way[-1].tolist() == [13.0, 31.0]
    assert np.all(np.diff(way, axis=0) >= 0.0)
    at = [np.column_stack([np.interp(way[:, k], np.arange(len(line)), line[:, a]) for a in (0, 1)]) for k, line in
          enumerate((p, q))]  # fmt: skip
    # straight lines side by side: from one to the nearest of the other, but where both begin and end
    off = np.linalg.norm(at[0] - at[1], axis=1)
    assert np.max(off) <= offset + 1e-12
    assert off[:-1] == pytest.approx(np.full(len(off) - 1, offset * 2.0 / math.sqrt(5.0)), rel=0.2)
    # every point of both lines is passed
    for k, line in enumerate((p, q)):
        assert set(range(1, len(line))) <= set(way[:, k].tolist())


def test_lines_that_part_have_no_way_side_by_side():
    x = np.linspace(0.0, 6.0, 14)
    p = np.column_stack([x, 0.0 * x])
    away = np.column_stack([x, 0.2 * x])
    assert side_by_side(p, away, 0.01) is None
    assert side_by_side(p, p[::-1].copy(), 0.01) is None  # the other way round
    assert side_by_side(p, away, 1.3**2) is not None


@pytest.mark.parametrize("spans", [1, 2, 5])
def test_a_least_squares_spline_is_that_of_numpy(spans: int):
    """The inner coefficients by NumPy's least squares over SciPy's basis, with both end points taken off before."""
    random = np.random.default_rng(spans)
    s = np.sort(np.append(random.uniform(0.0, 2.0, 60), [0.0, 2.0]))
    points = np.column_stack([np.sin(3.0 * s), np.cos(s)]) + 1e-3 * random.normal(size=(len(s), 2))
    weights = random.uniform(0.5, 2.0, len(s))
    knots = np.array([0.0] * 5 + np.linspace(0.0, 2.0, spans + 1).tolist() + [2.0] * 5)
    found, off, span = smoothing_runs.least_squares(s, points, weights, knots)
    assert off == pytest.approx(BSpline(knots, found, smoothing_runs.DEGREE)(s) - points, abs=1e-12)
    assert np.array_equal(span, np.minimum(np.searchsorted(knots[6:-6], s, side="right"), spans - 1))
    matrix = BSpline.design_matrix(s, knots, smoothing_runs.DEGREE).toarray()
    rest = points - np.outer(matrix[:, 0], points[0]) - np.outer(matrix[:, -1], points[-1])
    root = np.sqrt(weights)[:, None]
    inner = np.linalg.lstsq(root * matrix[:, 1:-1], root * rest, rcond=None)[0]
    assert found == pytest.approx(np.concatenate([points[:1], inner, points[-1:]]), rel=1e-8, abs=1e-9)
    few = slice(0, 4)
    with pytest.raises(np.linalg.LinAlgError):  # they leave some open
        smoothing_runs.least_squares(s[few], points[few], weights[few], knots)


def test_a_graded_grid_halves_what_is_wide_and_what_is_wide_beside_it():
    wide = np.array([True, False, False])
    grid = graded(halved(np.array([0.0, 1.0, 2.0, 10.0]), wide), grade=smoothing_runs.GRADE)
    assert {0.0, 0.5, 1.0, 2.0, 10.0} <= set(grid.tolist())
    width = np.diff(grid)
    assert np.all(width[1:] <= smoothing_runs.GRADE * width[:-1]) and np.all(width[:-1] <= 2.5 * width[1:])
    assert graded(np.array([0.0, 1.0, 2.0]), grade=smoothing_runs.GRADE).tolist() == [0.0, 1.0, 2.0]
