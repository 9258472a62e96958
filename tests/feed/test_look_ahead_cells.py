"""Kernels that lay the cells of the look-ahead: each rule by itself, on samples made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import splinefeed as sf
from splinefeed.kernels import look_ahead_cells as cells
from splinefeed.kernels.look_ahead_path import CENTRIPETAL, OF_AXES, ROUNDING
from splinefeed.kernels.look_ahead_samples import BEGIN, COLUMNS, PUSH, SLOW, TOP, TWIST

pytestmark = pytest.mark.nojit


def no_limit() -> np.ndarray:
    limit = np.full(OF_AXES + 3, math.inf)
    limit[OF_AXES - 1] = 0.0
    return limit


def derivatives(third: Polynomial) -> np.ndarray:
    """d (places, 3, 1) on an interval of 1 whose r''' is that polynomial; the lower ones do not count."""
    d = np.zeros((len(cells.PLACES), 3, 1))
    d[:, 2, 0] = third(cells.PLACES)
    return d


@pytest.mark.parametrize("order", range(3))
def test_a_bend_in_the_middle_asks_for_a_closer_look_once_any_limit_of_an_axis_can_feel_it(order: int):
    """r''' that is off by w over h mm changes r' by w h^2 and r'' by w h: speed w h^2 v, acceleration w h v^2, ..."""
    d = np.zeros((len(cells.PLACES), 3, 1))
    d[2, 2, 0] = 8.0
    h, v = 0.05, 3.0
    felt = 8.0 * h ** (2 - order) * v ** (order + 1)
    for share, seen in ((0.99, False), (1.01, True)):
        limit = no_limit()
        limit[OF_AXES + order] = felt / (cells.UNEXPECTED * share)
        assert cells._unexpected(d, h, v * v, 0.0, limit) is seen
    assert not cells._unexpected(d, h, v * v, 0.0, no_limit())


def test_a_bend_in_the_middle_counts_against_the_curvature_where_only_that_is_limited():
    d = np.zeros((len(cells.PLACES), 3, 1))
    d[2, 2, 0] = 8.0
    limit = no_limit()
    limit[CENTRIPETAL] = 1.0
    assert cells._unexpected(d, 0.05, 9.0, 0.99 * 8.0 * 0.05 / cells.UNEXPECTED, limit)
    assert not cells._unexpected(d, 0.05, 9.0, 1.01 * 8.0 * 0.05 / cells.UNEXPECTED, limit)


def test_what_a_cubic_says_is_expected_and_what_it_cannot_say_is_not():
    limit = no_limit()
    limit[OF_AXES] = 1e-9
    cubic = Polynomial([1.0, -3.0, 5.0, 2.0])
    assert not cells._unexpected(derivatives(cubic), 1.0, 1.0, 0.0, limit)
    bump = Polynomial([0.0, 0.0, 1.0]) * Polynomial([1.0, -2.0, 1.0]) * 16.0  # 1 in the middle, 0 at both ends
    assert cells._unexpected(derivatives(bump), 1.0, 1.0, 0.0, limit)
    assert not cells._unexpected(derivatives(cubic + 1e-3 * bump), 1.0, 1.0, 0.0, limit)


def parts(edges: list[float], twist: float, slow: int | None) -> np.ndarray:
    """Parts of a straight path that begin at the edges but the last; where part `slow` begins the feed is to be low."""
    out = np.zeros((len(edges) - 1, COLUMNS))
    out[:, BEGIN] = edges[:-1]
    out[:, TOP], out[:, PUSH], out[:, TWIST], out[:, SLOW] = 1e4, 1e3, twist, math.inf
    if slow is not None:
        out[slow, SLOW] = 1.0
    return out


@pytest.mark.parametrize("end", range(2))
def test_a_ramp_without_limit_of_jerk_runs_over_no_slow_jump(end: int):
    near = 1e-10  # a jump so far from the end at rest; the ramp would be 1e-6 of the path
    edges = [0.0, near if end == 0 else 1.0 - near, 1.0]
    found = cells._ramp(2, parts(edges, math.inf, 1), 0.0, 1.0, end)
    assert found == pytest.approx(near, rel=1e-5)
    assert cells._ramp(2, parts(edges, math.inf, None), 0.0, 1.0, end) == pytest.approx(1e-6, rel=1e-12)
    # with a limit of jerk its length follows from that, whatever it runs over
    by_jerk = min(0.1 * cells.RAMP_SHARE * 1e3 / math.sqrt(2e5), cells.RAMP_SHARE * 1e9 / (6.0 * 4e10))
    by_jerk = min(by_jerk, 1e-2)
    assert cells._ramp(2, parts(edges, 2e5, 1), 0.0, 1.0, end) == pytest.approx(by_jerk, rel=1e-12)


@pytest.mark.parametrize("end", range(2))
def test_a_ramp_runs_over_slow_jumps_nearer_than_any_cell_is_long(end: int):
    """Next to cusps slivers of rows look like jumps: a ramp that ended there would be shorter than a rounding."""
    near = 0.5 * cells.SHORTEST
    edges = [0.0, near if end == 0 else 1.0 - near, 1.0]
    assert cells._ramp(2, parts(edges, math.inf, 1), 0.0, 1.0, end) == pytest.approx(1e-6, rel=1e-12)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_row_that_ends_next_to_an_edge_of_a_piece_is_cut_there_too(side: float):
    """133 roundings are a place of their own; what is within one rounding of an edge is at it."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0]])])
    edges = np.array([0.0, 0.25, 0.5, 1.0])
    for apart, cut in ((133.0 * np.finfo(float).eps, True), (0.5 * ROUNDING, False)):
        samples = np.zeros((2, COLUMNS))
        samples[1, BEGIN] = 0.5 + side * apart
        fine = np.empty(cells.refined_room(3, 2))
        owner = np.empty(len(fine), dtype=np.int64)
        k = cells.refine(path.table, 3, edges, 2, samples, fine, owner)
        found = fine[: k + 1]
        assert (samples[1, BEGIN] in found) is cut
        assert np.all(np.diff(found) > 0.0)
        assert set(edges) <= set(found)
        middles = 0.5 * (found[1:] + found[:-1])
        assert np.array_equal(owner[:k], np.searchsorted(edges, middles) - 1)
