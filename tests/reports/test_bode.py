"""Figures of tuned axes: margins where they are, the unstable named, everything within the paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from splinefeed.machine import Friction, Machine
from splinefeed.reports.figure import Dots, Line
from splinefeed.reports.servo_figures import bode_figure, step_figure
from splinefeed.simulation.curves import hunts, loop_curves, rest_swing, step_responses
from splinefeed.simulation.linear import controller_response, discrete_plant, margins, scaled
from splinefeed.simulation.tuning import TunedAxis, tune


def loop_response(axis, period, omega):
    """L = H G, the loop opened at the controller's output."""
    return controller_response(axis.controller, period, omega)[1] * discrete_plant(axis, period).response(omega)


@pytest.mark.parametrize("name", ["x", "theta"])
def test_margins_are_drawn_where_they_are(name, tmp_path):
    found = tune(Machine.load("xytheta").axes[name], "tyreus-luyben")
    figure = bode_figure(found, "xytheta")
    gain, phase, closed = figure.panels
    marks = [
        next(mark for mark in panel.marks if isinstance(mark, Line) and mark.name == f"{name} margin")
        for panel, name in ((gain, "gain"), (phase, "phase"))
    ]
    (up, down), (low, high) = (mark.y for mark in marks)
    assert (up, down) == (-found.margins.gain_margin_db, 0.0)
    assert (low, high) == (-180.0, -180.0 + found.margins.phase_margin)
    omega = 2.0 * np.pi * np.array([marks[0].x[0], marks[1].x[0]])
    loop = loop_response(found.axis, 1e-3, omega)
    assert loop[0].real == pytest.approx(-1.0 / found.margins.gain_margin)
    assert abs(loop[1]) == pytest.approx(1.0)
    named = [mark.name for mark in gain.marks if isinstance(mark, Line | Dots) and mark.named]
    assert named == ["old gains", "new gains"]
    assert closed.x.label.startswith("frequency (Hz)")
    for suffix in ("svg", "png"):
        figure.save(tmp_path / f"bode.{suffix}")


def test_a_gain_that_may_not_fall_is_drawn_and_said():
    """The loop of Ziegler and Nichols' gains passes -180 deg twice: at the lower one its gain is above 1."""
    found = tune(Machine.load("xytheta").axes["x"], "ziegler-nichols")
    figure, margins = bode_figure(found, "xytheta"), found.margins
    fall = next(mark for mark in figure.panels[0].marks if isinstance(mark, Line) and mark.name == "the gain may fall")
    assert fall.y.tolist() == [0.0, margins.gain_fall_db]
    (loop,) = loop_response(found.axis, 1e-3, 2.0 * np.pi * fall.x[:1])
    assert loop == pytest.approx(-1.0 / margins.gain_reduction, rel=1e-6)
    assert "the gain may fall by 12.6 dB (at 27.6 Hz)" in figure.title
    assert not [word for panel in figure.panels[:2] for dot in panel.of(Dots) for word in dot.words]


def test_scales_of_a_loop_hold_both_loops():
    axis = Machine.load("lintable").axes["x"]
    gain, phase, _ = bode_figure(tune(axis), "lintable").panels
    for panel in (gain, phase):
        for line in panel.of(Line):
            assert np.max(line.y) <= panel.y.high
    assert all(np.min(line.y) >= phase.y.low for line in phase.of(Line))


def test_steps_of_all_axes_are_seen_as_long_and_long_enough_to_see_them_swing():
    table = Machine.load("xytheta")
    figure = step_figure([tune(table.axes[name], "ziegler-nichols") for name in ("x", "theta")], "xytheta")
    ends = {float(line.x[-1]) for panel in figure.panels for line in panel.of(Line)}
    assert len(ends) == 1
    assert ends.pop() >= 249.0


def test_an_unstable_loop_is_named_and_has_no_closed_response(tmp_path):
    axis = Machine.load("xytheta").axes["x"]
    wild = scaled(axis, 10.0)
    tuned = TunedAxis(rule="none", old=wild, axis=axis, period=1e-3)
    figure = bode_figure(tuned, "wild")
    gain, _, closed = figure.panels
    assert gain.marks[0].name == "old gains: unstable"
    assert [mark.name for mark in closed.marks if isinstance(mark, Line)] == ["new gains"]
    step_figure([tuned, tuned], "wild").save(tmp_path / "step.png")
    assert bode_figure(replace(tuned, old=axis, axis=wild), "wild").title.endswith(margins(wild, 1e-3).verdict)


def test_a_step_is_small_and_rounded_and_ends_at_its_size():
    axis = Machine.load("xytheta").axes["x"]
    old, new = step_responses(axis, scaled(axis, 0.5), 1e-3)
    assert old.size == new.size == 0.02
    for step in (old, new):
        assert not step.stopped
        assert np.all(step.position[step.t <= 0.0] == 0.0)
        assert step.position[-1] == pytest.approx(0.02, abs=2e-3)
    turning = Machine.load("xytheta").axes["theta"]
    assert np.degrees(step_responses(turning, turning, 1e-3)[0].size) in (pytest.approx(0.5), pytest.approx(0.2))


def test_gains_that_hunt_at_rest_are_known():
    """Ziegler and Nichols' integral against the friction of X swings by some counts for ever; the paper's rests."""
    table = Machine.load("xytheta")
    x = table.axes["x"]
    hunting = tune(x, "ziegler-nichols").axis
    assert rest_swing(x, 1e-3) <= 2e-3
    assert not hunts(x, rest_swing(x, 1e-3))
    assert 4e-3 < rest_swing(hunting, 1e-3) < 10e-3
    assert hunts(hunting, rest_swing(hunting, 1e-3))
    smooth = replace(hunting, friction=Friction())
    assert rest_swing(smooth, 1e-3) <= 3e-3
    creeping = table.axes["theta"]  # slowly to its goal, but one way
    assert not hunts(creeping, rest_swing(creeping, 1e-3))
    wild = scaled(replace(x, controller=replace(x.controller, error_limit=0.05)), 30.0)
    assert rest_swing(wild, 1e-3) > 3e-3


def test_the_curves_are_those_of_the_loop():
    axis = Machine.load("lintable").axes["x"]
    curves = loop_curves(axis, 1e-3)
    np.testing.assert_allclose(curves.loop, loop_response(axis, 1e-3, 2.0 * np.pi * curves.frequency), rtol=1e-12)
    assert np.abs(curves.closed[0]) == pytest.approx(1.0, rel=0.03)
    strange = replace(axis, name="x")
    assert loop_curves(strange, 1e-3).frequency[-1] < 500.0
