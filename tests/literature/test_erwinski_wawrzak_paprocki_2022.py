"""K. Erwinski, A. Wawrzak, M. Paprocki, IEEE Trans. Industrial Informatics 18(11), 2022, doi 10.1109/TII.2022.3147806.

Table I there: accumulated arc error of four interpolators, mm: Taylor-2 7.537, Taylor-3 3.524, feed-correction
polynomial 0.055, Runge-Kutta 2 with a corrector 5.7e-8. The curves of the paper are not at hand. These tests take the
same interpolators over curves of that kind of our own choice, at a constant feed, and hold the order and what makes
it: the corrector mends the chord of a step, so that is the measure in which it wins. Along the arc it runs ahead.
"""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from sample_curves import ellipse
from splinefeed.analysis.measures import drift

#: Name, path, feed in mm/s. None of them is the paper's.
CURVES = {
    "quartic": (motions.smooth(), 100.0),
    "ellipse": (sf.Path([ellipse(50.0, 20.0)]), 200.0),
    "airfoil": (sf.shapes.naca("0025", chord=100.0), 200.0),
    "butterfly": (motions.butterfly(), 60.0),
}
PERIOD = 1e-3


def accumulated(path: sf.Path, feed: float, method: str) -> tuple[float, float]:
    """Sum of | |step| - V T | over the chords, and over the arcs, mm; the short last step is left out."""
    law = motions.constant(path, feed)
    points = sf.interpolate(path, law, period=PERIOD, method=method, corrections=2)
    chords = np.linalg.norm(np.diff(points.position, axis=0), axis=1)
    arcs = np.diff(drift(points, law))
    return float(np.sum(np.abs(chords[:-1] - feed * PERIOD))), float(np.sum(np.abs(arcs[:-1])))


@pytest.mark.parametrize("name", CURVES)
def test_table_1_the_order_of_the_accumulated_errors(name):
    path, feed = CURVES[name]
    taylor, correction, compensated = (
        accumulated(path, feed, method)[0] for method in ("taylor-2", "feed-correction", "runge-kutta-2-compensated")
    )
    assert taylor > 3 * correction
    assert correction > 1000 * compensated
    assert compensated < 1e-5


@pytest.mark.parametrize("name", ["quartic", "ellipse", "airfoil"])
def test_table_1_a_third_taylor_term_gains_on_smooth_curves(name):
    path, feed = CURVES[name]
    assert accumulated(path, feed, "taylor-3")[0] < 0.5 * accumulated(path, feed, "taylor-2")[0]


def test_a_third_taylor_term_loses_on_the_butterfly():
    """Near its cusps |C'| changes faster than a step can follow: there the series diverges."""
    path, feed = CURVES["butterfly"]
    assert accumulated(path, feed, "taylor-3")[0] > accumulated(path, feed, "taylor-2")[0]


@pytest.mark.parametrize("name", CURVES)
def test_along_the_arc_the_order_is_another(name):
    """What the corrector leaves along the arc is what the feed-correction polynomial leaves along the chord."""
    path, feed = CURVES[name]
    floor = accumulated(path, feed, "milne-simpson-anchored")[0]  # sum of kappa^2 (V T)^3 / 24
    arc_of_corrector = accumulated(path, feed, "runge-kutta-2-compensated")[1]
    chord_of_polynomial, arc_of_polynomial = accumulated(path, feed, "feed-correction")
    assert arc_of_corrector == pytest.approx(floor, rel=0.03)
    assert chord_of_polynomial == pytest.approx(floor, rel=0.01)
    assert arc_of_polynomial < 0.01 * arc_of_corrector
    assert accumulated(path, feed, "milne-simpson-anchored")[1] < 1e-10
