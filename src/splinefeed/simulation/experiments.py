"""Experiments on an axis: its frequency response by a stepped sine, its ultimate point by a relay."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics, servo
from splinefeed.machine.parts import Axis
from splinefeed.records import Array
from splinefeed.simulation.plant import SUB_STEPS, parameters, plant, step_table

ComplexArray = NDArray[np.complex128]

#: Time that an axis is given to settle before a sine is measured, s, and for which it is measured at least.
SETTLING = 0.5
WINDOW = 0.5
#: Swings that a relay experiment runs through, and those at its end that are measured.
SWINGS = 60
MEASURED_SWINGS = 20
#: Longest relay experiment, ticks.
LONGEST = 200_000


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Position that closes the loop over volts: frequency (n,) Hz, value (n,) complex, mm/V or rad/V."""

    frequency: Array
    value: ComplexArray
    source: str


@dataclass(frozen=True)
class UltimatePoint:
    """Where proportional control alone just keeps swinging: gain V/mm or V/rad, period s, and how it was found."""

    gain: float
    period: float
    source: str


def swept_sine(
    axis: Axis,
    period: float,
    frequency: Array,
    amplitude: float,
    *,
    sub_steps: int = SUB_STEPS,
    linear: bool = False,
) -> FrequencyResponse:
    """The frequency response of an axis, found by driving it open loop with one sine after another.

    amplitude in V; each frequency, Hz, is moved a little so that whole swings fill whole ticks. After SETTLING the
    measured position is fitted, in least squares, by offset, drift, sine and cosine.
    """
    wanted = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
    nyquist = 0.5 / period
    if not np.all((wanted > 0.0) & (wanted < nyquist)):
        raise InputError(f"frequencies must lie above 0 and below {nyquist:g} Hz, half the servo rate")
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        raise InputError(f"amplitude is {amplitude} V; it must be greater than 0 and finite")
    table = step_table(plant(axis), period, sub_steps)
    numbers = parameters(axis, period, sub_steps, linear=linear)
    settle = math.ceil(SETTLING / period)
    found = np.empty(len(wanted))
    values = np.empty(len(wanted), dtype=np.complex128)
    for i, f in enumerate(wanted):
        swings = max(math.ceil(WINDOW * f), 2)
        ticks = max(round(swings / (f * period)), 2 * swings + 1)
        found[i] = swings / (ticks * period)
        k = np.arange(-settle, ticks)
        angle = 2.0 * np.pi * swings / ticks * k
        volts = amplitude * np.sin(angle)
        memory, scratch = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH)
        position, measured = np.empty(len(k)), np.empty(len(k))
        servo.run_open(volts, table, numbers, memory, scratch, position, measured)
        columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones(len(k)), k / ticks])[settle:]
        sine, cosine = np.linalg.lstsq(columns, measured[settle:], rcond=None)[0][:2]
        values[i] = (sine + 1j * cosine) / amplitude
    return FrequencyResponse(found, values, f"stepped sine of {amplitude:g} V")


def relay(
    axis: Axis, period: float, volts: float, hysteresis: float = 0.0, *, sub_steps: int = SUB_STEPS
) -> UltimatePoint:
    """The ultimate point of an axis from the swing that a relay of +-`volts` keeps up around its place.

    K_u = 4 d / (pi sqrt(a^2 - h^2)) with the amplitude a of the first harmonic and hysteresis h, mm or rad. K. J.
    Astrom and T. Hagglund, Automatica 20 (1984) 645-651, doi:10.1016/0005-1098(84)90014-1. The relay switches at servo
    ticks only, so the swing takes an even number of them, and a count of the encoder or scale acts as hysteresis: with
    a swing of some 14 ticks, or of a dozen counts, the period is good to a seventh and the gain to a third. More volts
    help against counts; `tune` starts from the linear model unless it is told otherwise.
    """
    if not (math.isfinite(volts) and volts > 0.0):
        raise InputError(f"the relay is {volts} V; it must be greater than 0 and finite")
    if not (math.isfinite(hysteresis) and hysteresis >= 0.0):
        raise InputError(f"the hysteresis is {hysteresis}; it must not be negative")
    table = step_table(plant(axis), period, sub_steps)
    numbers = parameters(axis, period, sub_steps)
    ticks = 2000
    while ticks <= LONGEST:
        memory, scratch = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH)
        measured, output = np.empty(ticks), np.empty(ticks)
        servo.run_relay(volts, hysteresis, table, numbers, memory, scratch, measured, output)
        rises = np.flatnonzero((output[1:] > 0.0) & (output[:-1] < 0.0)) + 1
        if len(rises) > SWINGS and np.ptp(measured) > 0.0:
            first, last = int(rises[-1 - MEASURED_SWINGS]), int(rises[-1])
            swing = (last - first) * period / MEASURED_SWINGS
            angle = 2.0 * np.pi / swing * np.arange(last - first) * period
            harmonic = 2.0 * abs(np.mean(measured[first:last] * np.exp(-1j * angle)))
            if harmonic > hysteresis:
                gain = 4.0 * volts / (math.pi * math.sqrt(harmonic**2 - hysteresis**2))
                return UltimatePoint(gain, swing, f"relay of {volts:g} V")
        ticks *= 10
    raise InputError(
        f"axis {axis.name}: a relay of {volts:g} V makes no steady swing; friction may hold the axis: take more volts"
    )
