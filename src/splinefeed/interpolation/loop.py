"""The one loop over ticks that all methods share."""

from __future__ import annotations

import math
import types
from collections.abc import Callable
from functools import cache
from typing import Any

from splinefeed.interpolation.arc_length import AT_END
from splinefeed.interpolation.stepping import (
    ACCELERATION,
    FEED,
    HALF_FEED,
    NEXT_FEED,
    NEXT_S,
    placed,
    rate_in_row,
    runge_kutta_4,
)
from splinefeed.kernels.jit import Leaf, hot_kernel
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE, START, Shape
from splinefeed.kernels.pieces import arc_length, point, speed, walk_to
from splinefeed.records import Array, IntArray

#: Places in the integer state that a loop leaves for the next one: row, first and last row of the curve, curve, law
#: piece, steps taken on this curve, and how many steps had to be replaced because the method gave no finite number.
ROW, FIRST_ROW, LAST_ROW, CURVE, PIECE, STEPS, REPLACED = range(7)
STATE_INTEGERS = 7
#: Places in the float state: the last four u, the last four rates, the method's memory, time, feed and acceleration
#: now, how far steps would have gone beyond the end of the path, mm, and `law` of a step.
RATES, MEMORY, NOW, OVERRUN, LAW = 4, 8, 20, 23, 24
STATE_FLOATS = LAW + 5

#: Steps that Runge-Kutta takes before a multistep method has the history it needs.
STARTING_STEPS = 3


@hot_kernel
def law_at(breaks: Array, coefficients: Array, piece: int, time: float) -> tuple[int, float, float, float]:
    """Evaluate a law at one time: s = sum_k c_k tau^k, tau = time - breaks[piece].

    Parameters
    ----------
    breaks : (m + 1,) array
        s. Beyond the ends the end holds.
    coefficients : (m, 6) array
        c_k, mm/s^k.
    piece : int
        From which the piece is found by walking on.
    time : float
        s.

    Returns
    -------
    piece : int
        That holds `time`.
    s, feed, acceleration : float
        mm, mm/s, mm/s^2.
    """
    last = coefficients.shape[0] - 1
    while piece < last and time >= breaks[piece + 1]:
        piece += 1
    while piece > 0 and time < breaks[piece]:
        piece -= 1
    tau = min(max(time, breaks[0]), breaks[last + 1]) - breaks[piece]
    s = coefficients[piece, 5]
    feed = 0.0
    acceleration = 0.0
    for k in range(4, -1, -1):
        acceleration = acceleration * tau + feed
        feed = feed * tau + s
        s = s * tau + coefficients[piece, k]
    return piece, s, feed, 2.0 * acceleration


def step(*_: Any) -> float:
    """Stand in for the method that a loop calls; `loop_for` puts one in its place."""
    raise NotImplementedError


#: The shape of the path, put in its place by `loop_for`: a compiler that knows degree and axes unrolls what depends
#: on them. That takes no longer to compile, and half to three quarters of the time a tick.
SHAPE: Shape = (0, 0, 0, 0)


def _loop(
    breaks: Array,
    coefficients: Array,
    table: Array,
    curve_rows: IntArray,
    length: float,
    period: float,
    first_tick: int,
    integers: IntArray,
    floats: Array,
    history: int,
    half: bool,
    anchor: bool,
    corrections: int,
    tolerance: float,
    curve: IntArray,
    u_out: Array,
    s_out: Array,
    feed_out: Array,
    position: Array,
) -> None:
    """Fill ticks first_tick ... first_tick + n - 1 of a motion; state in `integers` and `floats` is carried on.

    Parameters
    ----------
    breaks, coefficients : (m + 1,) and (m, 6) array
        The time law, s and mm/s^k.
    table, curve_rows : array and (curves, 2) array
        The path; see `kernels.layout`.
    length : float
        Of the path, mm.
    period : float
        s.
    first_tick : int
        The first one to fill.
    integers, floats : (STATE_INTEGERS,) and (STATE_FLOATS,) array
        State, read and written.
    history : int
        Earlier steps that the method needs.
    half : bool
        Whether it asks for the feed at half a period.
    anchor : bool
        Whether its points lie on the law's arc length, so that its starting steps must too.
    corrections, tolerance : int, float
        The user's settings of a predictor-corrector.
    curve, u_out, s_out, feed_out, position : (n,) and (n, axes) array
        Filled.

    Notes
    -----
    A curve's first step lands where the law's arc length says: a joint is a fresh start for every method.
    """
    cursor = integers[: LAST_ROW + 1]
    path = (table, cursor, SHAPE)
    u = floats[:RATES]
    rate = floats[RATES:MEMORY]
    memory = floats[MEMORY:NOW]
    law = floats[LAW:]
    # in variables of their own, not in the arrays: the compiler then keeps them out of memory from tick to tick
    before, feed_before, acceleration = floats[NOW], floats[NOW + 1], floats[NOW + 2]
    piece, current, steps = integers[PIECE], integers[CURVE], integers[STEPS]
    end = breaks[len(breaks) - 1]
    last_curve = curve_rows.shape[0] - 1
    for i in range(len(u_out)):
        tick = first_tick + i
        time = min(tick * period, end)
        passed = time - before
        law[FEED] = feed_before
        law[ACCELERATION] = acceleration
        starting = steps < history
        uneven = abs(passed - period) > 1e-6 * period  # a short last period: only a one-step method can take it
        if half or starting or uneven:
            piece, _, law[HALF_FEED], _ = law_at(breaks, coefficients, piece, before + 0.5 * passed)
        piece, s, feed, acceleration = law_at(breaks, coefficients, piece, time)
        s = min(max(s, 0.0), length)
        if time >= end * (1.0 - AT_END) and length - s <= AT_END * length:
            s = length  # where a law ends is the end, not a rounding before it: a rotary axis may turn far in that
        feed = max(feed, 0.0)
        law[NEXT_S] = s
        law[NEXT_FEED] = feed
        feed_before = feed
        before = time

        moved_on = tick == 0
        while current < last_curve and s >= table[curve_rows[current + 1, 0], START]:
            current += 1
            moved_on = True
        first_row = curve_rows[current, 0]
        last_row = curve_rows[current, 1]
        if moved_on:
            cursor[0] = first_row
            cursor[1] = first_row
            cursor[2] = last_row
            steps = 0
            for k in range(len(memory)):
                memory[k] = 0.0
            after = placed(table[first_row, LOW], s, path)
        else:
            if starting or uneven:
                after = runge_kutta_4(u, rate, law, passed, path, corrections, tolerance, memory)
                if anchor and math.isfinite(after):
                    after = placed(after, s, path)
            else:
                after = step(u, rate, law, period, path, corrections, tolerance, memory)
            steps += 1
            if not math.isfinite(after):
                after = placed(u[0], s, path)
                integers[REPLACED] += 1
        if anchor and s >= length:
            after = table[last_row, HIGH]  # the end of the path is the end, not a rounding beside it
        elif s <= table[first_row, START] and (anchor or moved_on):
            after = table[first_row, LOW]  # nor is its start: where C' = 0, a rounding of s is far in u
        beyond = after - table[last_row, HIGH]
        if beyond > 0.0 and current == last_curve:
            floats[OVERRUN] += beyond * speed(table, last_row, SHAPE, 1.0)
        after = min(max(after, table[first_row, LOW]), table[last_row, HIGH])

        for k in range(3, 0, -1):
            u[k] = u[k - 1]
            rate[k] = rate[k - 1]
        u[0] = after
        row = walk_to(table, cursor, LOW, after)
        t = (after - table[row, MIDDLE]) * table[row, SCALE]
        rate[0] = rate_in_row(t, feed, table, row, SHAPE)
        point(table, row, SHAPE, t, position[i])
        curve[i] = current
        u_out[i] = after
        s_out[i] = arc_length(table, row, t)
        feed_out[i] = feed
    floats[NOW], floats[NOW + 1], floats[NOW + 2] = before, feed_before, acceleration
    integers[PIECE], integers[CURVE], integers[STEPS] = piece, current, steps


#: Ticks that plain Python does in the time that a loop takes to compile: 10 to 30 us each, and 1.3 to 2.8 s.
WORTH = 100_000


@cache
def loop_for(method_step: Callable[..., float], name: str, shape: Shape) -> Leaf[Callable[..., None]]:
    """Return the loop with a method's step in the place of `step`, for paths of a shape.

    Parameters
    ----------
    method_step : callable
        The step.
    name : str
        Of the method.
    shape : Shape
        Of the path; see `kernels.layout`.

    Returns
    -------
    Leaf
        The loop, plain or compiled; its parameters are those of `_loop`.

    Notes
    -----
    Handing a compiled function to a compiled loop as an argument would work too, but then no loop could be found in the
    disk cache. A function of its own name, whose global `step` is the method, can.
    """
    function = types.FunctionType(_loop.__code__, {**globals(), "step": method_step, "SHAPE": shape}, "_loop")
    function.__qualname__ = "_".join(["_loop", name.replace("-", "_"), *(str(number) for number in shape)])
    function.__module__ = __name__
    function.__doc__ = _loop.__doc__
    return Leaf(function, WORTH, rows=("position",))
