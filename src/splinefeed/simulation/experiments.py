"""Experiments on an axis: its frequency response by a stepped sine, its ultimate point by a relay."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics, servo
from splinefeed.machine.parts import Axis
from splinefeed.records import Array
from splinefeed.simulation.plant import parameters, plant, step_table

ComplexArray = NDArray[np.complex128]

#: Time for an axis to settle before a sine is measured, s, or lags of its drive; time that it is measured.
SETTLING = 0.5
SETTLING_LAGS = 12.0
WINDOW = 0.5
#: Periods of a relay experiment, and those at its end that are measured.
SWINGS = 60
MEASURED_SWINGS = 20
#: Sines of a relay experiment: so many, over these factors of the frequency known so far, one round after another.
ROUNDS = ((15, 3.0), (5, 1.15), (3, 1.02))
#: Sines go up to this share of half the servo rate.
HIGHEST_SHARE = 0.95
#: Lengths of a relay experiment, ticks, the next where one is too short.
TICKS = (2000, 20_000, 200_000)


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Position that closes the loop over volts: frequency (n,) Hz, value (n,) complex, mm/V or rad/V.

    Source: docs/tune.md. Example: `sf.tune(machine.axes["x"]).response.frequency`
    """

    frequency: Array
    value: ComplexArray
    source: str


@dataclass(frozen=True)
class UltimatePoint:
    """Where proportional control alone oscillates steadily: gain V/mm or V/rad, period s, and how it was found.

    Source: docs/tune.md. Example: `sf.tune(machine.axes["x"]).ultimate.gain`
    """

    gain: float
    period: float
    source: str


def swept_sine(
    axis: Axis,
    period: float,
    frequency: Array,
    amplitude: float,
    *,
    bias: float = 0.0,
    linear: bool = False,
) -> FrequencyResponse:
    """The frequency response of an axis, found by driving it open loop with one sine after another.

    amplitude in V; each frequency, Hz, is moved a little so that whole periods fill whole ticks. After SETTLING the
    measured position is fitted, in least squares, by offset, drift, sine and cosine. bias, V, keeps an axis with a
    velocity drive going: where it never turns round, dry friction is a constant and the response that of the linear
    part; where it does, friction reduces the oscillation and leads its phase.
    """
    wanted = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
    nyquist = 0.5 / period
    if not np.all((wanted > 0.0) & (wanted < nyquist)):
        raise InputError(f"frequencies must lie above 0 and below {nyquist:g} Hz, half the servo rate")
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        raise InputError(f"amplitude is {amplitude} V; it must be greater than 0 and finite")
    if not (math.isfinite(bias) and amplitude + abs(bias) <= axis.controller.output_limit):
        raise InputError(
            f"amplitude and bias are {amplitude:g} and {bias:g} V; together they must lie within the "
            f"{axis.controller.output_limit:g} V of the output"
        )
    table = step_table(plant(axis), period)
    numbers = parameters(axis, period, linear=linear)
    settle = math.ceil(max(SETTLING, SETTLING_LAGS * axis.drive.lag) / period)
    found = np.empty(len(wanted))
    values = np.empty(len(wanted), dtype=np.complex128)
    for i, f in enumerate(wanted):
        swings = max(math.ceil(WINDOW * f), 2)
        ticks = max(round(swings / (f * period)), 2 * swings + 1)
        found[i] = swings / (ticks * period)
        k = np.arange(-settle, ticks)
        angle = 2.0 * np.pi * swings / ticks * k
        volts = bias + amplitude * np.sin(angle)
        _, measured, *_ = driven(servo.OPEN, volts, table, numbers)
        columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones(len(k)), k / ticks])[settle:]
        sine, cosine = np.linalg.lstsq(columns, measured[settle:], rcond=None)[0][:2]
        values[i] = (sine + 1j * cosine) / amplitude
    return FrequencyResponse(found, values, f"stepped sine of {amplitude:g} V")


def relay(axis: Axis, period: float, volts: float) -> UltimatePoint:
    """The ultimate point of an axis: a relay of +-`volts` makes it oscillate, and sines around that measure it.

    After K. J. Astrom and T. Hagglund, Automatica 20 (1984) 645-651, doi:10.1016/0005-1098(84)90014-1. Their
    reading K_u = 4 d / (pi a) of the oscillation alone is 38 to 48 % too high on X of `xytheta`, and not taken:

    - A relay in a servo switches at ticks only, its period takes an even number of them, and the one that comes about
      need not be the nearest: 12 ticks where the ultimate period is 14.1. As the gain falls with the square of
      frequency, that reads (14.1 / 12)^2 = 1.38 of the truth.
    - Dry friction reduces an oscillation that reverses: 8 % at 1 V.
    - Higher harmonics are no part of it: the first was read, and that of the relay is 1.2 % above 4 d / pi.

    So the oscillation says where to search, and sines as large as its first harmonic are driven through the open axis
    until one lags 180 degrees; an axis with a velocity drive is kept going meanwhile, so that friction stays a
    constant. On X, Y and theta of `xytheta` gain and period are then within 0.3 % of the linear model at 1 to 3 V;
    below 0.3 V counts make that 10 %, and beyond the drive's torque the axis really is another one.
    """
    if not (math.isfinite(volts) and volts > 0.0):
        raise InputError(f"the relay is {volts} V; it must be greater than 0 and finite")
    point = UltimatePoint(math.nan, _swing(axis, period, volts), "")
    amplitude, bias = gentle(axis, 4.0 / math.pi * volts)
    for count, factor in ROUNDS:
        frequency = np.geomspace(1.0 / factor, factor, count) / point.period
        frequency = np.unique(np.minimum(frequency, HIGHEST_SHARE * 0.5 / period))
        point = ultimate_of(swept_sine(axis, period, frequency, amplitude, bias=bias), axis.name)
    return replace(point, source=f"relay of {volts:g} V and sines around its oscillation")


def ultimate_of(found: FrequencyResponse, name: str = "x") -> UltimatePoint:
    """The ultimate point of a measured frequency response: where it first lags 180 degrees, between its points.

    Straight in phase and logarithm of gain over the logarithm of frequency. Raises InputError where it never does.
    """
    phase = np.unwrap(np.angle(found.value))
    phase -= 2.0 * np.pi * np.round((phase[0] + 0.5 * np.pi) / (2.0 * np.pi))  # an axis begins near -90 degrees
    beyond = np.flatnonzero((phase[:-1] > -np.pi) & (phase[1:] <= -np.pi))
    if not beyond.size:
        raise InputError(f"axis {name}: the response by {found.source} never lags 180 degrees; it has no ultimate gain")
    i = int(beyond[0])
    share = float((phase[i] + np.pi) / (phase[i] - phase[i + 1]))
    frequency, gain = (
        np.log(each[i]) + share * np.log(each[i + 1] / each[i]) for each in (found.frequency, np.abs(found.value))
    )
    return UltimatePoint(math.exp(-float(gain)), math.exp(-float(frequency)), found.source)


def gentle(axis: Axis, amplitude: float) -> tuple[float, float]:
    """Amplitude, at most that given, and bias of a sine, V, that the drive can follow and that never turns it round.

    The bias is 0 with a torque drive, which a constant force would take away.
    """
    top = axis.controller.output_limit
    if axis.drive.mode != "velocity":
        return min(amplitude, top), 0.0
    top = min(top, axis.motor.rated_speed * axis.travel_per_motor / float(axis.drive.speed_per_volt or 1.0))
    return min(amplitude, 0.5 * top), min(amplitude, 0.5 * top)


def driven(kind: int, command: Array, table: Array, numbers: Array) -> Array:
    """What `servo.run_axis` does from rest: position, measured position, output and whether at its limit, (4, m).

    table and numbers as `step_table` and `parameters` give them; m ticks are done, fewer if the axis runs away.
    """
    memory, scratch, found = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH), np.empty((4, len(command)))
    run = servo.run_axis.for_work(len(command))
    return found[:, : run(kind, command, table, numbers, memory, scratch, *found)]


def _swing(axis: Axis, period: float, volts: float) -> float:
    table, numbers = step_table(plant(axis), period), parameters(axis, period)
    for ticks in TICKS:
        _, measured, output, _ = driven(servo.RELAY, np.full(ticks, volts), table, numbers)
        rises = np.flatnonzero((output[1:] > 0.0) & (output[:-1] < 0.0)) + 1
        if len(rises) > SWINGS and np.ptp(measured) > 0.0:
            return float(rises[-1] - rises[-1 - MEASURED_SWINGS]) * period / MEASURED_SWINGS
    raise InputError(
        f"axis {axis.name}: a relay of {volts:g} V makes no steady oscillation; friction may hold the axis: "
        "raise the voltage"
    )
