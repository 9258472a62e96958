"""The extremes of a law on a circle and over a corner of speeds: against sine and cosine, sampled densely."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import splinefeed as sf
from splinefeed.checks.bounds import Bounds
from splinefeed.checks.law import LawMotion, breaks_apart
from splinefeed.records import LimitResult

RADIUS = 2.0
#: A quarter circle as a rational quadratic: its parameter does not go evenly, so that every term of the chain counts.
ARC = sf.Path([sf.NurbsCurve.bezier([[0, 0], [RADIUS, 0], [RADIUS, RADIUS]], [1.0, math.sqrt(0.5), 1.0])])


#: Limits that no motion of these tests reaches.
WIDE = sf.Limits(
    feed=10.0, acceleration=1e30, deceleration=1e30, jerk=1e30, deceleration_jerk=1e30, centripetal=1e30,
    axis_velocity=1e30, axis_acceleration=1e30, axis_jerk=1e30,
)  # fmt: skip


def extremes(
    path: sf.Path, breaks: list[float], coefficients: np.ndarray, limits: sf.Limits = WIDE
) -> tuple[dict[str, LimitResult], LawMotion]:
    law = sf.TimeLaw(breaks=breaks, coefficients=coefficients, strategy="test")
    bounds = Bounds(path, limits, 0.0, 0.0)
    worsts, motion = bounds.worsts(), LawMotion(law, bounds)
    motion.hold(worsts)
    return {name: worst.result for name, worst in worsts.items()}, motion


@pytest.mark.parametrize("law", [[0, 2.0, 0.5, -0.3, 0.1, 0.02], [0, 0, 3.0, -0.8, 0.05, -0.01], [0, 1.5, 0, 0, 0, 0]])
def test_extremes_on_a_circle_are_those_of_sine_and_cosine(law: list[float]):
    """x = r sin(s/r), y = r (1 - cos(s/r)): derivatives by t of the composition, by the chain rule of Faa di Bruno."""
    s = Polynomial(law)
    end = float(next(x.real for x in sorted((s - ARC.length).roots(), key=lambda x: x.real) if abs(x.imag) < 1e-9 < x))
    worst, _ = extremes(ARC, [0.0, end], np.array([law], dtype=np.float64))
    t = np.linspace(0.0, end, 200001)
    place, v, a, j = (s.deriv(k)(t) if k else s(t) for k in range(4))
    turn = place / RADIUS
    # r times the k-th derivative of sin and 1 - cos by the angle, and v, a, j of the angle
    first = np.array([np.cos(turn), np.sin(turn)])
    second = np.array([-np.sin(turn), np.cos(turn)]) / RADIUS
    third = -first / RADIUS**2
    axes = [first * v, first * a + second * v**2, first * j + 3.0 * second * v * a + third * v**3]
    for order, motion in enumerate(axes):
        for k in range(2):
            found = worst[f"axis_{('velocity', 'acceleration', 'jerk')[order]}.{'xy'[k]}"]
            at = int(np.argmax(np.abs(motion[k])))
            assert found.worst == pytest.approx(abs(motion[k, at]), rel=2e-4, abs=1e-9)
            # and it is so large where it says
            near = int(np.searchsorted(t, found.at_t).clip(0, len(t) - 1))
            assert abs(motion[k, near]) == pytest.approx(found.worst, rel=1e-3, abs=1e-9)
            assert found.at_s == pytest.approx(float(s(found.at_t)), rel=1e-12, abs=1e-14)
    assert worst["feed"].worst == pytest.approx(np.max(v), rel=1e-6)
    assert worst["acceleration"].worst == pytest.approx(max(np.max(a), 0.0), rel=1e-6, abs=1e-12)
    assert worst["deceleration"].worst == pytest.approx(max(np.max(-a), 0.0), rel=1e-6, abs=1e-12)
    assert worst["centripetal"].worst == pytest.approx(np.max(v) ** 2 / RADIUS, rel=1e-6)
    for up, down, chosen in ((1e20, 1e40, a >= -1e-9), (1e40, 1e20, a <= 1e-9)):
        limits = dataclasses.replace(WIDE, jerk=up, deceleration_jerk=down)
        found = extremes(ARC, [0.0, end], np.array([law], dtype=np.float64), limits)[0]["jerk"]
        wanted = float(np.max(np.abs(j[chosen]), initial=0.0))
        assert (found.worst if found.limit == 1e20 else 0.0) == pytest.approx(wanted, rel=1e-4, abs=1e-9)


def test_jumps_between_pieces_are_dialect_by_how_much_and_where():
    line = sf.Path([sf.NurbsCurve.bezier([[0, 0], [4, 3]])])
    # 1 s at 1 mm/s; then from 2 mm/s at 3 mm/s^2; then from 3 mm, a hundredth of a millimetre on, at a steady feed
    pieces = np.array([[0, 1, 0, 0, 0, 0], [1, 2, 1.5, 0, 0, 0], [3.010, 5.5, 0, 0, 0, 0]], dtype=np.float64)
    second = (-2.0 + math.sqrt(4.0 + 4.0 * 1.5 * 2.0)) / 3.0
    breaks = [0.0, 1.0, 1.0 + second, 1.2 + second]
    worst, motion = extremes(line, breaks, pieces)
    jumps = list(breaks_apart(motion.law))
    feed = 2.0 + 3.0 * second
    assert jumps[0] == pytest.approx((0.01, 1.0 + second, 3.0), rel=1e-9)
    steps = [(1.0, 1.0, 1.0), (5.5 - feed, 1.0 + second, 3.0)]
    assert jumps[1] == pytest.approx(max(steps), rel=1e-9)
    assert jumps[2] == pytest.approx((3.0, 1.0, 1.0), rel=1e-9)
    assert [worst[f"axis_velocity.{axis}"].worst for axis in "xy"] == pytest.approx([0.8 * 5.5, 0.6 * 5.5], rel=1e-12)
    assert [worst[f"axis_acceleration.{axis}"].worst for axis in "xy"] == pytest.approx([2.4, 1.8], rel=1e-12)


def test_jerk_at_a_rest_on_a_knot_is_that_of_slowing_down():
    """v = (1 - t)^2 rests 1/3 mm on, where a row ends a rounding before; the last acceleration, 1e-11, is rounding."""
    knot = 1.0 / 3.0 - 1e-13
    points = [[0.0], [knot / 2.0], [knot], [0.9], [1.0]]
    line = sf.Path([sf.NurbsCurve(2, [0, 0, 0, knot, knot, 1, 1, 1], points)], ("x",))
    law = np.array([[0.0, 1.0, -1.0 + 0.5e-11, 1.0 / 3.0, 0.0, 0.0]])
    worst, _ = extremes(line, [0.0, 1.0], law, dataclasses.replace(WIDE, jerk=1e29))
    assert worst["acceleration"].worst == pytest.approx(1e-11, rel=1e-3)
    assert worst["jerk"].limit == WIDE.deceleration_jerk
    assert worst["jerk"].worst == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize(("roundings", "counted"), [(0.4, False), (4.0, True)])
def test_an_acceleration_within_the_rounding_of_its_instant_is_nobody_s(roundings: float, counted: bool):
    """Slowing down ends in 4e-9 s after 2.5 s: by a rounding of that instant acceleration comes out above 0."""
    line = sf.Path([sf.NurbsCurve.bezier([[0, 0], [4, 3]])])
    jerk, begin = 2.6e9, 2.5
    end = begin + 4.3e-9
    above = roundings * np.finfo(float).eps * end * jerk
    a = above - jerk * (end - begin)
    law = np.array([[1.0, 1.0, 0, 0, 0, 0], [1.0 + begin, 1.0, a / 2.0, jerk / 6.0, 0, 0]])
    worst, _ = extremes(line, [0.0, begin, end], law, dataclasses.replace(WIDE, jerk=1e29))
    assert worst["jerk"].worst == pytest.approx(jerk, rel=1e-12)
    assert worst["jerk"].limit == (1e29 if counted else WIDE.deceleration_jerk)
