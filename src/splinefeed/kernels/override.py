"""Arithmetic of the override: the rate at which a law is run, tick by tick, so that no limit is exceeded.

A law gives positions q(tau) by plan time tau; run at the rate r = |dtau/dt|, forwards or backwards, it moves axes by

    |v| = |q'| r,   |a| <= |q''| r^2 + |q'| |r'|,   |j| <= |q'''| r^3 + 3 |q''| r |r'| + |q'| |r''|

docs/math/override.md bounds each term.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array, IntArray

#: Places in the state of `run_rate`: plan time s; rate, never negative; its slope 1/s; 1 forwards, -1 backwards; ticks
#: at rest so far (0, 1 or more).
TAU, RATE, SLOPE, DIRECTION, STILL = 0, 1, 2, 3, 4
#: Places of the way out that is certain to keep the limits: for DOWNS ticks the slope falls by DOWN, for FLATS it
#: stays, for UPS it rises by UP; behind it the slope is 0, and the rate one that may stay for ever.
DOWN, DOWNS, FLATS, UP, UPS = 5, 6, 7, 8, 9
STATE = 10
#: Share of the jerk left beside the law's own that the term 3 q'' r r' may take; the rest is for q' r''.
FOR_SLOPE = 0.5
#: Largest change of the rate in one tick, and of that change: what counts where the axes hardly move.
MOST_STEP = 0.25
#: A rate that comes to rest as near as this to its target is at it; the step that it is moved by is far below 1 %.
AT_TARGET = 1e-9
#: How far beside 0 or the highest rate a stop may end by rounding.
ROUNDING = 1e-12
#: What the law needs, (4, n): |q'|, |q''|, jerk at rate 1 and that of jumps alone; the limits of velocity, acceleration
#: and jerk, (3, n); and the period, s.
Needs = tuple[Array, Array, float]
#: Halvings that find the highest rate on a stretch: a coarse grid of rates, so that it does not change all the time.
HALVINGS = 5


@kernel
def own_jerk(rate: float, jerk: float, jumps: float) -> float:
    """Compute the law's own jerk at rates up to a rate: it grows by r^3, what is left of it at jumps of q'' by r^2.

    Parameters
    ----------
    rate : float
        r.
    jerk : float
        At rate 1, jumps included.
    jumps : float
        Over r^2 as r goes to 0, at most 3 times that.

    Returns
    -------
    float
        In the unit of the jerk.
    """
    square = rate * rate
    if rate >= 1.0:
        return square * rate * jerk
    return square * ((1.0 - rate) * jumps + rate * jerk)


@kernel
def _room(rate: float, slope: float, needs: Needs) -> float:
    """Largest |r''| at rates up to `rate` and slopes up to `slope`; below 0 where not even r'' = 0 holds."""
    ahead, limit, period = needs
    square = rate * rate
    most = MOST_STEP / (period * period)
    for k in range(limit.shape[1]):
        if ahead[1, k] * square + ahead[0, k] * slope > limit[1, k]:
            return -1.0
        left = limit[2, k] - own_jerk(rate, ahead[2, k], ahead[3, k]) - 3.0 * ahead[1, k] * rate * slope
        if left < 0.0:
            return -1.0
        if left < most * ahead[0, k]:
            most = left / ahead[0, k]
    return most


@kernel
def _steepest(rate: float, needs: Needs) -> float:
    """Largest |r'| at rates up to `rate` that leaves jerk for r''."""
    ahead, limit, period = needs
    square = rate * rate
    most = MOST_STEP / period
    for k in range(limit.shape[1]):
        left = max(limit[1, k] - ahead[1, k] * square, 0.0)
        if left < most * ahead[0, k]:
            most = left / ahead[0, k]
        left = FOR_SLOPE * max(limit[2, k] - own_jerk(rate, ahead[2, k], ahead[3, k]), 0.0)
        if left < most * 3.0 * ahead[1, k] * rate:
            most = left / (3.0 * ahead[1, k] * rate)
    return most * (1.0 - 1e-9)


@kernel
def _towards(gap: float, slope: float, bend: float, steepest: float, period: float) -> float:
    """Slope at the next tick that brings the rate to its target soonest, `gap` > 0 above it, and lands exactly there.

    From a slope w in n even steps the rate comes to rest after T w n / 2. So w = (2 gap / T - slope) / (n + 1), with
    the fewest n whose steps are within `bend` T.
    """
    step = bend * period
    reach = 2.0 * gap / period - slope
    if reach <= 0.0:
        wanted = 0.0
    else:
        n = math.ceil(0.5 * (math.sqrt(1.0 + 4.0 * reach / step) - 1.0) * (1.0 - 1e-12))
        wanted = reach / (n + 1.0)
    wanted = min(wanted, steepest)
    wanted = min(max(wanted, slope - step), slope + step)
    # the slope changes its sign at a tick, so that the rate is never beyond both ends of a step
    if (slope > 0.0 and wanted < 0.0) or (slope < 0.0 and wanted > 0.0):
        wanted = 0.0
    return wanted


@kernel
def _slow_enough(rate: float, needs: Needs) -> bool:
    """Whether no axis is faster than it may be at that rate."""
    ahead, limit, _ = needs
    kept = True
    for k in range(limit.shape[1]):
        kept = kept and ahead[0, k] * rate <= limit[0, k]
    return kept


@kernel
def _can_return(rate: float, base: float, left: float, needs: Needs) -> bool:
    """Whether a steady rate above `base` can be left for it within `left` s of plan time, and be reached."""
    if not _slow_enough(rate, needs):
        return False
    period = needs[2]
    steepest = _steepest(rate, needs)
    bend = _room(rate, steepest, needs)
    if not (bend > 0.0 and steepest > 0.0):
        return False
    peak = min(math.sqrt((rate - base) * bend), steepest)
    ticks = 3.0 * peak / (bend * period) + max((rate - base) / peak - peak / bend, 0.0) / period + 6.0
    return ticks * period * rate <= left


@kernel
def cap_rates(ahead: Array, base: float, highest: float, left: Array, limit: Array, period: float, out: Array) -> None:
    """Highest steady rates on stretches that begin at each cell, from which there is a way back to `base` in time.

    ahead (levels, cells, 4, n); left (levels,) s of plan time that each level speaks of; out (levels, cells).
    """
    for level in range(ahead.shape[0]):
        for i in range(ahead.shape[1]):
            needs = (ahead[level, i], limit, period)
            low = base
            high = highest
            if _can_return(base + 0.5**HALVINGS * (high - base), base, left[level], needs):  # on most it cannot
                if _can_return(high, base, left[level], needs):
                    low = high
                while high - low > 1.5 * 0.5**HALVINGS * (highest - base):
                    middle = 0.5 * (low + high)
                    if _can_return(middle, base, left[level], needs):
                        low = middle
                    else:
                        high = middle
            out[level, i] = low


@kernel
def _way_out(
    rate: float, slope: float, wanted: float, highest: float, base: float, left: float, needs: Needs, out: Array
) -> bool:
    """Find whether a step, and behind it a way to a steady rate, keep every limit.

    Parameters
    ----------
    rate, slope : float
        Now.
    wanted : float
        Where the step goes.
    highest : float
        Rate that neither exceeds.
    base : float
        The most that the steady rate may be.
    left : float
        s of plan time for which `needs` holds.
    needs : Needs
        What the law asks for.
    out : (STATE,) array
        Out: the way.

    Returns
    -------
    bool
        Whether they do.
    """
    period = needs[2]
    after = rate + 0.5 * period * (slope + wanted)
    most = max(abs(slope), abs(wanted))
    bend = _room(highest, most, needs)
    if bend < 0.0 or abs(wanted - slope) > bend * period * (1.0 + ROUNDING):
        return False
    n = 0.0
    if wanted != 0.0:
        if not bend > 0.0:
            return False
        n = math.ceil(abs(wanted) / (bend * period) * (1.0 - ROUNDING))
    end = after + 0.5 * period * wanted * n
    if max(rate, after, end) > highest + ROUNDING or end < -ROUNDING:
        return False
    if highest > base + ROUNDING and not _slow_enough(highest, needs):
        return False
    if end <= base + ROUNDING:
        if (n + 1.0) * period * highest > left:
            return False
        step = abs(wanted) / n if n > 0.0 else 0.0
        out[DOWN], out[DOWNS] = (step, n) if wanted > 0.0 else (0.0, 0.0)
        out[UP], out[UPS] = (step, n) if wanted < 0.0 else (0.0, 0.0)
        out[FLATS] = 0.0
        return True
    # the slope falls to -peak, may stay there, and rises to 0: the rate falls from `after` to `base` or just below
    most = max(most, _steepest(highest, needs))
    bend = _room(highest, most, needs)
    if not bend > 0.0 or abs(wanted - slope) > bend * period * (1.0 + ROUNDING):
        return False
    step = bend * period
    peak = math.sqrt(max(0.5 * wanted * wanted + (after - base) * bend, 0.0))  # 0: from below base it would not fall
    peak = max(min(peak, most), -wanted)
    if not peak > 0.0:
        return False
    downs = math.ceil((wanted + peak) / step * (1.0 - ROUNDING))
    ups = math.ceil(peak / step * (1.0 - ROUNDING))
    end = after + 0.5 * period * (downs * (wanted - peak) - ups * peak)
    flats = max(math.ceil((end - base) / (period * peak)), 0.0)
    end -= period * peak * flats
    top = after + (0.5 * wanted * wanted / ((wanted + peak) / downs) * period if wanted > 0.0 and downs > 0.0 else 0.0)
    if end < 0.0 or end > base + ROUNDING or top > highest + ROUNDING:
        return False
    if (downs + flats + ups + 1.0) * period * highest > left:
        return False
    out[DOWN], out[DOWNS] = ((wanted + peak) / downs if downs > 0.0 else 0.0), downs
    out[FLATS] = flats
    out[UP], out[UPS] = peak / ups, ups
    return True


@kernel
def _step(
    rate: float, slope: float, target: float, base: float, top: float, left: float, needs: Needs, out: Array
) -> bool:
    """Find the step towards a rate on a stretch: slope into out[SLOPE] and the way out behind it.

    Parameters
    ----------
    rate, slope : float
        Now.
    target : float
        The rate.
    base : float
        The rate that keeps the limits everywhere.
    top : float
        Highest rate there is on the stretch.
    left : float
        s of plan time for which `needs` holds.
    needs : Needs
        What the law asks for.
    out : (STATE,) array
        Out: the step.

    Returns
    -------
    bool
        False if there is none.
    """
    period = needs[2]
    gap = target - rate
    sign = 1.0 if gap >= 0.0 else -1.0
    highest = rate
    if sign > 0.0 or slope > 0.0:
        # how far it would still rise: one more step up, and the stop behind it
        bend = max(_room(rate, abs(slope), needs), 0.0)
        next_slope = max(slope, 0.0) + bend * period
        rise = 0.5 * period * (max(slope, 0.0) + next_slope)
        if bend > 0.0:
            rise += 0.5 * period * next_slope * (1.0 + next_slope / (bend * period))
        highest = min(rate + 1.1 * rise, max(top, rate))
        if slope <= 0.0 or rate <= target:
            highest = max(target, rate) if target > base else min(highest, max(target, rate))
    steepest = _steepest(highest, needs)
    most = min(max(abs(slope), steepest), MOST_STEP / period)
    bend = _room(highest, most, needs)
    if bend <= 0.0:
        bend = _room(highest, abs(slope), needs)
    if bend <= 0.0:
        return False
    ticks = left / (period * max(highest, 1e-9)) - 2.0
    steep = min(steepest, bend * period * max(ticks, 0.0))
    wanted = sign * _towards(sign * gap, sign * slope, bend, steep, period)
    out[SLOPE] = wanted
    return _way_out(rate, slope, wanted, highest, base, left, needs, out)


@kernel
def _along_way_out(slope: float, way: Array) -> float:
    """The slope one tick further on the way out."""
    if way[DOWNS] > 0.0:
        way[DOWNS] -= 1.0
        slope -= way[DOWN]
    elif way[FLATS] > 0.0:
        way[FLATS] -= 1.0
    elif way[UPS] > 0.0:
        way[UPS] -= 1.0
        slope += way[UP]
    else:
        return 0.0
    rests = way[DOWNS] == 0.0 and way[FLATS] == 0.0 and way[UPS] == 0.0
    return 0.0 if rests else slope


@kernel
def run_rate(
    targets: Array,
    ahead: Array,
    caps: Array,
    limit: Array,
    first: int,
    windows: IntArray,
    period: float,
    base: float,
    duration: float,
    state: Array,
    taus: Array,
    rates: Array,
) -> int:
    """Run a law towards wanted rates, negative ones backwards.

    Parameters
    ----------
    targets : (n,) array
        The wanted rates.
    ahead : (levels, cells, 4, columns) array
        What the law asks for in windows[level] ticks from tick first + i on, forwards, or from tick first - i on,
        backwards.
    caps : (levels, cells) array
        Highest rates there.
    limit : (3, columns) array
        What every column keeps.
    first : int
        Tick of the first cell.
    windows : (levels,) array of int
        Ticks of a window.
    period : float
        Servo period, s.
    base : float
        The rate that keeps the limits everywhere.
    duration : float
        Of the law, s.
    state : (STATE,) array
        Carried on.
    taus, rates : (n,) array
        Out: plan time, s, and rate at the ticks; rates are negative backwards.

    Returns
    -------
    int
        The ticks that were run. It ends before a tick for which `ahead` has nothing, at rest before it turns round, and
        at the end of the law.
    """
    levels = ahead.shape[0]
    way = np.zeros(STATE)
    for i in range(targets.shape[0]):
        tau = state[TAU]
        rate = state[RATE]
        slope = state[SLOPE]
        direction = state[DIRECTION]
        forward = direction > 0.0
        number = int(tau / period)
        cell = number - first if forward else first - number
        if (forward and tau >= duration) or cell < 0 or cell >= ahead.shape[1]:
            return i
        target = direction * targets[i]
        rests = rate == 0.0 and slope == 0.0
        if rests and state[STILL] == 1.0:
            target = 0.0  # a rest of one tick would be a setpoint said twice, as by mistake: it lasts two
        if rests and target < 0.0:
            return i  # it turns round
        target = max(target, 0.0)
        if not forward and tau <= 0.0:
            target = 0.0  # back at the start
        goal = target
        wanted = 0.0
        certain = True
        if target != rate or slope != 0.0 or rate > base:
            # the stretch on which it may run fastest, the shorter one of two that are alike
            best = 0
            for level in range(1, levels):
                if min(caps[level, cell], target) > min(caps[best, cell], target):
                    best = level
            certain = False
            for k in range(levels + 1):
                level = best if k == 0 else k - 1
                if k > 0 and level == best:
                    continue
                top = caps[level, cell]
                behind = number + windows[level] if forward else number + 1 - windows[level]
                end = direction * (behind * period - tau)
                goal = min(target, top)
                needs = (ahead[level, cell], limit, period)
                certain = _step(rate, slope, goal, base, top, end, needs, way)
                if certain or (rate <= base and target <= base):
                    break
            if certain:
                wanted = way[SLOPE]
                state[DOWN:] = way[DOWN:]
        if not certain:
            # the way out that was certain before still is: another step of it
            wanted = _along_way_out(slope, state)
        after = rate + 0.5 * period * (slope + wanted)
        if wanted == 0.0 and abs(after - goal) <= AT_TARGET:
            after = goal
        if wanted == 0.0 and after <= ROUNDING:
            after = 0.0  # a way out that ends at rest does so exactly, whatever is wanted by then
        after = max(after, 0.0)
        tau += direction * period * (rate + period * (slope / 3.0 + wanted / 6.0))
        state[STILL] = state[STILL] + 1.0 if tau == state[TAU] else 0.0
        if not forward and tau <= 0.0:
            # at the start the law is at rest, and so is what is sent, at any rate
            tau = after = wanted = 0.0
            state[DOWN:] = 0.0
        state[TAU] = min(tau, duration)
        state[RATE] = after
        state[SLOPE] = wanted
        taus[i] = state[TAU]
        rates[i] = direction * after
    return targets.shape[0]
