"""Rule `margins`: what is asked is kept, the move is followed better, and last bits of arithmetic change no gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simulation.axes import PERIOD, velocity_axis
from splinefeed.errors import InputError
from splinefeed.machine import Machine
from splinefeed.simulation import linear, shaping
from splinefeed.simulation.curves import following_error, hunts, rest_swing, standard_move
from splinefeed.simulation.linear import Bound, margins
from splinefeed.simulation.tuning import tune


@pytest.mark.parametrize(
    ("name", "axis"), [("xytheta", "x"), ("xytheta", "theta"), ("router", "z"), ("lintable", "y"), ("trunnion", "a")]
)
def test_the_margins_that_are_asked_for_are_kept_and_the_move_is_followed_better(name: str, axis: str) -> None:
    old = Machine.load(name).axes[axis]
    found = tune(old)
    assert found.rule == "margins" and found.controller.kind == old.controller.kind
    assert found.margins.stable and found.margins.phase_margin >= 45.0
    assert found.margins.gain_margin >= 2.0 and found.margins.gain_reduction <= 0.5
    assert found.margins.sensitivity <= 2.0
    assert not hunts(found.axis, rest_swing(found.axis, PERIOD))
    assert following_error(found.axis, PERIOD) <= following_error(old, PERIOD)


@pytest.mark.parametrize(("kind", "asked"), [("p", 45.0), ("pi", 50.0), ("pid", 60.0), ("p-pi", 45.0)])
def test_each_kind_keeps_what_is_asked(kind: str, asked: float) -> None:
    found = tune(velocity_axis(), kind=kind, bound=Bound(gain_margin=3.0, phase_margin=asked))
    assert found.margins.phase_margin >= asked and found.margins.gain_margin >= 3.0
    control = found.controller
    assert control.kind == ("p-pi" if kind == "p-pi" else "pid")
    assert (control.ki > 0.0) == (kind in ("pi", "pid"))
    assert (control.velocity_ki > 0.0) == (kind == "p-pi")


def test_the_last_bits_of_the_model_change_no_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other processors' BLAS rounds otherwise: here the sampled model is off by parts in 1e13, ten times."""
    axis = Machine.load("xytheta").axes["x"]
    first = tune(axis).controller
    rng, exact = np.random.default_rng(1), linear.zero_order_hold

    def noisy(A, B, period):  # type: ignore[no-untyped-def]
        phi, gamma = exact(A, B, period)
        return (each * (1.0 + 1e-13 * rng.standard_normal(each.shape)) for each in (phi, gamma))

    monkeypatch.setattr(linear, "zero_order_hold", noisy)
    for _ in range(10):
        assert tune(axis).controller == first


def test_gains_that_follow_better_within_the_margins_stay() -> None:
    found = tune(velocity_axis()).axis
    assert tune(found).axis == found


def test_the_standard_move_keeps_half_of_the_limits() -> None:
    axis = Machine.load("xytheta").axes["x"]
    move = standard_move(axis, PERIOD)
    velocity, acceleration = np.diff(move) / PERIOD, np.diff(move, 2) / PERIOD**2
    assert np.max(velocity) <= 0.5 * axis.limits.velocity * (1.0 + 1e-9)  # type: ignore[operator]
    assert np.max(np.abs(acceleration)) <= 0.5 * axis.limits.acceleration * (1.0 + 1e-3)  # type: ignore[operator]
    assert move[0] == 0.0 and np.ptp(move[-50:]) == 0.0 and move[-1] > 5.0


def test_what_cannot_be_shaped_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="rule 'margins' has no controller 'pd'; it has p, pi, pid, p-pi"):
        tune(velocity_axis(), kind="pd")
    monkeypatch.setattr(shaping, "TRIED", 4)
    slow = replace(velocity_axis(), controller=replace(velocity_axis().controller, delay=1))
    with pytest.raises(InputError, match="axis x: no gains of a pid controller keep gain margin at least "):
        tune(slow)
    assert margins(velocity_axis(), PERIOD).stable
