"""The arithmetic of the seven-phase feed profile: one stretch, its whole periods, and the pieces of many stretches.

Source of every equation number here: S. Alimohammadi, B. Motakef Imani, Modares Mechanical Engineering 15(13),
158-162, 2015. Where its print is wrong, the mended form is used: (7) phase 5 has a minus; (9) phase 1 has 1/6, not
0.5; (10) L_k = l_k - l_k-1; (14) its last term is added; (15) phases 5 and 7 stand in their own places; (19) has fe.
Lengths in mm, times in s.
"""

from __future__ import annotations

import math

from splinefeed.kernels.jit import kernel, leaf
from splinefeed.records import Array

# A profile is one row of floats: T1..T7 stand at 0..6, then what follows.
PEAK = 7  # feed of phase 4, mm/s
ACCELERATION = 8  # magnitude reached in phases 1-3, mm/s^2
DECELERATION = 9  # magnitude reached in phases 5-7, mm/s^2
JERK = 10  # of phases 1 and 3, mm/s^3
DECELERATION_JERK = 11  # of phases 5 and 7, mm/s^3
START_FEED = 12  # mm/s
END_FEED = 13  # mm/s
LENGTH = 14  # mm
DURATION = 15  # s
ROW = 16

SOLVED = 0
NO_ROOM = 1  # the length does not even reach from the start feed to the end feed

#: A period longer or shorter by this share is the same period: three times it is what a uniform stretch may add to
#: a jerk, and it stays far below the 1e-9 that no limit may be exceeded by.
SAME = 5e-11
#: A duration this near to a whole number of periods is whole, in periods (and never more than SAME of itself).
WHOLE = 1e-9
#: Rounding that sums of a few products leave, relative: 2^-52 sixteen times.
ROUNDING = 16.0 * 2.0**-52
#: By how much a bracket from a bound is widened, lest rounding leave the answer outside, relative.
HAIR = 1e-9
#: Bisection alone, on a logarithmic scale, narrows any bracket of floats to neighbours in fewer steps than this.
STEPS = 200
#: A share of a phase below this is not seen, as limits hold to 1e-9.
UNSEEN = 5e-10
#: Keeps brackets (mm/s), whose middle is taken between logarithms, and divisors away from zero.
SMALLEST = 1e-200
#: Profiles that plain Python makes, some 0.2 ms each, in the time of a compile.
WORTH = 10_000


@leaf(worth=WORTH)
def lasting_jerk(acceleration: float, jerk: float, rounding: float) -> float:
    """The jerk J' to plan with where acceleration A builds up so fast that the rounding of instants, s, shows.

    J' + J' (J' rounding / A) = J: what a phase of A/J' s, rounding shorter, takes to reach A. It lasts 4 roundings at
    least. Where the rounding does not show, J itself.
    """
    share = rounding * jerk / acceleration
    if not UNSEEN < share < math.inf:
        return jerk
    return min(2.0 * jerk / (1.0 + math.sqrt(1.0 + 4.0 * share)), 0.25 * acceleration / rounding)


@kernel
def ramp(rise: float, acceleration: float, jerk: float) -> tuple[float, float, float]:
    """Time of each jerk phase, time of the phase between them, and acceleration reached, of a change of feed.

    T1 = T3 = A/J and T2 = rise/A - A/J (eq. 17, 19); where that is negative A = sqrt(J rise), T2 = 0 (eq. 18, 20).
    rise mm/s, acceleration mm/s^2, jerk mm/s^3; times in s. A rise that is not positive takes no time.
    """
    if rise <= 0.0:
        return 0.0, 0.0, 0.0
    full = acceleration / jerk  # eq. (11), (12)
    if rise >= acceleration * full:
        return full, max(rise / acceleration - full, 0.0), acceleration  # eq. (17), (19)
    reached = min(math.sqrt(jerk * rise), acceleration)  # eq. (18), (20)
    return reached / jerk, 0.0, reached


@leaf(worth=WORTH)
def ramp_distance(low: float, rise: float, acceleration: float, jerk: float) -> float:
    """Length of a change of feed from `low` to `low + rise` or back, mean feed times time (eq. 21): mm/s to mm."""
    edge, middle, _ = ramp(rise, acceleration, jerk)
    return (low + 0.5 * rise) * (2.0 * edge + middle)


@kernel
def _ramp_slope(rise: float, acceleration: float, jerk: float) -> float:
    """How much longer a change of feed takes when it grows: 1/A, or 1/sqrt(J rise) below the full A, s per mm/s."""
    return max(1.0 / acceleration, 1.0 / math.sqrt(max(jerk * rise, SMALLEST)))


@kernel
def _measure(row: Array, excess: float) -> tuple[float, float, float, float]:
    """Length of the ramps, duration of the whole, and their derivatives, at a peak of `excess` over the faster end.

    With f = peak, Tu and Td the times of the ramps: l = (fs + f)/2 Tu + (f + fe)/2 Td, T4 = (L - l)/f (eq. 21, 22),
    T = Tu + Td + T4. l grows with f, for each factor does; T falls: f Tu' - Tu + T1 = fs Tu', so what is left of its
    derivative is T' = -(T1 + 2 T4 + T5)/2f.
    The unknown is the excess and not f: a ramp goes with the root of its rise, which f - fs would lose to rounding.
    Returns mm, mm per mm/s, s, s per mm/s.
    """
    start, end = row[START_FEED], row[END_FEED]
    top = max(start, end) + excess
    # A row that is lowered holds the acceleration that it reached: no lower peak can ask for more.
    rise, fall = excess + max(end - start, 0.0), excess + max(start - end, 0.0)
    edge_up, middle, _ = ramp(rise, row[ACCELERATION], row[JERK])
    time_up = 2.0 * edge_up + middle
    edge_down, middle, _ = ramp(fall, row[DECELERATION], row[DECELERATION_JERK])
    time_down = 2.0 * edge_down + middle
    distance = 0.5 * (start + top) * time_up + 0.5 * (top + end) * time_down
    cruise = (row[LENGTH] - distance) / max(top, SMALLEST)
    duration = time_up + time_down + cruise
    if excess <= 0.0:
        return distance, math.inf, duration, -math.inf
    slope_up = _ramp_slope(rise, row[ACCELERATION], row[JERK])
    slope_down = _ramp_slope(fall, row[DECELERATION], row[DECELERATION_JERK])
    distance_slope = 0.5 * (time_up + time_down + (start + top) * slope_up + (top + end) * slope_down)
    return distance, distance_slope, duration, -0.5 * (edge_up + edge_down + 2.0 * cruise) / top


@kernel
def _find_excess(row: Array, by_length: bool, target: float, base: float, low: float, high: float) -> float:
    """The excess over the faster end at which the ramps have the length `target`, or the whole the duration `target`.

    Newton inside a bracket, at most STEPS of it. By length the step is taken between logarithms, where the slope
    lies between 1/2 (a short rise above a feed) and 2 (long ramps from rest), whatever the decade. `base` is the
    length at no excess. Where a step leaves the bracket or does not halve the error, the bracket is halved.
    """
    excess = high
    before = math.inf
    for _ in range(STEPS):
        distance, distance_slope, duration, duration_slope = _measure(row, excess)
        error = distance - target if by_length else target - duration  # both grow with the excess
        if abs(error) <= 0.125 * ROUNDING * target:
            return excess
        if error > 0.0:
            high = min(high, excess)
        else:
            low = max(low, excess)
        if high - low <= 0.125 * ROUNDING * high:
            return low
        following = 0.0
        if abs(error) <= 0.5 * before:
            if not by_length:
                following = excess + error / min(duration_slope, -SMALLEST)
            elif distance > base:
                slope = min(max(excess * distance_slope / (distance - base), 0.5), 2.0)
                following = excess * ((target - base) / (distance - base)) ** (1.0 / slope)
        if not low < following < high:
            following = math.sqrt(low) * math.sqrt(high)
        if following == excess:
            return excess
        excess = following
        before = abs(error)
    return low


@kernel
def _fill(row: Array, excess: float) -> None:
    """Write the seven durations, the peak and what it reaches, for a peak of `excess` over the faster end."""
    start, end = row[START_FEED], row[END_FEED]
    peak = max(start, end) + excess
    edge, middle, reached = ramp(excess + max(end - start, 0.0), row[ACCELERATION], row[JERK])
    row[0], row[1], row[2], row[ACCELERATION] = edge, middle, edge, reached  # eq. (11), (13), (17), (18)
    distance = 0.5 * (start + peak) * (2.0 * edge + middle)
    edge, middle, reached = ramp(excess + max(start - end, 0.0), row[DECELERATION], row[DECELERATION_JERK])
    row[4], row[5], row[6], row[DECELERATION] = edge, middle, edge, reached  # eq. (12), (15), (19), (20)
    distance += 0.5 * (peak + end) * (2.0 * edge + middle)  # eq. (21)
    rest = row[LENGTH] - distance
    row[3] = rest / peak if rest > 2.0 * ROUNDING * row[LENGTH] else 0.0  # eq. (22)
    row[PEAK] = peak
    row[DURATION] = row[0] + row[1] + row[2] + row[3] + row[4] + row[5] + row[6]


@leaf(worth=WORTH)
def seven_phase(
    length: float,
    feed: float,
    acceleration: float,
    deceleration: float,
    jerk: float,
    deceleration_jerk: float,
    start_feed: float,
    end_feed: float,
    out: Array,
) -> int:
    """Fastest profile of seven phases of constant jerk over `length`, preparation included (eq. 4-22, fig. 2).

    The highest f <= feed with L >= (fs + f)/2 Tu(f - fs) + (f + fe)/2 Td(f - fe) (eq. 21), where Tu and Td follow
    (17)-(20) at that very f: so (18), (20) and (22) hold together. T4 covers what is left (eq. 22).
    mm, mm/s, mm/s^2, mm/s^3. Fills `out` (ROW,) and returns SOLVED; or NO_ROOM, with out[LENGTH] the least
    length that would do. Source: see the head of this file.
    """
    out[ACCELERATION], out[DECELERATION] = acceleration, deceleration
    out[JERK], out[DECELERATION_JERK] = jerk, deceleration_jerk
    out[START_FEED], out[END_FEED], out[LENGTH] = start_feed, end_feed, length
    floor = max(start_feed, end_feed)
    base = 0.0
    if floor > 0.0:
        base = _measure(out, 0.0)[0]
        if base > length * (1.0 + ROUNDING):
            out[LENGTH] = base
            return NO_ROOM
    excess = feed - floor if base < length * (1.0 - ROUNDING) else 0.0
    lowered = False
    if excess > 0.0:
        reach = _measure(out, excess)[0]
        lowered = reach > length  # eq. (22)
        if lowered:
            share = (length - base) / (reach - base)
            low = max((1.0 - HAIR) * excess * share * share, SMALLEST)  # between logarithms the slope is at least 1/2
            high = min((1.0 + HAIR) * excess * math.sqrt(share), excess)  # and at most 2
            excess = _find_excess(out, True, length, base, low, high)
    _fill(out, excess)
    if not lowered and excess > 0.0:
        out[PEAK] = feed  # to the bit
    return SOLVED


@kernel
def _stretch(row: Array, duration: float) -> None:
    """Run the whole profile slower by k = duration / its own: times k, feeds 1/k, accelerations 1/k^2, jerks 1/k^3."""
    k = duration / row[DURATION]
    for phase in range(7):
        row[phase] *= k
    for place in (PEAK, START_FEED, END_FEED):
        row[place] /= k
    row[ACCELERATION] /= k * k
    row[DECELERATION] /= k * k
    row[JERK] /= k * k * k
    row[DECELERATION_JERK] /= k * k * k
    row[DURATION] = duration


@leaf(worth=WORTH)
def to_periods(row: Array, period: float, offset: float) -> float:
    """Lengthen a solved profile so that it ends on a tick; returns the tick's number, or 0.0 where it cannot.

    The profile begins `offset` s after tick 0. From rest to rest it is stretched; with end feeds its peak is
    lowered, at most to the faster end; a duration already whole to within WHOLE is stretched onto it. All in s.
    """
    ticks = (row[DURATION] + offset) / period
    nearest = math.floor(ticks + 0.5)
    slack = min(WHOLE, SAME * row[DURATION] / period) + ROUNDING * row[DURATION] / period
    if nearest >= 1.0 and abs(ticks - nearest) <= slack:
        _stretch(row, nearest * period - offset)
        return nearest
    whole = float(math.ceil(ticks))
    duration = whole * period - offset
    floor = max(row[START_FEED], row[END_FEED])
    if floor == 0.0:
        _stretch(row, duration)
        return whole
    longest = _measure(row, 0.0)[2]
    if longest < duration:
        return 0.0
    # Each change of feed counts A (T1 + T2): the difference of two feeds would have lost its digits.
    high = min(row[ACCELERATION] * (row[0] + row[1]), row[DECELERATION] * (row[4] + row[5]))
    if high <= 0.0:
        return 0.0
    low = min(max(floor * (1.0 - duration / longest), SMALLEST), high)  # for -T' <= T/f, see _measure
    _fill(row, _find_excess(row, False, duration, 0.0, low, high))
    row[DURATION] = duration
    return whole


@leaf(worth=WORTH, rows=("rows",))
def prepare(
    marks: Array,
    feeds: Array,
    acceleration: float,
    deceleration: float,
    jerk: float,
    deceleration_jerk: float,
    start_feed: float,
    end_feed: float,
    rows: Array,
) -> int:
    """Solve one profile a stretch between `marks` (m+1,), at rest at the inner ones, into `rows` (m, ROW).

    feeds (m,): the limit on each stretch. mm, mm/s, mm/s^2, mm/s^3. Returns -1, or the index of the first stretch that
    has no room, its least length being in its row.
    """
    last = len(marks) - 2
    for i in range(last + 1):
        start = start_feed if i == 0 else 0.0
        end = end_feed if i == last else 0.0
        length = marks[i + 1] - marks[i]
        status = seven_phase(length, feeds[i], acceleration, deceleration, jerk, deceleration_jerk, start, end, rows[i])
        if status != SOLVED:
            return i
    return -1


@leaf(worth=WORTH, rows=("rows", "coefficients"))
def lay_out(marks: Array, rows: Array, period: float, breaks: Array, coefficients: Array, late: Array) -> int:
    """Bring solved stretches to ticks and write them one after the other as cubic pieces; returns their number m.

    marks (n+1,) mm, rows (n, ROW); period s, or 0.0 for no ticks; breaks (7n+1,) s, coefficients (7n, 6) zeros;
    late (n,) becomes 0.0, or the time in s past the last tick at which a stretch ends that could not end on one.
    A tick is its number times the period, never a sum; without ticks the sum is compensated (Neumaier).
    """
    count = 0
    tick = 0.0
    offset = 0.0
    time = 0.0
    lost = 0.0
    for i in range(len(rows)):
        row = rows[i]
        late[i] = 0.0
        begin = time + lost
        if period > 0.0:
            begin = tick * period + offset
            ticks = to_periods(row, period, offset)
            if ticks > 0.0:
                tick += ticks
                offset = 0.0
            else:
                passed = math.floor((offset + row[DURATION]) / period)
                tick += passed
                offset += row[DURATION] - passed * period
                late[i] = offset
            end = tick * period + offset
        else:
            total = time + row[DURATION]
            lost += (time - total) + row[DURATION] if time >= row[DURATION] else (row[DURATION] - total) + time
            time = total
            end = time + lost
        count = _write_pieces(row, marks[i], marks[i + 1], begin, end, breaks, coefficients, count)
    return count


@kernel
def _write_pieces(
    row: Array, s0: float, s1: float, t0: float, t1: float, breaks: Array, coefficients: Array, count: int
) -> int:
    """Append the phases of one profile from (t0, s0) to (t1, s1) as pieces (eq. 7-9); returns the number of pieces.

    s(t) = l + f t + a t^2/2 + j t^3/6 in local time. Phases 1-3 are laid from the start and 5-7 from the end, so
    rounding meets in the middle. A phase of no length, or too short for its time, makes no piece.
    """
    start, end, peak = row[START_FEED], row[END_FEED], row[PEAK]
    a, d, j, jd = row[ACCELERATION], row[DECELERATION], row[JERK], row[DECELERATION_JERK]
    f1 = start + 0.5 * a * row[0]  # eq. (8)
    f2 = f1 + a * row[1]
    f6 = end + 0.5 * d * row[6]  # eq. (14)
    f5 = f6 + d * row[5]
    l1 = s0 + (start + j * row[0] * row[0] / 6.0) * row[0]  # eq. (9)
    l2 = l1 + (f1 + 0.5 * a * row[1]) * row[1]
    l3 = s0 + 0.5 * (start + peak) * (row[0] + row[1] + row[2])
    l6 = s1 - (end + jd * row[6] * row[6] / 6.0) * row[6]
    l5 = l6 - (f6 + 0.5 * d * row[5]) * row[5]
    l4 = s1 - 0.5 * (peak + end) * (row[4] + row[5] + row[6])
    t3 = t0 + row[0] + row[1] + row[2]
    t4 = t1 - row[6] - row[5] - row[4]
    if row[3] == 0.0 or t3 >= t4:  # no room for phase 4: its two ends are one instant
        t3 = t4 = t4 if row[0] > 0.0 else t0
    begins = (t0, t0 + row[0], t0 + row[0] + row[1], t3, t4, t1 - row[6] - row[5], t1 - row[6], t1)
    places = (s0, l1, l2, l3, l4, l5, l6)
    feeds = (start, f1, f2, peak, peak, f5, f6)
    accelerations = (0.0, a, a, 0.0, 0.0, -d, -d)  # eq. (7)
    jerks = (j, 0.0, -j, 0.0, -jd, 0.0, jd)
    first = count
    begin = t0
    for phase in range(7):
        after = min(max(begins[phase + 1], begin), t1)
        if after > begin:
            breaks[count] = begin
            piece = coefficients[count]
            piece[0] = places[phase]
            piece[1] = feeds[phase]
            piece[2] = 0.5 * accelerations[phase]
            piece[3] = jerks[phase] / 6.0
            count += 1
        begin = after
    breaks[count] = t1
    if count > first + 1:  # the last piece ends at s1 to the bit, as Horner's rule will evaluate it
        last = coefficients[count - 1]
        tau = t1 - breaks[count - 1]
        last[0] = s1 - ((last[3] * tau + last[2]) * tau + last[1]) * tau
    return count
