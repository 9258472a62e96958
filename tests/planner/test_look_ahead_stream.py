"""Look-ahead on a path that need not end: the same motion however it is cut, flat memory, and always room to stop."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.paths.path import Path
from splinefeed.planner import LookAhead
from splinefeed.planner.stream import MotionBlock

PERIOD = 1e-3
LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


def lines_and_arcs(seed: int = 0, corner: float = 0.02) -> Iterator[sf.NurbsCurve]:
    """Lines and arcs without end, each tangent to the one before, now and then a corner."""
    rng = np.random.default_rng(seed)
    at, heading = np.zeros(2), 0.0
    while True:
        ahead = np.array([np.cos(heading), np.sin(heading)])
        if rng.random() < 0.5:
            points, weights = np.array([at, at + rng.uniform(0.5, 3.0) * ahead]), None
        else:
            turn = rng.uniform(0.2, 2.0) * rng.choice([-1.0, 1.0])
            edge = rng.uniform(0.5, 5.0) * np.tan(0.5 * abs(turn))
            heading += turn
            middle = at + edge * ahead
            points = np.array([at, middle, middle + edge * np.array([np.cos(heading), np.sin(heading)])])
            weights = [1.0, np.cos(0.5 * turn), 1.0]
        at = points[-1]
        yield sf.NurbsCurve.bezier(points, weights)
        if rng.random() < corner:
            heading += rng.uniform(0.3, 1.0)


def cut(curves: list[sf.NurbsCurve], size: int) -> list[Path]:
    return [Path(curves[i : i + size]) for i in range(0, len(curves), size)]


def whole_law(blocks: list[MotionBlock], path: Path) -> sf.TimeLaw:
    """The blocks as one law of the whole path."""
    starts = np.repeat(
        [path.curve_starts[b.curve] + b.offset for b in blocks], [len(b.law.coefficients) for b in blocks]
    )
    coefficients = np.concatenate([block.law.coefficients for block in blocks])
    coefficients[:, 0] += starts
    breaks = np.concatenate([[0.0], *(block.time + block.law.breaks[1:] for block in blocks)])
    return sf.TimeLaw(breaks=breaks, coefficients=coefficients, strategy="look-ahead", period=PERIOD)


@pytest.mark.parametrize("window", [pytest.param(600, marks=pytest.mark.slow), 60])
def test_how_the_path_is_cut_does_not_matter(window):
    curves = list(islice(lines_and_arcs(), 120))
    path = Path(curves)
    laws = [
        whole_law(list(motions.look_ahead(cut(curves, n), LIMITS, PERIOD, window=window)), path) for n in (1, 7, 120)
    ]
    for law in laws:
        verdict = sf.check(sf.interpolate(path, law), path, LIMITS, law=law)
        assert verdict.ok, verdict.problems
        assert law.length == pytest.approx(path.length, rel=1e-13)
        # rounding, which is all that differs, may decide whether a plan is found in the smallest windows
        assert law.duration == pytest.approx(laws[0].duration, rel=5e-3)
        if window == 600:
            t = np.linspace(0, min(law.duration, laws[0].duration), 10_001)
            assert law(t) == pytest.approx(laws[0](t), abs=1e-3 * path.length)
    planned = sf.plan(path, LIMITS, strategy="look-ahead", period=PERIOD)
    if window == 600:
        assert 0.999 * planned.duration <= laws[0].duration <= 1.02 * planned.duration


@pytest.mark.parametrize("count", [1, 3, 11, 26, 53])
def test_it_can_stop_within_the_limits_wherever_the_path_ends(count):
    """What came out before the end was known is what comes out when more follows; the rest comes to rest in time."""
    curves = list(islice(lines_and_arcs(3, corner=0.0), 60))
    stopped, going = (LookAhead(LIMITS, PERIOD, ("x", "y"), 40) for _ in range(2))
    ended, more = [], []
    for curve in curves[:count]:
        ended += stopped.push(Path([curve]))
    for curve in curves:
        more += going.push(Path([curve]))
    for one, other in zip(ended, more, strict=False):
        np.testing.assert_array_equal(one.law.coefficients, other.law.coefficients)
    ended += stopped.finish()
    path = Path(curves[:count])
    law = whole_law(ended, path)
    verdict = sf.check(sf.interpolate(path, law), path, LIMITS, law=law)
    assert verdict.ok, verdict.problems
    assert law.feed(law.duration) == pytest.approx(0.0, abs=1e-6)


def run_long(count: int) -> tuple[list[int], list[float]]:
    """Rows in memory, and work a row of path, at every hundred curves of an endless path that comes one by one."""
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 60)
    rows, work, came, out, before = [], [], 0.0, 0.0, 0.0
    for i, curve in enumerate(islice(lines_and_arcs(5), count)):
        path = Path([curve])
        came += path.length
        out += sum(block.law.length for block in planner.push(path))
        if i % 100 == 99:
            rows.append(planner.rows)
            work.append(planner.work - before)
            before = planner.work
    out += sum(block.law.length for block in planner.finish())
    assert out == pytest.approx(came, rel=1e-12)
    return rows, work


@pytest.mark.slow
def test_memory_and_work_a_curve_do_not_grow_on_an_endless_path():
    rows, work = run_long(800)
    assert max(rows) <= 2 * 60 + 40
    # the mix of lines and arcs varies from hundred to hundred
    assert np.mean(work[4:]) <= 1.2 * np.mean(work[:4])
    assert max(work) <= 2.0 * float(np.mean(work))


def test_stops_dwells_and_feeds_of_a_program():
    curves = list(islice(lines_and_arcs(7, corner=0.0), 12))
    first = Path(curves[:6], feeds=[20.0] * 6, markers=[sf.paths.Marker(before=6, text="G4 P0.25", dwell=0.25)])
    second = Path(curves[6:], feeds=[40.0] * 6)
    blocks = list(motions.look_ahead([first, second], LIMITS, PERIOD))
    path = Path(curves)
    law = whole_law(blocks, path)
    assert np.max(law.feed(np.linspace(0, law.duration, 9001))) <= 40.0 * (1 + 1e-9)
    at_joint = np.abs(law(np.arange(0, law.duration, PERIOD)) - first.length) < 1e-9
    assert 250 <= np.count_nonzero(at_joint) <= 253
    verdict = sf.check(sf.interpolate(path, law), path, LIMITS, law=law)
    assert all(result.holds for result in verdict.limits.values())


def test_bad_input():
    curve = next(lines_and_arcs())
    with pytest.raises(sf.errors.InputError, match="a window of 5 cells; it must have at least 20"):
        LookAhead(LIMITS, PERIOD, ("x", "y"), 5)
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"))
    planner.push(Path([curve]))
    with pytest.raises(sf.errors.CurveError, match=r"gap of .* between curve 0 and curve 1"):
        planner.push(Path([curve]))
    with pytest.raises(sf.errors.CurveError, match="the motion has"):
        planner.push(Path([curve], axes=("x", "z")))
    with pytest.raises(sf.errors.LimitsError, match="needs a limit on acceleration or jerk"):
        LookAhead(sf.Limits(feed=5), PERIOD, ("x", "y"))
