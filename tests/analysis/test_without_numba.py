"""Judging a motion compiles nothing: check, ripple, chord error and contour error in a new process without Numba."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import sys
import numpy as np
import splinefeed as sf
from splinefeed.analysis.following import ContourMeter
from splinefeed.analysis.measures import chord_errors, feed_ripple

path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, 25], [35, -20], [50, 15], [70, 5]])])
s = np.linspace(0.0, path.length, 101)
curve, u = path.locate(s)
feed, nothing = path.length, np.full(101, np.nan)
columns = {"t": np.arange(101) * 1e-2, "axes": path.axes, "period": 1e-2, "method": "test"}
position = path.evaluate(curve, u)[:, 0]
points = sf.Setpoints(curve=curve, u=u, s=s, feed=np.full(101, feed), position=position, **columns)
foreign = sf.Setpoints(curve=curve - 1, u=nothing, s=nothing, feed=nothing, position=position, **columns)
law = sf.TimeLaw(breaks=[0.0, 1.0], coefficients=[[0, feed, 0, 0, 0, 0]], strategy="test")
limits = sf.Limits(feed=2 * feed, start_feed=feed, end_feed=feed, axis_jerk=1e9, chord_error=1.0, centripetal=1e9)
before = "numba" in sys.modules
assert sf.check(points, path, limits, law=law).ok
assert sf.check(foreign, path, limits).ok
assert feed_ripple(points, path, law).max < 1e-11
assert chord_errors(points, path).max() < 0.1
meter = ContourMeter(path)
assert meter.measure(position, s_hint=s).max < 1e-12 > meter.measure(position).max
print(before, "numba" in sys.modules)
"""


def test_nothing_is_compiled():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=300)
    before, after = done.stdout.split()
    if before == "True":
        pytest.skip("the path itself imports Numba")
    assert after == "False"
