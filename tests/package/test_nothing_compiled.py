"""What the default way loads: from a file to setpoints by arc length there is nothing to compile, so no compiler."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import splinefeed as sf

PROGRAM = """
import sys
import splinefeed as sf

path = sf.read(sys.argv[1])
path.corners, path.bounding_box(), path.minimum_radius(), path.stops
path.evaluate(*path.locate([0.0, 0.5 * path.length]), 3)
law = sf.TimeLaw(
    breaks=[0.0, 1.0], coefficients=[[0.0, path.length, 0.0, 0.0, 0.0, 0.0]], strategy="constant feed", period=1e-3
)
points = sf.interpolate(path, law, method="arc-length")
assert len(points) == 1001 and points.curve[-1] == len(path.curves) - 1
assert len(list(sf.interpolate(path, law, method="arc-length", chunk=100))) == 11
stepping = sf.interpolation.Interpolator(path, law, method="arc-length")
assert [stepping.step()[0] for _ in range(1001)] == points.position[:, 0].tolist()
curve = path.curves[0]
curve.split(0.5 * sum(curve.domain)), curve.elevated(), curve.reversed().length
print(*sorted(name for name in ("numba", "llvmlite") if name in sys.modules))
"""


@pytest.mark.parametrize("kind", ["curve", "lines and curves"])
def test_from_a_file_to_setpoints_numba_is_not_imported(kind: str, tmp_path: Path) -> None:
    curves = [sf.shapes.butterfly().curves[0]]
    if kind != "curve":
        end = curves[0].ends[1]
        curves.append(sf.NurbsCurve.bezier([end, end + [5.0, 3.0]]))
        curves.append(sf.NurbsCurve.bezier([end + [5.0, 3.0], end + [9.0, 3.0], end + [9.0, 8.0]], [1.0, 0.7, 1.0]))
    file = tmp_path / "path.json"
    sf.write(sf.Path(curves), file)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(file)], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "\n")


PLANNED = """
import sys
import splinefeed as sf

path, limits = sf.read(sys.argv[1]), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
for strategy in (None, "look-ahead"):
    law = sf.plan(path, limits, strategy=strategy, period=1e-3)
    points = sf.interpolate(path, law)
    assert sf.check(points, path, limits, law=law).ok
    assert sf.analysis.feed_ripple(points, path, law).max < 1e-9
print(*sorted(name for name in ("numba", "llvmlite") if name in sys.modules))
"""


def test_from_a_file_to_checked_setpoints_under_axis_jerk_numba_is_not_imported(tmp_path: Path) -> None:
    file = tmp_path / "path.json"
    sf.write(sf.shapes.butterfly(), file)
    done = subprocess.run(
        [sys.executable, "-c", PLANNED, str(file)], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "\n")
