"""What an override runs, small enough for plain Python: rows held to SciPy's B-splines, a law to differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

import splinefeed as sf
from splinefeed.errors import InputError, LimitsError
from splinefeed.planner.override.override import Override
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.planner.override.setpoint_source import SetpointSource
from splinefeed.planner.override.source import LawSource
from splinefeed.records import Array, Limits, Setpoints

pytestmark = pytest.mark.nojit

PERIOD = 1e-3
TICKS = 160
#: The rows below ask for 135 mm/s^2 and 8300 mm/s^3 in x, less in y: that leaves a reserve.
LIMITS = Limits(feed=60.0, axis_acceleration=200.0, axis_jerk=16000.0)


def rows() -> Setpoints:
    """From rest to rest over an arc: a quintic step in x, a cosine in y, an axis that turns as well."""
    x = np.linspace(0.0, 1.0, TICKS + 1)
    step = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    position = np.column_stack([0.6 * step, 0.1 * (1.0 - np.cos(np.pi * step)), 0.1 * step])
    count = len(x)
    return Setpoints(
        t=PERIOD * np.arange(count), curve=np.zeros(count, dtype=np.int64), u=np.full(count, np.nan),
        s=np.full(count, np.nan), feed=np.zeros(count), position=position, axes=("x", "y", "a"), period=PERIOD,
        method="test",
    )  # fmt: skip


def spline() -> BSpline:
    """The cubic B-spline with the rows as control points by plan time, s, at rest before and after."""
    still = 8
    given = rows().position
    points = np.concatenate([given[:1]] * still + [given] + [given[-1:]] * still)
    # row k is the middle control point of the knots about (k + 1) T
    knots = PERIOD * (np.arange(len(points) + 4) - still - 1.0)
    return BSpline(knots, points, 3)


def differences(position: Array, order: int) -> Array:
    """Of positions at rest before and after, over the period to that power."""
    still = np.concatenate([position[:1]] * 3 + [position] + [position[-1:]] * 3)
    return np.abs(np.diff(still, order, axis=0)) / PERIOD**order


def test_rows_are_the_control_points_of_a_b_spline():
    course = SetpointSource(rows(), 2)
    tau = np.linspace(0.0, course.duration, 997)
    curve = spline()
    assert course.positions(tau) == pytest.approx(curve(tau), abs=1e-14)
    # beside a row by a sixth of the second difference
    at_rows = curve(PERIOD * (1.0 + np.arange(TICKS + 1)))
    assert np.max(np.abs(at_rows - rows().position)) == pytest.approx(course.beside, rel=1e-9)


def test_what_rows_ask_for_in_each_tick_is_the_largest_derivative_of_the_spline():
    course = SetpointSource(rows(), 2)
    cells = course.demands(-3, TICKS + 8)
    curve = spline()
    within = np.linspace(1e-9, 1.0 - 1e-9, 101)
    for k, cell in enumerate(cells):
        tau = PERIOD * (k - 3 + within)
        each = [np.abs(curve.derivative(order)(tau)) for order in (1, 2, 3)]
        for order in range(3):
            wanted = np.max(each[order], axis=0)
            assert np.all(cell[order, :3] >= wanted * (1 - 1e-9))
            assert cell[order, :3] == pytest.approx(wanted, rel=2e-4, abs=1e-7)
        feed = np.linalg.norm(each[0][:, :2], axis=1)
        assert cell[0, 3] == pytest.approx(max(feed[0], feed[-1]), rel=1e-6, abs=1e-9)
        assert cell[1, 3] >= np.max(np.linalg.norm(each[1][:, :2], axis=1)) * (1 - 1e-9)
        assert cell[2, 3] == 0.0


def test_at_100_percent_rows_come_out_as_they_are_and_ask_for_no_more():
    course = SetpointSource(rows(), 2)
    override = Override(course, LIMITS)
    ticks = override.run(np.ones(1000))
    assert override.done
    played = course.positions(np.append(0.0, ticks.tau))
    given = rows().position
    assert len(played) == len(given) + 2  # a period earlier and a period later
    assert np.max(np.abs(played[1:-1] - given)) <= course.beside * (1 + 1e-9)
    assert played[[0, -1]] == pytest.approx(given[[0, -1]], abs=1e-15)
    for order in (1, 2, 3):
        assert np.all(np.max(differences(played, order), axis=0) <= np.max(differences(given, order), axis=0) + 1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_no_script_takes_rows_over_a_limit_of_the_axes(seed: int):
    random = np.random.default_rng(seed)
    course = SetpointSource(rows(), 2)
    override = Override(course, LIMITS, rate=0.5)
    wanted = np.repeat(random.uniform(-1.0 if seed % 2 else 0.0, 2.0, 12), random.integers(10, 60))
    ticks = override.run(np.concatenate([wanted, np.ones(2000)]))
    assert override.done
    played = course.positions(np.append(0.0, ticks.tau))
    assert np.max(differences(played, 2)) <= 200.0 * (1 + 1e-9)
    assert np.max(differences(played, 3)) <= 16000.0 * (1 + 1e-6)  # 1 mm is told to 2e-16: 1e-7 of this jerk
    assert played[-1] == pytest.approx(rows().position[-1], abs=1e-15)


def test_rows_at_their_limits_are_refused_with_the_rate_that_can_be_held():
    tight = Limits(feed=60.0, axis_acceleration=138.0, axis_jerk=16000.0)
    with pytest.raises(LimitsError, match=r"uses 98 % of the acceleration, .* or run it at (8|9)\d % at most"):
        Override(SetpointSource(rows(), 2), tight)
    override = Override(SetpointSource(rows(), 2), tight, highest=0.85)
    ticks = override.run(np.concatenate([np.ones(60), np.zeros(150), np.ones(1000)]))
    assert override.done
    assert np.max(ticks.rate) == 0.85
    assert np.min(ticks.rate) == 0.0
    assert np.max(differences(SetpointSource(rows(), 2).positions(ticks.tau), 2)) <= 138.0 * (1 + 1e-9)


def test_what_rows_cannot_promise_is_refused():
    with pytest.raises(InputError, match="at least two setpoints"):
        SetpointSource(rows().part(0, 1), 2)
    with pytest.raises(LimitsError, match="begin or end in motion"):
        SetpointSource(rows().part(60, 120), 2)
    for name in ("acceleration", "jerk", "centripetal", "chord_error"):
        limits = Limits(**{"feed": 60.0, "axis_acceleration": 200.0, name: 0.5})
        with pytest.raises(LimitsError, match=f"{name} cannot be held for setpoints without their path"):
            Override(SetpointSource(rows(), 2), limits)


#: A bend of a quarter circle between two lines: curvature jumps at 0.5 and at 0.5 + pi/2 mm.
PATH = sf.Path(
    [
        sf.NurbsCurve.bezier([[-0.5, 0], [0, 0]]),
        sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]], [1.0, np.sqrt(0.5), 1.0]),
        sf.NurbsCurve.bezier([[1, 1], [1, 1.5]]),
    ]
)


def law(limits: Limits) -> sf.TimeLaw:
    return sf.plan(PATH, with_reserve(limits), strategy="seven-phase", period=PERIOD)


def place(s: Array) -> Array:
    """Points of PATH by arc length, by hand."""
    angle = np.clip(s - 0.5, 0.0, 0.5 * np.pi)
    ahead = np.clip(s, 0.0, 0.5) - 0.5
    behind = np.clip(s - 0.5 - 0.5 * np.pi, 0.0, None)
    return np.column_stack([ahead + np.sin(angle), 1.0 - np.cos(angle) + behind])


def test_what_a_law_asks_for_is_the_largest_derivative_of_the_axes_by_plan_time():
    """By central differences inside ticks; where the curvature jumps, q'' jumps by v^2, and jerk by that over T."""
    limits = Limits(feed=20.0, acceleration=900.0, jerk=4e4)
    course = LawSource(PATH, law(limits))
    count = round(course.duration / PERIOD)
    cells = course.demands(0, count)
    jumped = []
    for k in range(count):
        tau = PERIOD * (k + np.linspace(0.05, 0.95, 31))
        h = 0.02 * PERIOD
        at = [place(np.asarray(course.law(tau + j * h))) for j in (-1, 0, 1)]
        velocity, push = np.abs(at[2] - at[0]) / (2 * h), np.abs(at[2] - 2 * at[1] + at[0]) / h**2
        s = np.asarray(course.law(PERIOD * np.array([k, k + 1])))
        assert np.all(cells[k, 0, :2] >= np.max(velocity, axis=0) * (1 - 1e-6) - 1e-6)
        if any(s[0] - 0.05 <= jump <= s[1] + 0.05 for jump in (0.5, 0.5 + 0.5 * np.pi)):
            jumped.append(k)
            continue
        assert np.all(cells[k, 1, :2] >= np.max(push, axis=0) * (1 - 1e-3) - 1e-2)
        assert cells[k, 1, :2] == pytest.approx(np.max(push, axis=0), rel=0.15, abs=12.0)
        feed, push_along = float(np.max(course.law.feed(tau))), float(np.max(np.abs(course.law.acceleration(tau))))
        assert cells[k, 0, 2] == pytest.approx(feed, rel=0.2, abs=0.1)
        assert cells[k, 1, 2] == pytest.approx(push_along, rel=0.3, abs=5.0)
    # at one of the ticks about the jumps: v^2 / r over the period, along the axis that begins to turn, or ceases to
    for axis, s in ((1, 0.5), (0, 0.5 + 0.5 * np.pi)):
        when = np.searchsorted(np.asarray(course.law(PERIOD * np.arange(count))), s) - 1
        feed = float(course.law.feed(PERIOD * (when + 0.5)))
        assert cells[when, 2, axis] == pytest.approx(feed**2 / PERIOD, rel=0.2)
        assert cells[when - 3, 2, axis] < 0.5 * feed**2 / PERIOD
    assert 4 <= len(jumped) <= 40
    # beyond both ends nothing moves
    assert not np.any(course.demands(-5, 4)) and not np.any(course.demands(count + 2, 3))


@pytest.mark.parametrize("seed", range(3))
def test_no_script_takes_a_law_over_a_limit_along_the_path(seed: int):
    random = np.random.default_rng(seed)
    limits = Limits(feed=20.0, acceleration=900.0, jerk=4e4)
    course = LawSource(PATH, law(limits))
    override = Override(course, limits)
    wanted = np.repeat(random.uniform(0.0, 1.0, 8), random.integers(5, 60))
    tau = override.run(np.concatenate([wanted, np.ones(2000)])).tau
    assert override.done
    s = np.asarray(course.law(np.append(0.0, tau)))[:, None]
    assert np.max(differences(s, 1)) <= 20.0 * (1 + 1e-9)
    assert np.max(differences(s, 2)) <= 900.0 * (1 + 1e-9)
    assert np.max(differences(s, 3)) <= 4e4 * (1 + 1e-5)
    assert s[-1, 0] == pytest.approx(PATH.length, rel=1e-14)


def test_a_hold_and_a_return_to_the_start():
    limits = Limits(feed=20.0, acceleration=900.0, jerk=4e4)
    override = Override(LawSource(PATH, law(limits)), limits)
    override.prepare()
    override.run(np.concatenate([np.ones(50), np.zeros(200)]))
    assert override.held and not override.done
    stood = override.tau
    back = override.run(np.full(400, -1.0))
    assert stood > 0.0 and override.tau == 0.0 and override.rate == 0.0
    assert np.all(np.diff(back.tau) <= 0.0)
    override.rest_at(0.1)
    assert override.tau == 0.1 and override.held
    assert override.run([1.0, np.nan]).tau[1] > 0.1
    late = Override(LawSource(PATH, law(limits)), limits, tau=0.1)
    assert late.tau == 0.1 and late.rate == 0.0


def test_what_a_law_cannot_promise_is_refused():
    limits = Limits(feed=20.0, acceleration=900.0, jerk=4e4)
    planned = law(limits)
    course = LawSource(PATH, planned)
    with pytest.raises(LimitsError, match="a law that can be overridden ends at rest; leave end_feed at 0"):
        LawSource(
            PATH,
            sf.plan(
                PATH,
                Limits(feed=20.0, acceleration=900.0, jerk=4e4, end_feed=5.0),
                strategy="seven-phase",
                period=PERIOD,
            ),
        )
    with pytest.raises(LimitsError, match="no period: the law was planned without one; give period="):
        LawSource(PATH, sf.plan(PATH, limits, strategy="seven-phase", period=None))
    for highest in (0.0, 11.0):
        with pytest.raises(LimitsError, match="the highest override is"):
            Override(course, limits, highest=highest)
    with pytest.raises(LimitsError, match="axis_velocity_step: cannot be overridden; plan without"):
        Override(course, Limits(feed=20.0, acceleration=900.0, axis_velocity_step=1.0))
    with pytest.raises(LimitsError, match="the law lasts"):
        Override(course, limits, tau=100.0)
    with pytest.raises(LimitsError, match="not planned under the limits of centripetal"):
        course.bend_share(Limits(feed=20.0, acceleration=900.0, centripetal=100.0))


def test_a_bend_is_run_no_faster_than_the_limit_it_was_planned_under_allows():
    """Centripetal acceleration goes with the square of the rate: half the limit used leaves sqrt(2) of it."""
    limits = Limits(feed=20.0, acceleration=900.0, jerk=4e4, centripetal=200.0)
    slow = sf.plan(PATH, Limits(feed=8.0, acceleration=300.0, jerk=1e4), strategy="seven-phase", period=PERIOD)
    planned = replace(slow, settings={"limits": {"centripetal": 100.0}})
    share = LawSource(PATH, planned).bend_share(limits)
    assert share == pytest.approx(np.sqrt(0.5), rel=1e-12)
    override = Override(LawSource(PATH, planned), limits)
    assert np.max(override.run(np.full(1000, 2.0)).rate) <= np.sqrt(2.0) * (1 + 1e-12)
