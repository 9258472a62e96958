"""One axis of a machine, tick by tick: measure, control, convert, and let the plant move for a period."""

from __future__ import annotations

import math

from splinefeed.kernels.jit import hot_kernel, leaf
from splinefeed.kernels.mechanics import (
    ACCELERATION_FORWARD,
    CASCADE,
    DELAY,
    ERROR_LIMIT,
    FILTER,
    FILTERED,
    INTEGRAL,
    KD,
    KI,
    KP,
    LAST_INPUT,
    LAST_REFERENCE,
    LAST_SPEED,
    LOAD,
    MOTOR,
    ON_LOAD,
    OUTPUT_LIMIT,
    OUTPUT_STEP,
    PENDING,
    PERIOD,
    RESOLUTION,
    STARTED,
    VELOCITY_FORWARD,
    VELOCITY_KI,
    VELOCITY_KP,
    advance,
    clamp,
)
from splinefeed.records import Array

#: Ticks of one axis that plain Python does in the time that its loop takes to compile: 20 to 30 us each, and 3 s.
WORTH = 125_000


@hot_kernel
def control(reference: float, measured: float, parameters: Array, memory: Array) -> float:
    """Output of the controller before limit and converter, V; the integral advances unless that would wind it up.

    PID:  u = K_p e + I + K_d d + forward,  I += K_i T e,  d = a d + (1 - a) (e - e_last) / T
    P-PI: w = K e + k r' - v,  u = K_vp w + I + K_aff r'',  I += K_vi T w,  v = a v + (1 - a) (x - x_last) / T
    forward = K_vff r' + K_aff r'' by backward differences; a = T_f / (T_f + T) (filter by backward Euler).
    Clamping: I stays as it was when the output is beyond its limit and I would carry it further (K. J. Astrom and
    T. Hagglund, Advanced PID Control, ISA 2006, section 3.5).
    """
    period = parameters[PERIOD]
    error = reference - measured
    if memory[STARTED] == 0.0:
        memory[STARTED] = 1.0
        memory[LAST_REFERENCE] = reference
        memory[LAST_INPUT] = measured if parameters[CASCADE] != 0.0 else error
    speed = (reference - memory[LAST_REFERENCE]) / period
    forward = parameters[ACCELERATION_FORWARD] * (speed - memory[LAST_SPEED]) / period
    memory[LAST_REFERENCE] = reference
    memory[LAST_SPEED] = speed
    cascade = parameters[CASCADE] != 0.0
    source = measured if cascade else error
    a = parameters[FILTER]
    memory[FILTERED] = a * memory[FILTERED] + (1.0 - a) * (source - memory[LAST_INPUT]) / period
    memory[LAST_INPUT] = source
    if cascade:
        wanted = parameters[KP] * error + parameters[VELOCITY_FORWARD] * speed - memory[FILTERED]
        proportional = parameters[VELOCITY_KP] * wanted
        step = parameters[VELOCITY_KI] * period * wanted
    else:
        proportional = parameters[KP] * error + parameters[KD] * memory[FILTERED] + parameters[VELOCITY_FORWARD] * speed
        step = parameters[KI] * period * error
    volts = proportional + memory[INTEGRAL] + step + forward
    if abs(volts) > parameters[OUTPUT_LIMIT] and volts * step > 0.0:
        return volts - step
    memory[INTEGRAL] += step
    return volts


@hot_kernel
def quantise(position: float, resolution: float) -> float:
    """The nearest count of an encoder or scale: resolution * floor(x / resolution + 1/2); 0: x itself."""
    if resolution == 0.0:
        return position
    return math.floor(position / resolution + 0.5) * resolution


@hot_kernel
def convert(volts: float, parameters: Array) -> float:
    """What the converter puts out: the nearest code, k * step with -limit <= k * step <= limit - step; V."""
    step = parameters[OUTPUT_STEP]
    return min(quantise(clamp(volts, parameters[OUTPUT_LIMIT]), step), parameters[OUTPUT_LIMIT] - step)


@leaf(worth=WORTH, lists=("table", "parameters"))
def run_axis(
    command: Array,
    table: Array,
    parameters: Array,
    memory: Array,
    scratch: Array,
    position: Array,
    measured: Array,
    output: Array,
    saturated: Array,
) -> int:
    """One axis over n ticks of `command` (n,), mm or rad; returns the ticks done: n, or up to that of a run-away.

    At tick k: measure, compute, put out; then the plant moves one period. Outputs (n,): position of the load, what
    encoder or scale say, V, and 1 where the output is at its limit. memory (MEMORY,) and scratch (SCRATCH,) carry on.
    """
    on_load = parameters[ON_LOAD] != 0.0
    for k in range(len(command)):
        position[k] = memory[LOAD]
        seen = quantise(memory[LOAD] if on_load else memory[MOTOR], parameters[RESOLUTION])
        measured[k] = seen
        wanted = control(command[k], seen, parameters, memory)
        volts = convert(wanted, parameters)
        output[k] = volts
        saturated[k] = 1.0 if abs(wanted) > parameters[OUTPUT_LIMIT] else 0.0
        if not abs(command[k] - seen) <= parameters[ERROR_LIMIT]:
            return k + 1
        if parameters[DELAY] != 0.0:
            late = memory[PENDING]
            memory[PENDING] = volts
            volts = late
        advance(memory, volts, table, parameters, scratch)
    return len(command)
