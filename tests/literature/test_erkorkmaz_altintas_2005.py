"""K. Erkorkmaz, Y. Altintas, ASME Journal of Manufacturing Science and Engineering 127(2), 2005, p. 339-349.

Their feed-correction polynomial gives u as a polynomial of degree 7 in s: least squares through points of the inverse
of the arc length, with value, slope and bend of both ends as conditions, one linear system of 14 unknowns a segment
(8 coefficients, 6 multipliers; so counted in K. Erkorkmaz, the same journal 137(4), 2015, 044501). Ours is closed.
"""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from sample_curves import ellipse
from splinefeed.interpolation.stepping import SAMPLES, TERMS, fit_feed_correction
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE, START
from splinefeed.kernels.pieces import arc_length, fitted_speed

pytestmark = pytest.mark.nojit


def by_multipliers(table: np.ndarray, row: int) -> np.ndarray:
    """The 8 coefficients as the paper finds them: the least squares with its conditions, 14 equations at once."""
    low, high = ((table[row, end] - table[row, MIDDLE]) * table[row, SCALE] for end in (LOW, HIGH))
    length = arc_length(table, row, high) - table[row, START]
    t = low + (high - low) * np.arange(1, SAMPLES + 1) / (SAMPLES + 1)
    x = np.array([(arc_length(table, row, each) - table[row, START]) / length for each in t])
    powers = np.arange(TERMS)
    fit = x[:, None] ** powers
    conditions, values = [], []
    for place, end in ((0.0, low), (1.0, high)):
        speed, bend, _ = fitted_speed(table, row, end)
        slope = length / speed
        conditions += [
            place**powers,
            powers * place ** np.maximum(powers - 1, 0),
            powers * (powers - 1) * place ** np.maximum(powers - 2, 0),
        ]
        values += [end, slope, -(slope**2) * bend / speed]
    held = np.array(conditions)
    system = np.block([[fit.T @ fit, held.T], [held, np.zeros((6, 6))]])
    return np.linalg.solve(system, np.concatenate([fit.T @ t, values]))[:TERMS]


def rows(path: sf.Path, most: int) -> list[int]:
    """Some of the table's rows, evenly spread; the last is a sentinel."""
    last = len(path.table) - 1
    return list(range(0, last, max(1, last // most)))


PATHS = [motions.smooth(), motions.butterfly(), sf.Path([ellipse(50.0, 20.0)], name="ellipse")]


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
def test_the_closed_form_solves_the_papers_system_of_14_unknowns(path):
    x = np.linspace(0.0, 1.0, 51)
    for row in rows(path, 20):
        coefficients = np.zeros(TERMS)
        fit_feed_correction(path.table, row, coefficients)
        ours, theirs = (np.polyval(each[::-1], x) for each in (coefficients, by_multipliers(path.table, row)))
        assert ours == pytest.approx(theirs, abs=1e-11)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
def test_parameter_feed_and_acceleration_are_continuous_between_segments(path):
    """u, du/ds and d2u/ds2 at the end of each segment are those at the start of the next, but where C'' jumps."""
    table, coefficients = path.table, np.zeros(TERMS)
    knots = set(path.curves[0].knots)
    checked = 0
    for row in range(len(table) - 2):
        if table[row, HIGH] in knots or table[row, HIGH] != table[row + 1, LOW]:
            continue
        sides = []
        for which, at in ((row, 1.0), (row + 1, 0.0)):
            length = fit_feed_correction(table, which, coefficients)
            poly = np.polynomial.Polynomial(coefficients.copy())
            scale = table[which, SCALE]
            u = table[which, MIDDLE] + poly(at) / scale
            sides.append((u, poly.deriv()(at) / (scale * length), poly.deriv(2)(at) / (scale * length**2)))
        assert sides[0][:2] == pytest.approx(sides[1][:2], rel=1e-9)
        assert sides[0][2] == pytest.approx(sides[1][2], rel=1e-4, abs=1e-7)
        checked += 1
    assert checked > 5


def test_the_feed_fluctuates_hundreds_of_times_less_than_taylor_leaves_it():
    """What the paper is for: at a constant feed, beside its own peers of first and second order."""
    path = motions.smooth()
    law = motions.constant(path, 60.0)
    ripple = {}
    for method in ("taylor-1", "taylor-2", "feed-correction"):
        points = sf.interpolate(path, law, period=1e-3, method=method)
        # the last, short period takes up a method's drift: that is no fluctuation
        ripple[method] = np.max(np.abs(sf.analysis.feed_ripple(points, path, law).relative[:-1]))
    assert ripple["taylor-1"] > 100 * ripple["taylor-2"]
    assert ripple["taylor-2"] > 500 * ripple["feed-correction"]
