"""A limit reaches every axis that moves, or is refused, or a note names the axis: whatever form it is given in."""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import splinefeed as sf
from splinefeed.errors import LimitsError
from splinefeed.records import ROTARY_AXES, axes_without_limits

PERIOD = 1e-3
VELOCITY, ACCELERATION, JERK = 1.0, 2.0, 20.0


def joint_path(joints: int, axes: tuple[str, ...] | None = None) -> sf.Path:
    """A smooth walk of joints, of which those behind the third move ten times as far."""
    from scipy.interpolate import make_interp_spline

    far = np.where(np.arange(joints) < 3, 0.2, 2.0)
    places = np.cumsum(np.random.default_rng(1).uniform(-1.0, 1.0, (5, joints)), axis=0) * far
    spline = make_interp_spline(np.linspace(0.0, 1.0, 5), places, k=3)
    return sf.Path([sf.NurbsCurve(3, spline.t, spline.c)], axes)


def largest(setpoints: sf.Setpoints) -> list[np.ndarray]:
    """The largest differences of each axis by time, of order 1 to 3, at rest before and behind the motion."""
    q = setpoints.position
    whole = np.concatenate([np.repeat(q[:1], 3, axis=0), q, np.repeat(q[-1:], 3, axis=0)])
    return [np.abs(np.diff(whole, k, axis=0)).max(axis=0) / setpoints.period**k for k in (1, 2, 3)]


@pytest.mark.parametrize("joints", [4, 6, 9])
def test_a_number_reaches_every_joint_without_a_name(joints: int) -> None:
    path = joint_path(joints)
    assert path.axes == tuple(f"q{k}" for k in range(1, joints + 1))
    limits = sf.Limits(axis_velocity=VELOCITY, axis_acceleration=ACCELERATION, axis_jerk=JERK)
    law = sf.plan(path, limits, period=PERIOD)
    setpoints = sf.interpolate(path, law)
    shares = [most / of for most, of in zip(largest(setpoints), (VELOCITY, ACCELERATION, JERK), strict=True)]
    assert np.max(shares) <= 1.0 + 1e-6
    assert np.max(shares[0][3:]) > 0.99  # the joints that move far run at their velocity
    verdict = sf.check(setpoints, path, limits, law=law)
    assert verdict.ok
    assert {f"axis_jerk.q{k}" for k in range(1, joints + 1)} <= verdict.limits.keys()
    assert not any("without axis_" in note for note in (*law.notes, *verdict.notes))


def series(values: list[float]) -> Any:
    return pytest.importorskip("pandas").Series(values)


@pytest.mark.parametrize("form", [list, tuple, np.array, series])
def test_limits_in_the_order_of_axes_are_those_by_name(form: Any) -> None:
    path = joint_path(6)
    velocity = [1.0, 1.0, 1.0, 0.5, 2.0, 1.5]
    given = sf.Limits(axis_velocity=form(velocity), axis_acceleration=form([2.0] * 6), axis_jerk=form([20.0] * 6))
    named = sf.Limits(
        axis_velocity=dict(zip(path.axes, velocity, strict=True)),
        axis_acceleration=dict.fromkeys(path.axes, 2.0),
        axis_jerk=dict.fromkeys(path.axes, 20.0),
    )
    assert given.on(path.axes) == named
    law = sf.plan(path, given, period=PERIOD)
    assert law.settings["limits"] == named.as_dict()
    setpoints = sf.interpolate(path, law)
    most = largest(setpoints)[0]
    assert np.all(most <= np.array(velocity) * (1.0 + 1e-6))
    assert most[3] > 0.99 * velocity[3]
    assert sf.check(setpoints, path, given, law=law).limits["axis_velocity.q4"].limit == 0.5


def test_a_series_whose_index_has_names_goes_by_these() -> None:
    given = pytest.importorskip("pandas").Series({"y": 800.0, "x": 500.0})
    limits = sf.Limits(feed=60.0, axis_acceleration=given, axis_jerk=20000.0)
    assert limits.of_axes("axis_acceleration", ("x", "y")).tolist() == [500.0, 800.0]


def test_travel_goes_in_the_order_of_axes_too() -> None:
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 5.0]])])
    along = {"feed": 60.0, "acceleration": 500.0, "jerk": 20000.0}
    fits = sf.Limits(**along, axis_minimum=[-1.0, -1.0], axis_maximum=[11.0, 6.0])
    setpoints = sf.interpolate(path, sf.plan(path, fits, period=PERIOD))
    verdict = sf.check(setpoints, path, fits)
    assert verdict.ok
    assert verdict.limits["travel.y"].limit == 3.5
    with pytest.raises(LimitsError, match="the path goes to y = 5 mm"):
        sf.plan(path, sf.Limits(**along, axis_minimum=[-1.0, -1.0], axis_maximum=[11.0, 4.0]), period=PERIOD)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"axis_jerk": [1.0, 2.0]}, "axis_jerk has 2 values for 3 axes; give one each, in the order x, y, a"),
        ({"axis_minimum": [0.0], "axis_maximum": [1.0]}, "travel has 1 values for 3 axes"),
        ({"axis_jerk": {"z": 1.0}}, "axis_jerk.z: the path has no axis 'z'; its axes are x, y, a"),
    ],
)
def test_limits_that_do_not_fit_the_axes_are_refused(given: dict[str, Any], words: str) -> None:
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0, 0.0], [10.0, 5.0, 1.0]])], ("x", "y", "a"))
    limits = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0, **given)
    with pytest.raises(LimitsError) as caught:
        sf.plan(path, limits, period=PERIOD)
    assert str(caught.value).startswith(words)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([500.0, 0.0], "axis_jerk[1] is 0; it must be greater than 0"),
        ([500.0, "fast"], "axis_jerk[1] is 'fast'; expected a number"),
        ([], "axis_jerk is []; give one value an axis, in the path's order or as {'x': 500.0}"),
        ([[1.0], [2.0]], "axis_jerk is [[1.0], [2.0]]; give one value an axis, in the path's order or as {'x': 500.0}"),
    ],
)
def test_what_is_no_list_of_limits_is_refused(given: Any, words: str) -> None:
    with pytest.raises(LimitsError) as caught:
        sf.Limits(feed=60.0, axis_jerk=given)
    assert str(caught.value) == words


def test_a_number_is_refused_where_every_axis_turns() -> None:
    """mm/s is no rad/s: the number would be for no axis at all."""
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])], ("a", "b", "c"))
    words = (
        "axis_velocity is one number, which is for linear axes, and a, b, c turn; give one value each, in this order "
        "or by name"
    )
    with pytest.raises(LimitsError) as caught:
        sf.plan(path, sf.Limits(axis_velocity=1.0, axis_acceleration=2.0, axis_jerk=20.0))
    assert str(caught.value) == words
    law = sf.plan(path, sf.Limits(axis_velocity=[1.0] * 3, axis_acceleration=[2.0] * 3, axis_jerk=[20.0] * 3))
    assert law.duration > 1.0  # 1 rad at 1 rad/s


def test_law_and_verdict_name_the_axes_that_a_number_does_not_reach() -> None:
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0, 0.0], [50.0, 20.0, 1.0]])], ("x", "y", "a"))
    limits = sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0)
    words = "a moves without axis_acceleration, which other axes have; give each axis its own"
    run = sf.run(path, limits)
    assert words in run.law.notes
    assert words in run.verdict.notes
    assert run.numbers()["notes"].count(words) == 1
    every = sf.Limits(feed=60.0, axis_acceleration=[500.0, 500.0, 20.0], axis_jerk=[20000.0, 20000.0, 800.0])
    assert not any("moves without" in note for note in sf.plan(path, every, period=PERIOD).notes)


@st.composite
def cases(draw: st.DrawFn) -> tuple[tuple[str, ...], dict[str, Any], np.ndarray]:
    """Axes, limits in any form, and which of the axes move."""
    linear = draw(st.sampled_from([(), ("x",), ("x", "y"), ("q1", "q2", "q3", "q4")]))
    rotary = draw(st.sampled_from([(), ("a",), ("b", "c")] if linear else [("a",), ("b", "c")]))
    axes = (*linear, *rotary)
    given: dict[str, Any] = {}
    for name in ("axis_velocity", "axis_acceleration", "axis_jerk"):
        some = st.lists(st.sampled_from(axes), unique=True).map(lambda those: dict.fromkeys(those, 2.0))
        value = draw(st.one_of(st.none(), st.just(2.0), st.just([2.0] * len(axes)), some))
        given |= {} if value is None else {name: value}
    return axes, given, np.array(draw(st.lists(st.booleans(), min_size=len(axes), max_size=len(axes))))


@given(cases())
def test_every_axis_that_moves_has_the_limit_or_is_named_or_all_is_refused(
    case: tuple[tuple[str, ...], dict[str, Any], np.ndarray],
) -> None:
    axes, limited, moves = case
    limits = sf.Limits(feed=1.0, **limited)
    low = np.zeros(len(axes))
    try:
        notes = axes_without_limits(limits, axes, low, np.where(moves, 5.0, low))
    except LimitsError:
        assert set(axes) <= set(ROTARY_AXES)  # a number, where every axis turns
        assert 2.0 in limited.values()
        return
    for name, value in limited.items():
        bounded = np.isfinite(limits.of_axes(name, axes))
        assert isinstance(value, dict) or np.all(bounded | np.isin(axes, ROTARY_AXES))
        named = {axis for note in notes if name in note for axis in re.split(r" moves? | turns? ", note)[0].split(", ")}
        free = {axis for axis, own, moving in zip(axes, bounded, moves, strict=True) if moving and not own}
        if value:  # a limit of no axis is none
            assert named == free


def test_limits_in_the_order_of_axes_are_kept_in_a_file(tmp_path: Any) -> None:
    limits = sf.Limits(axis_velocity=[1.0, 2.0], axis_jerk={"x": 3.0}, axis_acceleration=4.0)
    assert sf.Limits.from_dict(limits.as_dict()) == limits
    assert isinstance(limits.on(("x", "y")).axis_velocity, MappingProxyType)
    sf.save(limits, tmp_path / "limits.h5")
    assert sf.load(tmp_path / "limits.h5", sf.Limits) == limits


def test_a_reserve_scales_each_value() -> None:
    slow = sf.planner.with_reserve(sf.Limits(axis_velocity=[1.0, 2.0], axis_jerk=[30.0, 40.0]), top=2.0)
    assert slow.axis_velocity == (0.5, 1.0)


def test_columns_without_names_are_in_units_that_nobody_said() -> None:
    path = sf.Path.through([[0.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.2, 0.1], [0.5, 1.0, 0.4, 0.3]])
    limits = sf.Limits(axis_velocity=1.0, axis_acceleration=4.0, axis_jerk=40.0)
    verdict = sf.check(sf.interpolate(path, sf.plan(path, limits, period=1e-3)), path, limits)
    assert "(mm or rad)/s^2" in str(verdict) and "mm/s" not in str(verdict)
    assert "(mm or rad)" in repr(path)
