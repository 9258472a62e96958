"""What binds is named whatever it is: torques, combinations of axes, and steps of velocity at corners."""

from __future__ import annotations

import dataclasses

import click
import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT
from splinefeed.analysis.measures import maximum_velocity
from splinefeed.checks import check
from splinefeed.cli import options
from splinefeed.curves.differential import by_arc_length, curvatures
from splinefeed.limit_table import (
    AXES,
    CORNERS,
    ENDS,
    KINDS,
    MODELS,
    PATH,
    PLACES,
    SUMS,
    TABLE,
    TICKS,
    TRAVEL,
    order_of,
    unit_of,
    words_of,
)
from splinefeed.machine import limits_toml
from splinefeed.reports.path_figures import COLOURS
from splinefeed.reports.svg import to_text
from splinefeed.runs import run as runs

PERIOD = 1e-3


def test_a_torque_that_binds_is_named():
    arm = sf.robot(ROOT / "tests/data/two-link.urdf", payload=4.5)
    free = dataclasses.replace(
        arm.limits,
        axis_acceleration=dict.fromkeys(arm.joints, 1e3),
        axis_jerk=dict.fromkeys(arm.joints, 1e5),
        axis_velocity=dict.fromkeys(arm.joints, 50.0),
    )
    path = arm.through([[0.0, 0.2], [0.7, -0.3], [1.2, 0.5]])
    run = sf.run(path, free, period=PERIOD)
    assert run.ok
    shoulder = f"torque.{arm.joints[0]}"
    bound = run.numbers()["bound_by"]
    assert bound[shoulder] > 0.2
    assert bound["none"] < 0.5
    q = run.kept.position
    whole = np.concatenate([q[:1], q, q[-1:]])
    v, a = (whole[2:] - whole[:-2]) / (2 * PERIOD), np.diff(whole, 2, axis=0) / PERIOD**2
    share = np.abs(arm.torque(q, v, a)[:, 0]) / arm.most_torque[0]
    found = run.use.share[:, run.use.names.index(shoulder)]
    np.testing.assert_allclose(found[5:-5], share[5:-5], atol=0.03)
    assert "torque" in to_text(sf.plot.binding(run))


def test_a_combination_that_binds_is_named():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0, 0], [60, 40, 0.3], [120, 0, 0]])], ("x", "y", "c"))
    left = sf.records.Combination(weights={"y": 1.0, "c": 200.0}, velocity=80.0, acceleration=400.0, jerk=15000.0)
    limits = sf.Limits(
        feed=200.0, axis_acceleration=[3000.0, 3000.0, 50.0], axis_jerk=[2e5, 2e5, 4e3], combinations={"left": left}
    )
    run = sf.run(path, limits)
    bound = run.numbers()["bound_by"]
    kinds = {name for name in bound if name.startswith("combinations.left.")}
    assert {"combinations.left.velocity", "combinations.left.acceleration"} <= kinds
    assert sum(bound[name] for name in kinds) > 0.3
    along = run.motion.velocity @ [0.0, 1.0, 200.0] / left.velocity
    found = run.use.share[:, run.use.names.index("combinations.left.velocity")]
    np.testing.assert_allclose(found[:-1], np.abs(along)[:-1], atol=0.01)  # the motion is the mean over a period
    assert np.all(run.kept.feed <= run.use.top * (1.0 + 1e-9))
    for name in kinds:
        share = run.use.share[:, run.use.names.index(name)].max()
        assert share == pytest.approx(run.verdict.limits[name].share, rel=1e-3)


def test_the_maximum_velocity_curve_is_lower_under_a_combination():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [50, 80], [100, 0]])])
    limits = sf.Limits(feed=1e3, axis_acceleration=1e4)
    tight = dataclasses.replace(
        limits, combinations={"sum": sf.records.Combination(weights={"x": 1.0, "y": 1.0}, velocity=30.0)}
    )
    curve, u = path.locate(np.array([0.3 * path.length]))
    derivatives = path.evaluate(curve, u, 3)
    d, kappa = by_arc_length(derivatives), curvatures(derivatives)
    top = maximum_velocity(d[:, 1], d[:, 2], {}, kappa, path.axes, tight, np.full(1, 1e3), PERIOD)
    assert top == pytest.approx(30.0 / abs(d[0, 1].sum()), rel=1e-12)


@pytest.mark.parametrize("where", [30.0, 30.0137])
def test_a_velocity_step_that_binds_is_named_at_the_tick_of_its_corner(where):
    """Two lines that meet at 20 degrees: both axes jump by v |r' behind - r' before|, the larger one binds."""
    turn = np.deg2rad(20.0)
    end = [where + 30.0 * np.cos(turn), 30.0 * np.sin(turn)]
    path = sf.Path.polyline(np.array([[0.0, 0.0], [where, 0.0], end]), ("x", "y"))
    limits = sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=2e4, axis_velocity_step=8.0)
    run = sf.run(path, limits)
    assert run.ok
    share = run.use.share[:, run.use.names.index("axis_velocity_step.y")]
    assert np.count_nonzero(share) == 1
    assert share.max() == pytest.approx(1.0, abs=1e-3)  # 8 mm/s of 23 at sin 20 degrees
    tick = int(np.argmax(share))
    assert abs(run.kept.s[tick] - where) <= 0.5 * run.kept.feed[tick] * PERIOD * 1.01
    assert run.numbers()["bound_by"]["axis_velocity_step.y"] == pytest.approx(1.0 / run.ticks)


def test_a_velocity_step_beside_a_rotary_axis_is_that_of_the_setpoints():
    """An axis begins to turn at the same corner: lengths along the path count it, and the tip's do not."""
    path = sf.Path.polyline(np.array([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [60.0, 6.0, 1.0]]), ("x", "y", "a"))
    values = {"x": 500.0, "y": 500.0, "a": 20.0}
    jerks = {axis: 40.0 * value for axis, value in values.items()}
    steps = {"x": 8.0, "y": 8.0, "a": 1.0}
    run = sf.run(path, sf.Limits(feed=60.0, axis_acceleration=values, axis_jerk=jerks, axis_velocity_step=steps))
    assert run.ok
    tick = int(np.argmax(run.use.share[:, run.use.names.index("axis_velocity_step.y")]))
    assert run.kept.s[tick] == pytest.approx(30.0, abs=0.1)
    velocity = np.diff(run.kept.position[tick - 2 : tick + 3], axis=0) / PERIOD
    for k, axis in enumerate(path.axes):
        share = run.use.share[:, run.use.names.index(f"axis_velocity_step.{axis}")]
        assert np.count_nonzero(share) == 1
        seen = abs(velocity[-1, k] - velocity[0, k]) / steps[axis]
        assert share[tick] == pytest.approx(seen, abs=5.0 * PERIOD * values[axis] / steps[axis])


@pytest.mark.parametrize(("chunk", "block"), [(97, 16384), (16384, 61), (100, 33), (7, 5), (2, 1)])
def test_chunks_of_a_motion_have_the_use_of_the_whole(monkeypatch, chunk, block):
    """However a motion is cut, for the meters and for the check, shares and motion of each tick are the same."""
    path = sf.Path.polyline(np.array([[0.0, 0.0], [3.0, 0.0], [6.0, 1.0], [8.0, 0.0]]), ("x", "y"))
    limits = sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=2e4, axis_velocity_step=8.0, chord_error=1e-2)
    whole = sf.run(path, limits)
    monkeypatch.setattr(runs, "CHUNK", chunk)
    monkeypatch.setattr(check, "BLOCK", block)
    parts = sf.run(path, limits)
    assert parts.use.names == whole.use.names
    np.testing.assert_allclose(parts.use.share, whole.use.share, rtol=1e-9, atol=1e-12)
    assert np.array_equal(parts.use.counts, whole.use.counts)
    for name in ("velocity", "acceleration", "jerk"):
        np.testing.assert_allclose(getattr(parts.motion, name), getattr(whole.motion, name), rtol=1e-9, atol=1e-6)


def test_what_differences_take_beyond_derivatives_is_used():
    """A line runs into an arc: there the curvature jumps, and the drive sees about v^2 / (2 r T)."""
    arc = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[20.0, 0], [30, 0], [30, 10]], [1, np.sqrt(0.5), 1])
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0], [20, 0]]), arc])
    law = sf.plan(path, sf.Limits(feed=60.0, acceleration=800.0, jerk=15000.0), period=PERIOD)
    run = sf.run(path, sf.Limits(feed=60.0, acceleration=800.0, jerk=15000.0, axis_jerk=1e6), law=law)
    share = run.use.share[:, run.use.names.index("axis_jerk.y")]
    assert share.max() == pytest.approx(run.verdict.limits["axis_jerk.y"].share, rel=1e-9)
    assert share.max() > 0.3 * 60.0**2 / 10.0 / PERIOD / 1e6
    assert abs(run.kept.s[int(np.argmax(share))] - 20.0) < 2.0 * 60.0 * PERIOD


def test_travel_binds_no_time():
    path = sf.Path.polyline(np.array([[0.0, 0.0], [50.0, 0.0]]), ("x", "y"))
    ends = {"axis_minimum": {"x": 0.0}, "axis_maximum": {"x": 50.0}}
    run = sf.run(path, sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=2e4, **ends))
    assert run.verdict.limits["travel.x"].share == pytest.approx(1.0)
    assert not any("travel" in name for name in run.use.names)


# --- the table ----------------------------------------------------------------------------------------------------


def test_every_limit_is_a_row_of_the_table():
    fields = {each.name for each in dataclasses.fields(sf.Limits)} - {"modelled"}
    modelled = {
        each.kind
        for each in (sf.records.Torque, sf.records.TorqueRate, sf.records.VelocityByPosition, sf.records.Approach)
    }
    assert set(KINDS) == fields | modelled
    assert len(KINDS) == len(TABLE)
    assert {each.bounds for each in TABLE} == {PATH, ENDS, PLACES, TICKS, AXES, CORNERS, TRAVEL, SUMS, MODELS}


def test_every_row_can_be_said_and_drawn():
    taken = {each.name for each in options.limits_alone()(click.Command("every")).params}
    files = {*limits_toml.KINDS, "axis_minimum", "axis_maximum"}
    for each in TABLE:
        travels = each.bounds == TRAVEL
        assert (each.name in files) == each.filed
        assert (each.name in taken or (travels and "travel" in taken)) == each.filed
        slowing = each.name == "deceleration_jerk"  # shown as jerk
        assert (each.name in COLOURS) == (each.bounds not in (ENDS, TRAVEL) and not slowing)


@pytest.mark.parametrize(
    ("name", "order", "unit", "words"),
    [
        ("feed", 1, "mm/s", "feed"),
        ("orientation_error", 0, "deg", "orientation error"),
        ("axis_jerk.theta", 3, "deg/s^3", "axis jerk theta"),
        ("axis_jerk[2]", 3, "(mm or rad)/s^3", "axis jerk[2]"),
        ("combinations.left.acceleration", 2, "mm/s^2", "combination left acceleration"),
        ("combinations.left.weights.x", 0, "mm", "combination left weights x"),
        ("torque.a", 0, "N m", "torque a"),
        ("axis_velocity_step.x", 1, "mm/s", "axis velocity step x"),
        ("travel.a", 0, "deg", "travel a, from its middle"),
    ],
)
def test_names_say_order_unit_and_words(name, order, unit, words):
    assert (order_of(name), unit_of(name), words_of(name)) == (order, unit, words)
