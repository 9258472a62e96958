"""Gains from margins: the loop that follows best of those that keep a phase and a gain margin.

Shapes of the controller are tried in turn: how far the zeros of its integral and derivative lie from the crossover.
For each the crossover is raised as far as the margins allow, in steps of an eighth of an octave; of the loops found the
one with the smallest following error on a standard move of the full axis is taken, if the axis comes to rest with it.
Nothing is decided by less than a part in a thousand, so the last bits of a computer's arithmetic change no gain.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.machine.parts import Controller, ServoAxis
from splinefeed.simulation.curves import following_error, hunts, rest_swing
from splinefeed.simulation.linear import Bound, controller_response, discrete_plant, margins, quick_slacks

#: What is required of a loop where nobody says more: 6 dB, 45 deg, and half a unit from -1.
REQUIRED = Bound(gain_margin=2.0, phase_margin=45.0, sensitivity=2.0)
#: Kinds of controllers that can be shaped.
SHAPED = ("p", "pi", "pid", "p-pi")
#: Crossovers tried, from half the Nyquist frequency down, in equal ratios.
STEP, TRIED = 2.0**0.125, 120
#: Frequency of the zero of the integral over that of the crossover, that of the crossover over that of the zero of the
#: derivative, and for a cascade the crossover over the position gain.
INTEGRALS, DERIVATIVES, POSITIONS = (0.25, 0.125, 0.0625, 0.03125), (0.0, 0.25, 0.5, 1.0, 2.0), (3.0, 4.0, 6.0, 9.0)
#: Digits of errors that are compared, and of gains.
ERROR_DIGITS, GAIN_DIGITS = 3, 4
#: The quick test of margins asks for this much more.
_RESERVE = 1e-3


@dataclass(frozen=True)
class _Loop:
    """A loop that keeps the bound: the axis, what it does on the move, and whether it comes to rest."""

    axis: ServoAxis
    error: float
    hunts: bool


def shaped(axis: ServoAxis, period: float, kind: str, bound: Bound) -> ServoAxis:
    """Return the axis with gains by their margins, or as it is where nothing that keeps them follows better.

    Parameters
    ----------
    axis : ServoAxis
        With its old controller.
    period : float
        Of the servo, s.
    kind : str
        Of the new controller, one of SHAPED.
    bound : Bound
        Margins that the loop keeps.

    Returns
    -------
    ServoAxis
        With its new controller.

    Raises
    ------
    InputError
        For another kind, and where no gains keep the bound.
    """
    if kind not in SHAPED:
        raise InputError(f"rule 'margins' has no controller {kind!r}; it has {', '.join(SHAPED)}")
    old = margins(axis, period)
    found = [_loop(each, period) for each in _kept(axis, period, kind, bound)]
    if not found:
        raise InputError(
            f"axis {axis.name}: no gains of a {kind} controller keep {bound.words}; ask for less, or take a shorter "
            "period, a drive with less lag or no computing delay"
        )
    if kind == axis.controller.kind and float(np.min(bound.slacks(old))) >= 0.0:
        found.insert(0, _loop(axis, period))
    return min(found, key=lambda each: (each.hunts, each.error)).axis


def rounded(value: float, digits: int) -> float:
    """Return a number with so many significant digits."""
    return float(f"{value:.{digits}g}")


def _loop(axis: ServoAxis, period: float) -> _Loop:
    error = following_error(axis, period)
    return _Loop(axis, rounded(error, ERROR_DIGITS), hunts(axis, rest_swing(axis, period)))


def _kept(axis: ServoAxis, period: float, kind: str, bound: Bound) -> Iterator[ServoAxis]:
    """Of each shape the axis with the highest crossover that keeps the bound."""
    part, slacks = discrete_plant(axis, period), quick_slacks(axis, period, bound)
    crossovers = 0.5 * math.pi / period / STEP ** np.arange(TRIED)
    plant = part.response(crossovers)
    for shape in _shapes(kind):
        for omega, there in zip(crossovers.tolist(), plant, strict=True):
            control = _shaped(axis.controller, kind, shape, omega)
            _, back = controller_response(control, period, np.array([omega]))
            control = _forward(axis.controller, _times(control, 1.0 / float(abs(there * back[0]))))
            other = replace(axis, controller=control)
            if float(np.min(slacks(other))) < _RESERVE:
                continue
            if float(np.min(bound.slacks(margins(other, period)))) >= 0.0:
                yield other
                break


def _shapes(kind: str) -> list[tuple[float, float]]:
    """Ratios of the integral and of the derivative, or of the position gain, of a kind."""
    derivatives = {"pid": DERIVATIVES, "p-pi": POSITIONS}.get(kind, (0.0,))
    return [(integral, other) for other in derivatives for integral in ((0.0,) if kind == "p" else INTEGRALS)]


def _shaped(old: Controller, kind: str, shape: tuple[float, float], omega: float) -> Controller:
    """A controller of that shape, with a gain of 1."""
    integral, other = shape
    gains: dict[str, Any] = dict.fromkeys(("kp", "ki", "kd", "position_gain", "velocity_kp", "velocity_ki"), 0.0)
    if kind == "p-pi":
        gains |= {"velocity_kp": 1.0, "velocity_ki": integral * omega, "position_gain": omega / other}
    else:
        gains |= {"kp": 1.0, "ki": integral * omega, "kd": other / omega}
    return replace(old, kind="p-pi" if kind == "p-pi" else "pid", source=f"rule margins ({kind})", **gains)


def _forward(old: Controller, new: Controller) -> Controller:
    """The new controller with the old share of the reference's speed; in a cascade it goes through the speed loop."""
    forward = old.velocity_feed_forward
    if new.kind == "p-pi":
        forward = rounded(forward / old.velocity_kp * new.velocity_kp, GAIN_DIGITS) if old.kind == "p-pi" else 0.0
    elif old.kind == "p-pi":
        forward = 0.0
    return replace(new, velocity_feed_forward=forward)


def _times(control: Controller, factor: float) -> Controller:
    """The controller with the gain of its loop times a factor, its gains in few digits."""
    names = ("velocity_kp", "velocity_ki") if control.kind == "p-pi" else ("kp", "ki", "kd")
    gains: dict[str, Any] = {name: rounded(factor * getattr(control, name), GAIN_DIGITS) for name in names}
    if control.kind == "p-pi":
        gains["position_gain"] = rounded(control.position_gain, GAIN_DIGITS)
    return replace(control, **gains)
