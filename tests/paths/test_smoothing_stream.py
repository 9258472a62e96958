"""Smoothing as a stream: the same to the bit however it is cut, in memory that stays flat, and fit for look-ahead."""

from __future__ import annotations

import math
import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

import splinefeed as sf
from motions import vertices
from smoothing_paths import random_path
from splinefeed.errors import CurveError, InputError
from splinefeed.paths import smoothing
from splinefeed.paths.smoothing import WINDOW, Smoother, smoothed
from splinefeed.paths.smoothing_runs import ARM_LINES, MOST

AXES = ("x", "y", "a")


def program(seed, count):
    """Lines of all kinds, with feeds, tolerances and markers: smooth, noisy, long, on one spot, there and back."""
    rng = np.random.default_rng(seed)
    points = [np.zeros((1, 3))]
    while sum(map(len, points)) <= count:
        n = int(rng.choice([3, 30, 300, 1200]))
        kind = int(rng.integers(6))
        t = np.arange(1, n + 1)
        if kind == 0:
            add = np.c_[0.2 * t, 4.0 * np.sin(t / 40), 0.003 * np.sin(t / 90)]
        elif kind == 1:
            add = np.cumsum(rng.uniform(-5, 5, (n, 3)) * [1, 1, 0.01], axis=0)
        elif kind == 2:
            add = 2e-4 * rng.standard_normal((n, 3)) * [1, 1, 0]  # one spot
        elif kind == 3:
            add = np.c_[0.1 * t + 1e-3 * rng.standard_normal(n), 1e-3 * rng.standard_normal(n), 0.0 * t]
        elif kind == 4:
            add = np.array([[5e-4, 0, 0], [0, 0, 0], [8, 0, 0], [0, 0, 0], [0, 0, 0.2]])  # there and back, and a turn
        else:
            add = np.repeat([[6.0, 1.0, 0.0]], 1, axis=0)
        points.append(points[-1][-1] + add)
    given = np.vstack(points)[: count + 1]
    given = given[np.append(True, np.any(np.diff(given, axis=0) != 0.0, axis=1))]
    lines = len(given) - 1
    feeds = np.repeat(rng.choice([10.0, 20.0, math.inf], -(-lines // 90), p=[0.45, 0.45, 0.1]), 90)[:lines]
    tolerances = np.repeat(rng.choice([0.0, 0.02, math.inf], -(-lines // 400), p=[0.2, 0.4, 0.4]), 400)[:lines]
    places = np.sort(rng.choice(lines + 1, min(20, lines), replace=False))
    markers = [sf.paths.Marker(int(p), f"S{k}", stop=bool(k % 3)) for k, p in enumerate(places)]
    return sf.Path.polyline(given, AXES, feeds=feeds, tolerances=tolerances, markers=markers)


def cut(path, sizes):
    """The path in pieces of so many curves."""
    low = 0
    points = vertices(path)
    for size in sizes:
        high = min(low + size, len(path.curves))
        if high == low:
            return
        mine = [m for m in path.markers if low <= m.before < high or (m.before == high == len(path.curves))]
        yield sf.Path.polyline(
            points[low : high + 1], path.axes, feeds=path.feeds[low:high], tolerances=path.tolerances[low:high],
            markers=[sf.paths.Marker(m.before - low, m.text, m.dwell, m.stop) for m in mine],
        )  # fmt: skip
        low = high


def as_arrays(paths):
    """All that pieces say, one behind the other."""
    curves = [curve for path in paths for curve in path.curves]
    starts = np.cumsum([0, *(len(path.curves) for path in paths)])
    return {
        "points": np.vstack([curve.control_points for curve in curves]),
        "knots": np.concatenate([curve.knots for curve in curves]),
        "feeds": np.concatenate([path.feeds for path in paths]),
        "tolerances": np.concatenate([path.tolerances for path in paths]),
        "markers": [
            (m.before + int(start), m.text, m.stop)
            for path, start in zip(paths, starts, strict=False)
            for m in path.markers
        ],
    }


def assert_same(one, other):
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("how", [{"corners": "round"}, {"corner_angle": 1.0}])
def test_the_result_is_the_same_to_the_bit_however_the_path_is_cut(seed, how, monkeypatch):
    monkeypatch.setattr(smoothing.Smoother.__init__, "__kwdefaults__",
                        {**smoothing.Smoother.__init__.__kwdefaults__, "window": 700})  # fmt: skip
    path = program(seed, 5000)
    rng = np.random.default_rng(seed)
    tolerance = 0.01 if seed % 2 else "program"
    whole = as_arrays([smoothed(path, tolerance, **how)])
    for sizes in ([len(path.curves)], [1] * 800 + [999] * 9, rng.integers(1, 90, 9000).tolist()):
        assert_same(whole, as_arrays(list(sf.paths.smooth_stream(cut(path, sizes), tolerance, **how))))


@pytest.mark.parametrize("seed", [5, 11, 17, 23, 29, 35])
def test_arcs_and_lines_are_the_same_to_the_bit_too(seed):
    path, tolerance = random_path(seed)
    rng = np.random.default_rng(seed)
    for window in (3, 4096):
        whole = None
        for _ in range(3):
            cuts = np.unique(np.append(rng.integers(0, len(path.curves), 4), [0, len(path.curves)]))
            pieces = [sf.Path(path.curves[a:b]) for a, b in pairwise(cuts.tolist())]
            found = list(sf.paths.smooth_stream(pieces, tolerance, corners="round", window=window))
            curves = [curve for piece in found for curve in piece.curves]
            whole = whole or curves
            assert curves == whole
        if window == 4096:
            assert tuple(smoothed(path, tolerance, corners="round").curves) == tuple(curves)


@pytest.mark.parametrize("seed", range(2))
def test_the_window_changes_no_more_than_roundings(seed):
    path = program(seed, 3000)
    whole = as_arrays([smoothed(path, 0.01, corners="round")])
    for window in (1, 9, 333):
        if window == 1:
            path = sf.Path.polyline(vertices(path)[:300], AXES, feeds=path.feeds[:299], tolerances=[0.01] * 299)
            part = as_arrays([smoothed(path, 0.01, corners="round")])
        else:
            path = program(seed, 3000)
            part = whole
        found = as_arrays(list(sf.paths.smooth_stream([path], 0.01, corners="round", window=window)))
        np.testing.assert_allclose(found["points"], part["points"], atol=1e-6)
        assert found["markers"] == part["markers"]


def test_what_is_held_is_bounded_by_the_window():
    window = 256
    smoother = Smoother(0.01, AXES, window=window)
    most = 0
    for piece in cut(program(3, 20_000), [50] * 1000):
        smoother.push(piece)
        most = max(most, smoother.held)
    assert most <= 2 * window + MOST + 2 * ARM_LINES + 50


def long_program(count):
    """Pieces of a hundred lines on a curve, `count` in all."""
    for low in range(0, count, 100):
        t = 0.2 * np.arange(low, low + 101)
        yield sf.Path.polyline(np.round(np.c_[t, 60 * np.sin(t / 37)], 3))


def peak(count):
    """Most memory, bytes, that a stream of so many lines takes."""
    tracemalloc.start()
    try:
        for _ in sf.paths.smooth_stream(long_program(count), 0.01, window=512):
            pass
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_memory_stays_flat():
    peak(2_000)
    short, long = peak(6_000), peak(18_000)
    assert long < 1.3 * short


def test_a_million_points_on_a_spot_pass_through():
    rng = np.random.default_rng(0)
    smoother = Smoother(0.01, ("x", "y"), window=WINDOW)
    out = smoother.push(sf.Path.polyline([[-5.0, 0.0], [0.0, 0.0]]))
    last = np.zeros((1, 2))
    for _ in range(30):
        points = np.vstack([last, 1e-5 * rng.standard_normal((2000, 2))])
        out += smoother.push(sf.Path.polyline(points))
        assert smoother.held < 2 * WINDOW
        last = points[-1:]
    out += smoother.push(sf.Path.polyline([last[0], [5.0, 0.0]]))
    out += smoother.finish()
    assert sum(len(path.curves) for path in out) <= 3


def test_look_ahead_plans_what_comes_out():
    limits = sf.Limits(feed=50, acceleration=1000, jerk=30000)
    planner = sf.planner.LookAhead(limits, 1e-3, ("x", "y"))
    pieces = list(long_program(3000))
    for path in sf.paths.smooth_stream(pieces, 0.01, window=512):
        planner.push(path)
    planner.finish()
    whole = sf.Path.polyline(np.vstack([vertices(pieces[0]), *(vertices(p)[1:] for p in pieces[1:])]))
    law = sf.plan(smoothed(whole, 0.01), limits, strategy="look-ahead", period=1e-3)
    assert planner.time == pytest.approx(law.duration, rel=0.02)


@pytest.mark.parametrize("axes", [("a",), ("x",), ("x", "a")])
def test_few_axes_and_rotary_ones_alone_pass_through(axes):
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0]])[[0, 1, 3] if len(axes) == 1 else [0, 1, 2, 3]]
    (piece,) = sf.paths.smooth_stream([sf.Path.polyline(points[:, : len(axes)], axes)], 0.01)
    np.testing.assert_array_equal(piece.ends[[0, -1], [0, 1]], points[[0, -1], : len(axes)])


def test_pieces_that_do_not_follow_each_other_are_refused():
    one = sf.Path.polyline([[0, 0], [1, 0]])
    with pytest.raises(CurveError, match="gap of 1 mm between curve 0 and curve 1"):
        list(sf.paths.smooth_stream([one, sf.Path.polyline([[2, 0], [3, 0]])], 0.01))
    with pytest.raises(CurveError, match=r"axes \('x', 'z'\)"):
        list(sf.paths.smooth_stream([one, sf.Path.polyline([[1, 0], [3, 0]], ("x", "z"))], 0.01))
    with pytest.raises(InputError, match="for all or for none"):
        list(sf.paths.smooth_stream([one, sf.Path.polyline([[1, 0], [3, 0]], feeds=[1.0])], 0.01))
    with pytest.raises(InputError, match="a window of 0 curves"):
        Smoother(0.01, ("x",), window=0)
    assert list(sf.paths.smooth_stream([], 0.01)) == []
    assert Smoother(0.01, ("x",)).finish() == []
