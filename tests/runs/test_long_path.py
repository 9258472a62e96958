"""A path that comes in parts: its setpoints keep every limit, are those of the whole, and nothing grows."""

from __future__ import annotations

import weakref

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.path import Path
from splinefeed.runs.long_path import parts_of

LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
PERIOD = 1e-3


def arcs(count: int, start: int = 0) -> list[sf.NurbsCurve]:
    """A row of half circles of one radius, tangent to each other; every tenth one begins at a corner."""
    curves = []
    for k in range(start, start + count):
        side = 1.0 if k % 2 and k % 10 else -1.0
        x = 2.0 * k
        corners = np.array([[x, 0], [x, side], [x + 1, side], [x + 2, side], [x + 2, 0]])
        w = 0.5**0.5
        curves.append(sf.NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 2], corners, [1, w, 1, w, 1]))
    return curves


@pytest.mark.parametrize("size", [1, 7, 40])
def test_setpoints_of_parts_keep_the_limits_of_the_whole(size):
    path = Path(arcs(40))
    chunks = list(sf.runs.stream_setpoints((Path(path.curves[i : i + size]) for i in range(0, 40, size)), LIMITS,
                                      period=PERIOD, chunk=500))  # fmt: skip
    assert {len(chunk) for chunk in chunks[:-1]} == {500}
    points = sf.Setpoints.joined(chunks)
    assert np.array_equal(points.t, np.arange(len(points)) * PERIOD)
    verdict = sf.check(chunks, path, LIMITS)
    assert verdict.ok, verdict.problems
    assert verdict.numbers["end_error_mm"] < 1e-12
    law = sf.plan(path, LIMITS, strategy="look-ahead", period=PERIOD)
    assert 0.999 * law.duration <= points.t[-1] <= 1.02 * law.duration
    assert np.max(np.abs(path.evaluate(points.curve, points.u)[:, 0] - points.position)) < 1e-12
    assert np.max(np.abs(path.arc_length(points.curve, points.u) - points.s)) < 1e-9


def test_a_program_with_feeds_stops_and_dwells_is_cut_where_it_may():
    corners = np.array([[0, 0], [5, 0], [5, 5], [0, 5], [0, 0], [5, 0]], dtype=float)
    markers = [sf.paths.Marker(2, "M3", 0.25, True), sf.paths.Marker(5, "M5", 0.5, True)]
    path = Path.polyline(corners, ("x", "y"), feeds=[10, 20, 30, 10, 20], markers=markers)
    parts = list(parts_of(path, 2))
    assert [len(part.curves) for part in parts] == [2, 2, 1]
    assert [[m.before for m in part.markers] for part in parts] == [[], [0], [1]]
    points = sf.Setpoints.joined(list(sf.runs.stream_setpoints(iter(parts), LIMITS, period=PERIOD)))
    law = sf.plan(path, LIMITS, strategy="look-ahead", period=PERIOD)
    assert points.t[-1] == pytest.approx(law.duration, abs=0.1)
    assert sf.check(points, path, LIMITS).ok
    still = np.flatnonzero(np.all(np.diff(points.position, axis=0) == 0.0, axis=1))
    assert np.count_nonzero(np.isclose(points.s[still], 10.0)) >= 249  # where it waits for 0.25 s


def test_parts_that_are_behind_are_forgotten():
    alive = weakref.WeakSet()
    most = 0

    def parts():
        for k in range(0, 400, 20):
            part = Path(arcs(20, k))
            alive.add(part)
            yield part

    ticks = 0
    for chunk in sf.runs.stream_setpoints(parts(), LIMITS, period=PERIOD, chunk=2000):
        ticks += len(chunk)
        most = max(most, len(alive))
    assert ticks > 10_000
    assert most < 14, "of 20 parts"


def test_a_path_of_one_piece_comes_in_parts_by_itself():
    points = np.column_stack([np.arange(5000) * 0.01, np.sin(np.arange(5000) * 0.01)])
    path = Path.polyline(points, ("x", "y"), feeds=np.full(4999, 40.0))
    assert [len(part.curves) for part in parts_of(path)] == [2048, 2048, 903]
    assert sum(part.length for part in parts_of(path)) == pytest.approx(path.length)
    first = next(sf.runs.stream_setpoints(path, LIMITS, period=PERIOD, chunk=100))
    assert len(first) == 100


def test_what_cannot_be_is_said():
    with pytest.raises(sf.SplinefeedError, match="no part came"):
        list(sf.runs.stream_setpoints([], LIMITS, period=PERIOD))
    with pytest.raises(sf.SplinefeedError, match="chunk is 0"):
        sf.runs.stream_setpoints([], LIMITS, period=PERIOD, chunk=0)
    with pytest.raises(sf.SplinefeedError, match="gap of"):
        list(sf.runs.stream_setpoints([Path(arcs(1)), Path(arcs(1, 5))], LIMITS, period=PERIOD))
