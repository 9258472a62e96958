"""A motion from a state at its limits, which cubics in s cannot follow on cells as they are.

The motion from the nearest state that cells allow shows where finer ones lie; on a straight line the acceleration is
taken away first.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.limit_table import TICKS
from splinefeed.planner.audit import worst_shares
from splinefeed.planner.conditions import BESIDE, Conditions
from splinefeed.planner.constants import ALMOST, KEPT, SAME
from splinefeed.planner.grid import Samples
from splinefeed.planner.horizon import Plan, SolverSettings, plan_window
from splinefeed.planner.law import MotionPieces, joined
from splinefeed.planner.rows import Rows
from splinefeed.planner.straight import straight_ahead
from splinefeed.records import State

#: What a beginning in closed form may take of a limit beyond it: less than KEPT, more than states round by.
OVER = 1e-7
#: Cells, as shares of those of the first try, where the motion from the nearest state shows the way. A window that goes
#: on takes the first of them alone: from a motion on the finest ones the next window found none.
FINER = 1 / 4, 1 / 16
#: The nearest state is so near, as a factor on q, that finer cells may make up for what is missing.
NEARLY = 0.8


def plan_from(
    conditions: Conditions,
    low: float,
    high: float,
    start: State,
    stop: State,
    mode: SolverSettings,
    known: Samples | None = None,
) -> Plan:
    """Plan the motion between two states of which one at least moves, as `plan_window` exactly.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    low, high : float
        The ends, mm.
    start, stop : State
        How the motion is there.
    mode : SolverSettings
        How closely to plan.
    known : Samples, optional
        From `low` to `high` or further.

    Returns
    -------
    Plan
        Where cells as they are allow none: on a straight line without the acceleration, then on finer ones.

    Raises
    ------
    PlanError
        Where no motion was found.
    """
    if over_at(conditions, low, start) > 1.0 + 2.0 * KEPT:
        still = np.array([[low, start.feed, 0.5 * start.acceleration, 0.0, 0.0, 0.0]])
        return Plan(MotionPieces(np.zeros(1), still), 0.0, np.inf, 0.0)

    def tries() -> Iterator[Plan]:
        nearest = plan_window(conditions, low, high, start, stop, mode, known=known)
        yield nearest
        # limits between ticks bind by steps of other places, too, which finer cells leave to the setpoints
        least = 0.0 if conditions.limits.given(TICKS) else NEARLY
        if nearest.share > least:
            with suppress(PlanError):
                released = _released(conditions, low, high, start, stop, mode)
                if released is not None:
                    yield released
        for finer in FINER[:1] if mode.yielding else FINER:
            if nearest.share > least:
                least = NEARLY
                with suppress(PlanError):
                    fine = replace(mode, fine=finer)
                    nearest = plan_window(conditions, low, high, start, stop, fine, known=known, like=nearest)
                    yield nearest

    found: list[Plan] = []
    for plan in tries():
        found.append(plan)
        if plan.over <= 1.0 + KEPT:
            break
    return min(found, key=lambda each: each.over)


def over_at(conditions: Conditions, place: float, state: State) -> float:
    """The largest share of a limit of velocity or acceleration in a state, as a factor on q."""
    rows = _rows_at(conditions, place)
    shares = rows.shares(np.full(1, state.feed), np.full(1, state.acceleration), np.zeros(1))
    return float(np.max(rows.by_kind(shares)[:2]))


def allowed_at(conditions: Conditions, place: float, state: State) -> State:
    """The state with no more feed, and then no more acceleration, than limits of velocity and acceleration allow."""
    v = state.feed / max(over_at(conditions, place, State(state.feed)), 1.0) ** 0.5
    rows = _rows_at(conditions, place)
    own, slope = rows.linear[:, 0, 0] * v * v, 2.0 * rows.linear[:, 1, 0]
    up, down = (0.0, 0.0) if rows.root is None else rows.root[:, :, 0] * v
    some = slope != 0.0
    sides = np.stack([rows.low[:, 0] + down - own, rows.high[:, 0] - up - own])[:, some] / slope[some]
    least, most = np.max(np.min(sides, axis=0), initial=-np.inf), np.min(np.max(sides, axis=0), initial=np.inf)
    return State(v, float(min(max(state.acceleration, min(least, 0.0)), max(most, 0.0))), state.s)


def _rows_at(conditions: Conditions, place: float) -> Rows:
    length = conditions.track.length
    return conditions.rows(np.clip(np.array([place]), BESIDE * length, (1.0 - BESIDE) * length), alone=True)


def _released(
    conditions: Conditions, low: float, high: float, start: State, stop: State, mode: SolverSettings
) -> Plan | None:
    """Take away the acceleration by full jerk, and go on from there; None but on a straight line.

    The jerk is at least that which takes it away just when the feed is at its limit, or 0: that may round to more.
    """
    v, a = start.feed, start.acceleration
    end, (feed, _, _, jerk, jerk_down) = straight_ahead(conditions, low, high)
    most, room = (jerk, feed - v) if a > 0.0 else (jerk_down, v)
    least = 0.5 * a * a / max(room, SAME * v) if v > 0.0 else np.inf
    if a == 0.0 or least > most * (1.0 + OVER):
        return None
    jerk = least if least > most * (1.0 - ALMOST) else most
    t = abs(a) / jerk
    pieces = MotionPieces(np.array([t]), np.array([[low, v, 0.5 * a, -a / t / 6.0, 0.0, 0.0]]))
    place, feed = low + (v + a * t / 3.0) * t, v + 0.5 * a * t
    if not place < end:
        return None
    own = float(np.max(worst_shares(conditions, pieces, place)[0]))
    onwards = State(0.0 if feed < ALMOST * v else feed)
    rest = plan_window(conditions, place, high, onwards, stop, mode, exact=True)
    return Plan(joined([pieces, rest.pieces]), 0.0, max(own, rest.over))
