"""Thinning keeps what can be seen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.analysis import thinning


@pytest.mark.parametrize("count", [0, 1, 2, 399, 400, 401, 100_003])
def test_extremes_keeps_ends_and_peaks(count):
    values = np.sin(np.arange(count) * 0.01)
    if count > 500:
        values[[77, count // 2]] = 9.0, -9.0
    kept = thinning.extremes(values, columns=100)
    assert len(kept) <= max(402, 202)
    assert np.all(np.diff(kept) > 0)
    if count:
        assert kept[0] == 0
        assert kept[-1] == count - 1
        assert values[kept].min() == values.min()
        assert values[kept].max() == values.max()


def test_extremes_of_what_is_not_finite():
    values = np.full(10_000, np.nan)
    values[5000] = 3.0
    kept = thinning.extremes(values, columns=50)
    assert np.nanmax(values[kept]) == 3.0


@given(st.integers(3, 4000), st.integers(0, 2**32 - 1))
def test_cells_leave_no_point_far_from_one_that_is_kept(count, seed):
    points = np.cumsum(np.random.default_rng(seed).normal(size=(count, 2)), axis=0)
    kept = thinning.cells(points)
    cell = np.max(np.ptp(points, axis=0)) / thinning.CELLS
    assert kept[0] == 0
    assert kept[-1] == count - 1
    last = kept[np.searchsorted(kept, np.arange(count), side="right") - 1]
    assert np.max(np.abs(points - points[last])) <= cell * (1 + 1e-9)


def test_cells_of_a_resting_tool():
    assert thinning.cells(np.ones((5, 2))).tolist() == [0, 1, 2, 3, 4]
    assert thinning.cells(np.ones((1, 3))).tolist() == [0]


def test_runs():
    assert thinning.runs(np.array([1, 1, 2, 2, 2, 1])) == [(0, 1), (2, 4), (5, 5)]
    assert thinning.runs(np.array([7])) == [(0, 0)]
