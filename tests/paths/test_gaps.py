"""Gaps inside the tolerance of a path are closed: the setpoints have no jump."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import JOIN_TOLERANCE, Path

HALF = np.sqrt(0.5)
PERIOD = 1e-3


def parts(gap: float, seed: int = 0) -> list[sf.NurbsCurve]:
    """A line, an arc, a cubic, a line of degree 3 and a spline, each beside the end of the last one by `gap`, mm."""
    rng = np.random.default_rng(seed)
    curves = [
        sf.NurbsCurve.bezier([(0, 0), (20, 0)]),
        sf.NurbsCurve.bezier([(20, 0), (25, 0), (25, 5)], [1, HALF, 1]),
        sf.NurbsCurve.bezier([(25, 5), (25, 10), (22, 15), (18, 17)]),
        sf.NurbsCurve.bezier([(18, 17), (16, 18), (14, 19), (12, 20)]),
        sf.NurbsCurve(3, [0, 0, 0, 0, 0.3, 1, 1, 1, 1], [(12, 20), (10, 21), (4, 22), (1, 16), (0, 10)]),
    ]
    angles = rng.uniform(0, 2 * np.pi, len(curves))
    return [
        curve.transformed(1.0, 0.5 * gap * np.array([np.cos(a), np.sin(a)]))
        for curve, a in zip(curves, angles, strict=True)
    ]


@pytest.mark.parametrize("gap", [1e-4, 1e-6, 1e-9, 1e-12])
def test_joints_are_one_point_and_curves_move_by_less_than_the_gap(gap):
    given = parts(gap)
    path = Path(given, tolerance=gap)
    assert np.array_equal(path.ends[1:, 0], path.ends[:-1, 1])
    assert max(path.gaps) > 0.1 * gap  # what was given is still said
    assert all(a is b for a, b in zip(path.curves, given, strict=True))
    for i, old in enumerate(given):
        u = np.linspace(*old.domain, 101)
        assert np.max(np.linalg.norm(path.evaluate(i, u, 0)[:, 0] - old(u), axis=1)) <= 0.5 * gap * (1 + 1e-6) + 1e-14
    u = np.linspace(0, 1, 9)
    assert path.evaluate(3, u, 2)[:, 2] == pytest.approx(given[3].derivatives(u, 2)[:, 2], abs=1e-12)
    assert bool(path.findings) == (max(path.gaps) > JOIN_TOLERANCE)
    again = pickle.loads(pickle.dumps(path))
    assert np.array_equal(again.ends, path.ends) and again.findings == path.findings and again.gaps == path.gaps
    turned = path.transformed(2.0).reversed()
    assert np.array_equal(turned.ends[1:, 0], turned.ends[:-1, 1]) and turned.ends[-1, 1] == pytest.approx(
        2.0 * path.ends[0, 0], abs=1e-12
    )


def test_what_joins_but_for_rounding_stays_as_it_is():
    given = parts(1e-15)
    path = Path(given)
    assert np.array_equal(path.ends, [curve.ends for curve in given])


@pytest.mark.parametrize("gap", [1e-4, 1e-6])
@pytest.mark.parametrize("strategy", ["seven-phase", "look-ahead", "time-optimal"])
def test_a_plan_over_gaps_keeps_all_limits(gap, strategy):
    path = Path(parts(gap), tolerance=gap)
    limits = sf.Limits(feed=40, acceleration=400, jerk=20000)
    if strategy != "seven-phase":
        limits = sf.Limits(feed=40, axis_velocity=30, axis_acceleration=400, axis_jerk=20000, chord_error=1e-4)
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems


def test_a_curve_hardly_longer_than_the_gap_keeps_its_shape():
    line = sf.NurbsCurve.bezier
    path = Path([line([(0, 0), (1, 0)]), line([(1, 1e-7), (1, 16e-7)]), line([(1, 17e-7), (2, 0)])])
    assert path.ends[1].tolist() == [[1, 1e-7], [1, 16e-7]]
    assert path.ends[0, 1].tolist() == [1, 1e-7] and path.ends[2, 0].tolist() == [1, 16e-7]
    both = Path([line([(0, 0), (5e-7, 0)]), line([(5e-7, 1e-7), (1e-6, 1e-7)])])
    assert both.gaps == (pytest.approx(1e-7),) and both.ends[0, 1].tolist() == [5e-7, 0]


def test_linear_axes_that_stand_still_while_a_rotary_one_turns_go_on_to():
    line = sf.NurbsCurve.bezier
    path = Path([line([(0, 0), (9, 0)]), line([(9 + 5e-7, 0), (9 + 5e-7, 1)]), line([(9, 1), (0, 2)])], ("x", "a"))
    assert path.ends[1, :, 0].tolist() == [9 + 5e-7, 9 + 5e-7]
    assert np.array_equal(path.ends[1:, 0], path.ends[:-1, 1])
    limits = sf.Limits(feed=40, acceleration=400, jerk=20000)
    law = sf.plan(path, limits, strategy="look-ahead", period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok


@pytest.mark.parametrize("size", [1, 2, 5])
def test_parts_of_a_stream_with_gaps_between_them(size):
    given = parts(1e-6)
    limits = sf.Limits(feed=40, axis_velocity=30, axis_acceleration=400, axis_jerk=20000)
    pieces = [Path(given[k : k + size], tolerance=1e-6) for k in range(0, len(given), size)]
    chunks = list(sf.runs.stream_setpoints(pieces, limits, period=PERIOD))
    position = np.concatenate([chunk.position for chunk in chunks])
    for order, most in ((1, 30), (2, 400), (3, 20000)):
        assert np.max(np.abs(np.diff(position, order, axis=0))) / PERIOD**order <= most * (1 + 1e-6)


def test_feeds_and_markers_stay_with_their_curves():
    given = parts(1e-6)
    path = Path(given, feeds=[1, 2, 3, 4, 5], markers=[Marker(2, "M3")], name="part")
    moved = path.beginning_at(np.array([1e-7, 0.0]) + path.ends[0, 0])
    assert moved.ends[0, 0].tolist() == (np.array([1e-7, 0.0]) + path.ends[0, 0]).tolist()
    assert np.array_equal(moved.feeds, path.feeds) and moved.markers == path.markers and moved.name == "part"
    polyline = Path.polyline([(0, 0), (1, 0), (1, 1)]).beginning_at([1e-7, 0])
    assert polyline.ends[:, 0].tolist() == [[1e-7, 0], [1, 0]]
