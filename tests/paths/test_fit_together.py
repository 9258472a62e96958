"""Arc lengths of many curves fitted in one go are those of each alone, to the bit."""

import numpy as np

import splinefeed as sf
from splinefeed.curves.tables import fit_together


def _curves() -> list[sf.NurbsCurve]:
    random = np.random.default_rng(39)
    lines = [sf.NurbsCurve(1, [0, 0, 1, 1], random.normal(size=(2, 2))) for _ in range(3)]
    knots = [0, 0, 0, 0, 0.3, 1, 1, 1, 1]
    cubics = [sf.NurbsCurve(3, knots, random.normal(size=(5, axes))) for axes in (2, 2, 3)]
    rational = [sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], random.normal(size=(3, 2)), [1, w, 1]) for w in (0.3, 0.7, 2.0)]
    return [*lines, *cubics, *rational]


def test_each_keeps_its_own_to_the_bit() -> None:
    together, alone = _curves(), _curves()
    fit_together(together)
    assert sum("arc" in vars(curve) for curve in together) == 8  # the one cubic in space is alone of its kind
    for one, other in zip(together, alone, strict=True):
        assert one.length == other.length
        assert np.array_equal(one.arc.table, other.arc.table)
        assert np.array_equal(one.arc.rows, other.arc.rows)
        assert np.array_equal(one.arc.curve_starts, other.arc.curve_starts)
