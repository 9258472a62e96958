"""A motion that is where a path wants it when the path wants it: slower than the fastest one, curve by curve.

On each stretch between two wanted times the motion may use a share of all limits, as a factor on q: with the share f a
stretch by itself takes 1 / sqrt(f) times as long. Shares are found by planning again with f (T / W)^2, T being what the
stretch took and W what is wanted, until all places are passed within a period; the whole is then stretched to the end.
So every limit is kept as in any plan, and a duration alone slows the fastest motion down as a whole. It converges where
more than half of a stretch's time is a matter of its own share, see docs/math/planner.md. Else, after PLANS, or where a
stretch with the whole limits is too slow between slow ones, the times are refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.paths.path import Path
from splinefeed.planner.constants import ALMOST, HALVINGS, SAME
from splinefeed.planner.shared import stretched
from splinefeed.planner.ticks import MOST_TICKS
from splinefeed.records import Array, IntArray, Limits, TimeLaw

#: Plans that are made at most to find the shares, and the least share.
PLANS, LEAST = 40, 1e-8
#: Without a period, places are passed within this share of the whole time; a stretch that is too short by less may be.
WITHIN = 1e-4
#: After so many plans a stretch that uses its limits whole and is still too slow cannot be passed in its time.
SETTLED = 6


def in_time(make: Callable[[Array], TimeLaw], path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Plan the law that passes the curves' ends at `path.times`.

    Parameters
    ----------
    make : callable
        Plans with shares of the limits (curves,).
    path : Path
        With wanted times.
    limits : Limits
        Of the motion.
    period : float or None
        Servo period, s; wanted times are rounded to ticks.

    Returns
    -------
    TimeLaw
        It passes them within a period, and the last one to the tick.

    Raises
    ------
    LimitsError
        For a path that waits or a motion that does not begin and end at rest.
    PlanError
        For times that are too short, with the shortest.
    """
    assert path.times is not None
    if path.dwells or path.stops or limits.start_feed > 0.0 or limits.end_feed > 0.0:
        raise LimitsError("times: a motion with wanted times rests where it begins and ends and nowhere between")
    ends = np.flatnonzero(~np.isnan(path.times))
    wanted, notes = path.times[ends], []
    if period is not None:
        ticks = np.maximum(np.round(wanted / period), 1.0)
        if abs(wanted[-1] / period - ticks[-1]) > ALMOST * ticks[-1] and ends[-1] == len(path.times) - 1:
            notes = [
                f"{wanted[-1]:.9g} s are no whole periods of {period:g} s: the motion takes {ticks[-1] * period:.9g}"
            ]
        wanted = ticks * period
        if wanted[-1] > MOST_TICKS * period:
            raise PlanError(
                f"times: {wanted[-1]:.3g} s are more than {MOST_TICKS:.0e} setpoints, the most that are held to "
                "limits; give shorter times or a longer period"
            )
    owner = np.searchsorted(ends, np.arange(len(path.times)))  # what lies behind the last wanted time is not slowed
    places = path.curve_starts[ends + 1]
    whole = ends[-1] == len(path.times) - 1
    close = period if period is not None else WITHIN * float(wanted[-1])
    spans = np.diff(wanted, prepend=0.0)
    shares = np.ones(len(ends) + 1)
    for k in range(PLANS):
        law = make(shares[owner])
        at = times_at(law, places)
        if whole:
            at[-1] = law.duration
        longer = float(wanted[-1] / at[-1]) if whole else 1.0
        slow = np.flatnonzero((shares[:-1] == 1.0) & (np.diff(at, prepend=0.0) > spans + close))
        if len(slow) and ((k == 0 and len(ends) == 1) or k >= SETTLED):
            raise _too_short(ends, wanted, np.diff(at, prepend=0.0), int(slow[0]), settled=k > 0)
        if longer >= 1.0 - SAME and np.all(np.abs(at * longer - wanted) <= close):
            slower = stretched(law, [0], [float(wanted[-1] - law.duration)]) if longer > 1.0 else law
            return replace(slower, notes=(*law.notes, *notes))
        shares[:-1] = np.clip(shares[:-1] * (np.diff(at, prepend=0.0) / spans) ** 2, LEAST, 1.0)
    off = int(np.argmax(np.abs(at - wanted)))
    raise PlanError(
        f"times: after {PLANS} plans waypoint {int(ends[off]) + 2} is passed at {at[off]:.6g} s, and "
        f"{wanted[off]:.6g} s are wanted: what stretches beside much slower ones need was not found; give them more "
        "time, or NaN where any will do"
    )


def times_at(law: TimeLaw, s: Array) -> Array:
    """Find when a law first reaches lengths, by bisection in the piece that does.

    Parameters
    ----------
    law : TimeLaw
        The law.
    s : (n,) array
        Lengths, mm.

    Returns
    -------
    (n,) array
        Times, s.
    """
    ends = np.append(law.coefficients[1:, 0], np.inf)
    piece = np.searchsorted(ends, s)
    low, high = law.breaks[piece], law.breaks[piece + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        before = law(middle) < s
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.asarray(high)


def _too_short(ends: IntArray, wanted: Array, spans: Array, k: int, *, settled: bool) -> PlanError:
    """The error for a stretch that takes longer than it may, alone or, `settled`, among the others."""
    if len(ends) == 1:
        found = math.ceil(float(spans[0]) * 1e6) / 1e6
        return PlanError(
            f"the motion takes at least {found:.9g} s within its limits; {wanted[0]:.9g} s are wanted: give more"
        )
    first = int(ends[k - 1]) + 1 if k else 0
    given = np.diff(wanted, prepend=0.0)
    longer = float(np.max(spans / given))  # the square is enough where half is a matter of its own share
    among = ", where the others last as wanted" if settled else ""
    return PlanError(
        f"times: from waypoint {first + 1} to {int(ends[k]) + 2} the motion takes {spans[k]:.6g} s within its limits"
        f"{among}; {given[k]:.6g} s are wanted: give more there, or all times {_up(longer)} to {_up(longer**2)} times "
        "as long"
    )


def _up(value: float) -> str:
    """Three decimals, rounded up."""
    return f"{math.ceil(1e3 * value) / 1e3:g}"
