"""The check evaluates by itself: faults of the tables that planner and interpolator share are found, none is read."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from typing import NoReturn

import numpy as np
import pytest

import motions
import splinefeed as sf
from sample_curves import random_curve
from splinefeed.checks.spans import PathSpans, SpanPlaces
from splinefeed.curves import pieces, tables
from splinefeed.curves.curve import NurbsCurve
from splinefeed.kernels import layout
from splinefeed.paths import joined_curves
from splinefeed.paths import path as path_module

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_acceleration=500, centripetal=400, chord_error=1e-3)


def path() -> sf.Path:
    """A line, a cubic over several spans, and an arc: not one table is made before it is asked for."""
    cubic = sf.NurbsCurve(3, [0, 0, 0, 0, 1, 2, 3, 3, 3, 3], [[20, 0], [25, 0], [30, 5], [35, 15], [40, 15], [45, 15]])
    arc = sf.NurbsCurve.bezier([[45, 15], [55, 15], [55, 25]], [1, np.sqrt(0.5), 1])
    return sf.Path([sf.NurbsCurve.bezier([[0, 0], [20, 0]]), cubic, arc])


def motion(limits: sf.Limits = LIMITS) -> tuple[sf.Setpoints, sf.TimeLaw]:
    made = path()
    law = sf.plan(made, limits, period=1e-3)
    return sf.interpolate(made, law), law


def test_nothing_but_control_points_weights_and_knots_is_read(monkeypatch):
    points, law = motion()
    stranger = dataclasses.replace(points, u=np.full(len(points), np.nan), curve=np.full(len(points), -1))
    fresh = path()

    def read(self: object) -> NoReturn:
        raise AssertionError("the check reads a table of the path")

    for name in (
        "arc_pieces",
        "span_pieces",
        "table",
        "length",
        "curve_starts",
        "curve_rows",
        "corners",
        "stops",
        "dwells",
    ):
        monkeypatch.setattr(path_module.Path, name, property(read))
    monkeypatch.setattr(NurbsCurve, "_pieces", property(read))
    monkeypatch.setattr(NurbsCurve, "arc", property(read))
    for name in ("locate", "evaluate", "arc_length", "__call__"):
        monkeypatch.setattr(path_module.Path, name, read)
    assert sf.check(points, fresh, LIMITS, law=law).ok
    assert sf.check(stranger, fresh, LIMITS).ok


def test_a_wrong_expansion_of_a_span_is_found(monkeypatch):
    """One coefficient of every cubic and arc is off by a millionth, in the tables of planner and interpolator alike."""
    right = tables.power_form

    def wrong(*given):
        out = right(*given)
        out[2:] *= 1.0 + 1e-6
        return out

    monkeypatch.setattr(tables, "power_form", wrong)
    points, law = motion()
    problems = sf.check(points, path(), LIMITS, law=law).problems
    assert any("off the curve" in each for each in problems)


def test_an_arc_length_that_is_wrong_everywhere_is_found(monkeypatch):
    """The table says 0.1 % less than the path is long: planned at the feed, everything is 0.1 % too fast."""
    right = tables.arc_pieces

    def wrong(*given):
        made = right(*given)
        table = made.table.copy()
        table[:, layout.START : layout.ORIGIN] *= 0.999
        return pieces.Pieces(table, made.shape, made.rows, 0.999 * made.curve_starts)

    monkeypatch.setattr(joined_curves, "arc_pieces", wrong)
    points, law = motion(sf.Limits(feed=20, acceleration=500, jerk=20000))
    verdict = sf.check(points, path(), sf.Limits(feed=20, acceleration=500, jerk=20000), law=law)
    assert verdict.limits["feed"].share > 1.0009
    assert not verdict.limits["feed"].holds
    assert any(each.startswith("law: runs from s = 0 to") for each in verdict.problems)


def test_a_wrong_kernel_of_the_derivatives_is_found(monkeypatch):
    """Second derivatives are half of what they are: the planner sees half of every bend and goes too fast."""
    right = pieces.derivatives

    def wrong(c, shape, t, order, out):
        right(c, shape, t, order, out)
        out[:, 2:] *= 0.5

    monkeypatch.setattr(pieces, "derivatives", wrong)
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, centripetal=60)
    points, law = motion(limits)
    verdict = sf.check(points, path(), limits, law=law)
    assert verdict.limits["centripetal"].share > 1.2


@pytest.mark.parametrize("seed", [None, *range(36)])
def test_spans_agree_with_the_tables_of_the_path(seed):
    """Two evaluators that share nothing: on the butterfly and curves of all kinds, points and lengths are the same."""
    curve = motions.butterfly().curves[0] if seed is None else random_curve(seed)
    given = sf.Path([curve])
    spans = PathSpans(given.flat, given.linear)
    u = np.sort(np.random.default_rng(1).uniform(*curve.domain, 1000))
    index = np.zeros(len(u), dtype=np.int64)
    row, _ = spans.find(index, u)
    places = SpanPlaces(spans, row)
    t = places.t(u)
    exact = 1e-13 * (curve.size + float(np.max(np.abs(curve.control_points))))
    np.testing.assert_allclose(places.derivatives(t, 0)[0].T, given.evaluate(index, u)[:, 0], rtol=0, atol=10 * exact)
    s = spans.arc_length(row, t)
    np.testing.assert_allclose(s, given.arc_length(index, u), rtol=0, atol=1e-12 * given.length)
    np.testing.assert_allclose(spans.parameter(row, s - spans.start[row]), t, rtol=0, atol=1e-7)


def test_a_narrow_span_far_from_zero_is_met_to_the_bit_of_its_parameter():
    """A span of 1e-6 at u = 3: a bit of u is 1e-9 mm there, so it is expanded about what its middle is rounded to."""
    knots = [0, 0, 0, 0, 1, 2, 3, 3.000001, 3.000002, 3.000002, 3.000002, 3.000002]
    points = [[0, 0], [1, 2], [2, -1], [3, 1], [4, 0.5], [5, 1], [6, 0], [7, 0.5]]
    curve = sf.NurbsCurve(3, knots, points)
    narrow = sf.Path([curve])
    spans = PathSpans(narrow.flat, 2)
    u = np.sort(np.random.default_rng(3).uniform(3.0, 3.000002, 200))
    row, _ = spans.find(np.zeros(len(u), dtype=np.int64), u)
    places = SpanPlaces(spans, row)
    found = places.derivatives(places.t(u), 0)[0].T
    for k in range(0, len(u), 10):
        assert found[k] == pytest.approx(exactly(curve, u[k]), abs=1e-14)


def exactly(curve: sf.NurbsCurve, u: float) -> list[float]:
    """A point by de Boor's algorithm in fractions."""
    p, at, knots = curve.degree, Fraction(u), [Fraction(float(knot)) for knot in curve.knots]
    k = max(i for i in range(p, len(curve.control_points)) if knots[i] <= at)
    d = [[Fraction(float(x)) for x in curve.control_points[j + k - p]] for j in range(p + 1)]
    for r in range(1, p + 1):
        for j in range(p, r - 1, -1):
            share = (at - knots[j + k - p]) / (knots[j + 1 + k - r] - knots[j + k - p])
            d[j] = [(1 - share) * x + share * y for x, y in zip(d[j - 1], d[j], strict=True)]
    return [float(x) for x in d[p]]
