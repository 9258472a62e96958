"""Long stretches by windows: as fast as in one piece, no seam in the profile, every limit held."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.feed.bounds import AxisLimits
from splinefeed.feed.law_pieces import Pieces
from splinefeed.feed.square import Setting
from splinefeed.feed.window import solve
from splinefeed.feed.windows import joints, solve_long

PERIOD = 1e-3
LIMITS = sf.Limits(feed=100, axis_velocity=100, axis_acceleration=2000, axis_jerk=50000)


def row(copies: int) -> sf.Path:
    """Butterflies one behind the other, each from where the last one ends: no corner between them asks for rest."""
    (one,) = motions.butterfly().curves
    step = one.control_points[-1] - one.control_points[0]
    return sf.Path(
        [sf.NurbsCurve(one.degree, one.knots, one.control_points + k * step, one.weights) for k in range(copies)]
    )


def setting_of(path: sf.Path) -> Setting:
    none = np.zeros(0)
    return Setting(LIMITS, AxisLimits.of(LIMITS, path.axes), PERIOD, none, none, none)


@pytest.fixture(scope="module")
def path() -> sf.Path:
    return row(3)


@pytest.mark.slow
def test_windows_are_as_fast_as_one_piece_and_their_bound_no_higher_than_its_time(path: sf.Path) -> None:
    setting = setting_of(path)
    at, half = joints(path, 0.0, path.length, setting)
    long = solve_long(path, 0.0, path.length, setting, at, half)
    whole = solve(path, 0.0, path.length, (0.0, 0.0), setting)
    assert len(at) >= 1
    assert long is not None
    assert long.over < 1 + 1e-3
    assert long.pieces.duration == pytest.approx(whole.pieces.duration, rel=1e-4)
    assert whole.lower_bound * (1 - 1e-3) < long.lower_bound < whole.lower_bound * (1 + 1e-5)
    for seam in at:
        # the same profile in and around every seam, where windows are mixed
        s = np.linspace(seam - half, seam + half, 2001)
        windowed, single = (feeds_at(pieces, s) for pieces in (long.pieces, whole.pieces))
        assert np.max(np.abs(windowed - single)) < 0.02 * 100


def feeds_at(pieces: Pieces, s: np.ndarray) -> np.ndarray:
    t = np.linspace(0, pieces.duration, 400_000)
    return np.interp(s, pieces.at(t), pieces.at(t, 1))


def test_a_plan_by_windows_keeps_every_limit_without_a_seam(path: sf.Path) -> None:
    law = sf.plan(path, LIMITS, strategy="time-optimal", period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, LIMITS, law).ok
    assert not law.notes
    inner, spans = law.coefficients[:-1], np.diff(law.breaks)[:-1]
    for order in range(3):
        factors = np.array([np.prod(np.arange(k, k - order, -1), initial=1.0) for k in range(6)])
        ends = sum(factors[k] * inner[:, k] * spans ** (k - order) for k in range(order, 6))
        starts = law.coefficients[1:, order] * factors[order]
        scale = (path.length, 100, 2000)[order]
        assert np.max(np.abs(ends - starts)) < 1e-9 * scale


def test_short_stretches_have_one_window() -> None:
    path = motions.butterfly()
    assert not len(joints(path, 0.0, path.length, setting_of(path))[0])
