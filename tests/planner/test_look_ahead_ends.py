"""Look-ahead plans with ends in motion, passed corners and two jerks: every limit holds, feeds are met."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.paths.path import Path
from splinefeed.planner import LookAhead

PERIOD = 1e-3
BUTTERFLY = motions.butterfly()
LINE = Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [30, 10]])])
ZIGZAG = Path(
    [sf.NurbsCurve.bezier(np.array(points, dtype=float)) for points in (
        [(0, 0), (20, 0)], [(20, 0), (40, 3)], [(40, 3), (50, 12), (70, 12)], [(70, 12), (90, 8)], [(90, 8), (90, 30)],
    )]
)  # fmt: skip


def limits(start: float = 0.0, end: float = 0.0, **more: object) -> sf.Limits:
    given: dict[str, object] = {"feed": 60, "axis_velocity": 60, "axis_acceleration": 500, "axis_jerk": 20000}
    return sf.Limits(**(given | more), start_feed=start, end_feed=end)


def checked(path: Path, given: sf.Limits) -> sf.TimeLaw:
    law = sf.plan(path, given, strategy="look-ahead", period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, given, law=law)
    assert verdict.ok, verdict.problems
    return law


@pytest.mark.parametrize(
    ("path", "start", "end"), [(BUTTERFLY, 20, 0), (BUTTERFLY, 12, 22), (LINE, 20, 0), (LINE, 5, 40), (LINE, 0, 40)]
)
def test_feeds_at_the_ends_are_met_in_whole_periods(path: Path, start: float, end: float):
    law = checked(path, limits(start, end))
    rest = checked(path, limits())
    assert law.feed(np.array([0.0, law.duration])) == pytest.approx([start, end], rel=1e-9, abs=1e-9)
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)
    assert not law.notes
    assert law.duration < rest.duration
    best = sf.plan(path, limits(start, end), strategy="time-optimal", period=PERIOD)
    assert law.duration <= 1.05 * best.duration


def test_between_two_feeds_without_room_to_slow_down_the_last_period_is_a_short_one():
    short = Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [0.03, 0]])])
    law = sf.plan(short, limits(60, 60), strategy="look-ahead", period=PERIOD)
    assert law.duration == pytest.approx(0.03 / 60, rel=1e-9)
    assert law.notes[0].startswith(
        "the last period is short, 0.0005 s of 0.001 s: the motion begins and ends at a feed"
    )


def test_corners_are_passed_where_each_axis_may_jump():
    stopping = checked(ZIGZAG, limits())
    passing = checked(ZIGZAG, limits(axis_velocity_step=10.0))
    best = sf.plan(ZIGZAG, limits(axis_velocity_step=10.0), strategy="time-optimal", period=PERIOD)
    assert best.duration * (1 - 1e-9) <= passing.duration <= 1.05 * best.duration
    assert passing.duration < 0.9 * stopping.duration
    corner = next(c for c in ZIGZAG.corners if c.stop)
    t = np.linspace(0, passing.duration, 100_001)
    feed = float(passing.feed(t[np.argmin(np.abs(passing(t) - corner.s))]))
    # the x velocity hardly jumps, the y velocity by feed * sin
    assert 1.0 < feed <= 10.0 / np.sin(corner.angle) * (1 + 1e-6)


def test_two_jerks_are_each_used_in_their_own_direction():
    gentle = checked(BUTTERFLY, sf.Limits(feed=60, acceleration=500, jerk=4000))
    both = checked(BUTTERFLY, sf.Limits(feed=60, acceleration=500, jerk=20000, deceleration_jerk=4000))
    quick = checked(BUTTERFLY, sf.Limits(feed=60, acceleration=500, jerk=20000))
    assert quick.duration < both.duration < 1.01 * gentle.duration  # two jerks are planned in coarser cells
    line = sf.Limits(feed=60, acceleration=500, jerk=20000, deceleration_jerk=4000)
    assert sf.plan(LINE, line, strategy="look-ahead").duration == pytest.approx(sf.plan(LINE, line).duration, rel=1e-12)


def test_a_stream_begins_and_ends_in_motion_and_passes_corners_however_it_is_cut():
    given = limits(15, 25, axis_velocity_step=10.0)
    laws = []
    for size in (1, 2, 5):
        planner = LookAhead(given, PERIOD, ("x", "y"))
        blocks = []
        for first in range(0, 5, size):
            blocks += planner.push(Path(ZIGZAG.curves[first : first + size]))
        blocks += planner.finish()
        starts = [ZIGZAG.curve_starts[b.curve] + b.offset for b in blocks]
        coefficients = np.concatenate([b.law.coefficients for b in blocks])
        coefficients[:, 0] += np.repeat(starts, [len(b.law.coefficients) for b in blocks])
        breaks = np.concatenate([[0.0], *(b.time + b.law.breaks[1:] for b in blocks)])
        laws.append(sf.TimeLaw(breaks=breaks, coefficients=coefficients, strategy="look-ahead", period=PERIOD))
    for law in laws:
        assert law.length == pytest.approx(ZIGZAG.length, rel=1e-12)
        assert law.feed(np.array([0.0, law.duration])) == pytest.approx([15, 25], rel=1e-9)
        assert law.duration == pytest.approx(laws[0].duration, rel=1e-6)
        verdict = sf.check(sf.interpolate(ZIGZAG, law), ZIGZAG, given, law=law)
        assert all(result.holds for result in verdict.limits.values()), verdict.problems
    assert laws[0].duration == pytest.approx(checked(ZIGZAG, given).duration, rel=4e-2)


def test_late_instants_do_not_spoil_the_acceleration():
    """After an hour the acceleration jumps by no more than the jerk limit makes of it within a rounding of t."""
    given = sf.Limits(feed=60, acceleration=500, jerk=2e7, axis_acceleration=500)
    wait = sf.paths.Marker(before=1, text="G4 P5000", dwell=5000.0)
    path = Path([BUTTERFLY.curves[0], BUTTERFLY.curves[0].reversed()], markers=[wait])
    law = sf.plan(path, given, strategy="look-ahead", period=PERIOD)
    end = sf.TimeLaw(breaks=law.breaks, coefficients=law.coefficients, strategy="look-ahead")
    spans = np.diff(end.breaks)[:-1]
    c = end.coefficients[:-1]
    after = 2 * c[:, 2] + spans * (6 * c[:, 3] + spans * (12 * c[:, 4] + spans * 20 * c[:, 5]))
    assert np.max(np.abs(2 * end.coefficients[1:, 2] - after)) <= 8 * np.spacing(law.duration) * 2e7
