"""Limits of axes as arrays in the order of the path's axes: the same as the mapping, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf

PATH = sf.shapes.butterfly()
NAMED = sf.Limits(
    feed=60,
    axis_velocity={"x": 50.0},
    axis_acceleration={"x": 500, "y": 800},
    axis_jerk={"x": 20000, "y": 30000},
    axis_minimum={"x": -200, "y": -150},
    axis_maximum={"x": 200, "y": 150},
)
ORDERED = sf.Limits(
    feed=60,
    axis_velocity=(50.0, math.inf),
    axis_acceleration=[500, 800],
    axis_jerk=np.array([20000, 30000]),
    axis_minimum=[-200, -150],
    axis_maximum=np.array([200, 150], dtype=np.float32),
)


def test_names_are_resolved_against_the_axes():
    assert ORDERED.for_axes(PATH.axes) == NAMED
    assert NAMED.for_axes(PATH.axes) is NAMED
    assert ORDERED.for_axes(("b", "z")).as_dict()["axis_jerk.b"] == 20000.0
    with pytest.raises(sf.errors.LimitsError, match=r"axis_velocity has values in the order of axes; name them first"):
        ORDERED.as_dict()
    with pytest.raises(sf.errors.LimitsError, match="axis_maximum has values in the order of axes"):
        _ = ORDERED.travel


def test_plan_check_and_run_resolve_them():
    law, named = sf.plan(PATH, ORDERED, period=1e-3), sf.plan(PATH, NAMED, period=1e-3)
    np.testing.assert_array_equal(law.coefficients, named.coefficients)
    assert law.settings["limits"] == named.settings["limits"] == NAMED.as_dict()
    points = sf.interpolate(PATH, law)
    verdict = sf.check(points, PATH, ORDERED, law=law)
    assert verdict.ok
    assert verdict.limits == sf.check(points, PATH, NAMED, law=law).limits
    assert sf.run(PATH, ORDERED, law=law).limits == NAMED


def test_streams_and_reserves_resolve_them():
    one, other = (next(sf.live.stream_setpoints(PATH, limits, period=1e-3, chunk=50)) for limits in (ORDERED, NAMED))
    np.testing.assert_array_equal(one.position, other.position)
    assert sf.live.with_reserve(ORDERED).for_axes(PATH.axes) == sf.live.with_reserve(NAMED)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (
            "axis_acceleration",
            [1, 2, 3],
            "axis_acceleration has the shape (3,); give one value for each axis of the path, in the order x, y",
        ),
        (
            "axis_jerk",
            [5.0],
            "axis_jerk has the shape (1,); give one value for each axis of the path, in the order x, y",
        ),
        ("axis_jerk", [[1.0, 2.0]], "axis_jerk has shape (1, 2); expected (axes,), one value per axis"),
        ("axis_jerk", [], "axis_jerk has shape (0,); expected (axes,), one value per axis"),
        ("axis_jerk", ["fast", 1], "axis_jerk is ['fast', 1]; give numbers, one per axis"),
        ("axis_jerk", [[1.0], [1.0, 2.0]], "axis_jerk is [[1.0], [1.0, 2.0]]; give numbers, one per axis"),
        ("axis_jerk", [1.0, math.nan], "axis_jerk[1] is nan; it must be finite"),
        ("axis_jerk", [-1.0, 1.0], "axis_jerk[0] is -1; it must be greater than 0"),
        ("axis_jerk", [-math.inf, 1.0], "axis_jerk[0] is -inf; it must be finite"),
        (
            "axis_minimum",
            [0.0, 0.0],
            "axis_minimum and axis_maximum of 0, 1: one is missing",
        ),
    ],
)
def test_wrong_values_are_named(name, values, message):
    with pytest.raises(sf.errors.LimitsError) as error:
        sf.plan(PATH, sf.Limits(feed=60, **{name: values}))
    assert str(error.value).startswith(message)


def test_travel_that_is_none_is_refused():
    with pytest.raises(
        sf.errors.LimitsError, match=r"axis_minimum\.1 is 3 and axis_maximum\.1 is 2; no travel is left"
    ):
        sf.Limits(feed=60, axis_minimum=[0, 3], axis_maximum=[1, 2])
