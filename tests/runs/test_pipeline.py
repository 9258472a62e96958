"""The chain as one call: its numbers are those of its parts."""

from __future__ import annotations

import json

import numpy as np
import pytest

import motions
import splinefeed as sf


def test_run_is_its_parts():
    path = motions.smooth()
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    result = sf.run(path, limits, method="taylor-2")
    law = sf.plan(path, limits, period=1e-3)
    points = sf.interpolate(path, law, method="taylor-2")
    assert np.array_equal(result.points.position, points.position)
    numbers = result.numbers()
    assert numbers["ripple_max"] == sf.analysis.feed_ripple(points, path, law).max
    assert numbers["duration_s"] == law.duration
    assert numbers["ticks"] == len(points)
    assert set(numbers["limits"]) == {"feed", "acceleration", "deceleration", "jerk"}
    json.dumps(numbers, allow_nan=False)


def test_a_method_that_misses_the_end_is_not_ok():
    path = motions.butterfly()
    result = sf.run(path, sf.Limits(feed=60, acceleration=500, jerk=20000), method="runge-kutta-4")
    assert result.end_error_mm > 1e-4
    assert not result.ok


def test_compare_measures_each_method_alike():
    path = motions.butterfly()
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), period=1e-3)
    traces = {trace.result.method: trace for trace in sf.runs.compare(path, law)}
    assert tuple(traces) == sf.interpolation.methods()
    for name, trace in traces.items():
        result = trace.result
        points = sf.interpolate(path, law, method=name)
        assert result.ripple_max == sf.analysis.feed_ripple(points, path, law).max
        assert result.ripple_max == pytest.approx(np.max(np.abs(trace.relative)))
        assert result.ns_per_tick > 0
    assert traces["milne-simpson"].result.ripple_max > 1
    assert traces["milne-simpson-anchored"].result.ripple_max < 1e-10
    # what runs too fast is held at the end, and the drift still tells
    assert traces["taylor-2"].result.drift_mm > 0.01
    assert abs(traces["arc-length"].result.drift_mm) < 1e-12


def test_compare_refuses_an_unknown_method_before_it_runs_any():
    path = motions.smooth()
    law = motions.smooth_law(path)
    with pytest.raises(sf.errors.MethodError, match="unknown interpolation method"):
        next(sf.runs.compare(path, law, period=1e-3, methods=["arc-length", "nothing"]))
