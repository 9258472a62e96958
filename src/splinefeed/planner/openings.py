"""A motion from a state at its limits, where cubics in s cannot follow them or are not found: more ways to begin.

On a straight line limits do not change: the acceleration is released at full jerk, at once or behind a brake, and a
profile of seven phases goes on from there. Elsewhere the motion from a slower state shows cubics the way. To a rest
nearby one quintic leads, which shows it where it is over a limit. The audit has the last word on each.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.audit import worst_shares
from splinefeed.planner.conditions import BESIDE, Conditions
from splinefeed.planner.constants import ALMOST, HALVINGS, KEPT, SAME
from splinefeed.planner.grid import Samples
from splinefeed.planner.horizon import Plan, SolverSettings, plan_window
from splinefeed.planner.law import MotionPieces, joined, quintics
from splinefeed.planner.profiles import pieces, ramp, solve
from splinefeed.planner.straight import straight_ahead
from splinefeed.records import LAW_COEFFICIENTS, State

#: What a beginning in closed form may take of a limit beyond it: less than KEPT, more than states round by.
OVER = 1e-7
#: Feeds at the ends of a motion which shows the way, and cells, as shares of those of the first try.
CALM, FINER = 0.5, 0.5
#: How far ahead, in units of v^2 / |a|, a rest may be for a quintic to show the way, ...
LAST_BIT = 0.1, 1.0
#: ... which is over a limit by no more than this, as a factor on q; its time is up to SLOWEST times that at the feed it
#: begins with, of which PASSES times TRIED are tried.
BRIDGING, SLOWEST, PASSES, TRIED = 2.0, 5.0, 2, 21


@dataclass(frozen=True, eq=False)
class Opening:
    """The beginning of a motion, the place where it ends, mm, and the state there."""

    pieces: MotionPieces
    end: float
    state: State


@dataclass(frozen=True)
class _Line:
    """A straight line from `low` to `end`, mm, and its limits: feed, accelerations and jerks, up and down."""

    low: float
    end: float
    feed: float
    up: float
    down: float
    jerk: float
    jerk_down: float

    def profile(self, place: float, feed: float, end_feed: float, most: float) -> MotionPieces | None:
        """Seven phases from a feed at a place to one at the end, below `most`, mm/s; None without room."""
        length = np.array([self.end - place])
        if length[0] <= 0.0:
            return None
        found = solve(length, most, self.up, self.down, self.jerk, self.jerk_down, feed, end_feed)
        if not np.isfinite(found.duration[0]):
            return None
        spans, rows = found.durations[:, 0], pieces(found, np.array([place]), np.array([self.end]))[0]
        return MotionPieces(spans[spans > 0.0], rows[spans > 0.0])


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
        Where cubics find none: with a beginning in closed form, then from where another motion leads, then with finer
        cells.

    Raises
    ------
    PlanError
        Where no motion was found.
    """
    openings = _openings(conditions, low, high, start, stop)
    if openings is None or over_at(conditions, low, start) > 1.0 + 2.0 * KEPT:
        still = np.array([[low, start.feed, 0.5 * start.acceleration, 0.0, 0.0, 0.0]])
        return Plan(MotionPieces(np.zeros(1), still), 0.0, np.inf)

    def between(start: State, stop: State, mode: SolverSettings, like: Plan | None = None) -> Plan:
        return plan_window(conditions, low, high, start, stop, mode, exact=True, known=known, like=like)

    def led(like: Plan, finer: float) -> Iterator[Plan]:
        for share in (1.0, finer, finer**2):
            fine = replace(mode, cell=share * mode.cell, growth=share * mode.growth, alone=share < 1.0)
            with suppress(PlanError):
                yield between(start, stop, fine, like)

    def tries() -> Iterator[Plan]:
        yield between(start, stop, mode)
        for opening in openings:
            with suppress(PlanError):
                yield _continued(conditions, opening, high, stop, mode)
        with suppress(PlanError):
            yield from led(between(start.slower(CALM), stop.slower(CALM), mode), FINER)
        bridge = _bridge(conditions, low, high, start) if stop.feed == 0.0 else None
        if bridge is not None:
            yield bridge
            yield from led(bridge, FINER**2)  # it is short

    found: list[Plan] = []
    for plan in tries():
        found.append(plan)
        if plan.over <= 1.0 + KEPT:
            break
    return min(found, key=lambda each: each.over)


def over_at(conditions: Conditions, place: float, state: State) -> float:
    """The largest share of a limit of velocity or acceleration in a state, as a factor on q."""
    length = conditions.track.length
    rows = conditions.rows(np.clip(np.array([place]), BESIDE * length, (1.0 - BESIDE) * length), alone=True)
    shares = rows.shares(np.full(1, state.feed), np.full(1, state.acceleration), np.zeros(1))
    return float(np.max(rows.by_kind(shares)[:2]))


def _openings(conditions: Conditions, low: float, high: float, start: State, stop: State) -> list[Opening] | None:
    """Beginnings in closed form, the best first; None if the straight line ahead has no motion from there."""
    if start.feed == 0.0:
        return []
    end, limits = straight_ahead(conditions, low, high)
    if not end > low:
        return []
    return _on_a_line(_Line(low, end, *limits.tolist()), high, start, stop, _near(conditions, low, high))


def _continued(conditions: Conditions, opening: Opening, high: float, stop: State, mode: SolverSettings) -> Plan:
    """The motion with this beginning: it ends at `high`, or goes on to there."""
    own = float(np.max(worst_shares(conditions, opening.pieces, opening.end)[0]))
    if opening.end == high or own > 1.0 + KEPT:
        return Plan(opening.pieces, 0.0, own)
    rest = plan_window(conditions, opening.end, high, opening.state, stop, mode, exact=True)
    return Plan(joined([opening.pieces, rest.pieces]), 0.0, max(own, rest.over))


def _bridge(conditions: Conditions, low: float, high: float, start: State) -> Plan | None:
    """One quintic to rest at `high`, of a time with which it is least over limits; None if that is far.

    Under constant jerk, as on the last bit, rest is 2/3 v^2 / |a| ahead.
    """
    if not LAST_BIT[0] < (high - low) * -start.acceleration / start.feed**2 < LAST_BIT[1]:
        return None
    ends = np.array([low, high]), np.array([start.feed, 0.0]), np.array([start.acceleration]), np.array([0.0])
    spans = (high - low) / start.feed * np.linspace(1.0, SLOWEST, TRIED)
    best = None
    for _ in range(PASSES):
        tried = [MotionPieces(t[None], quintics(*ends, t[None])) for t in spans]
        over = [float(np.max(worst_shares(conditions, each, high)[0])) for each in tried]
        k = int(np.argmin(over))
        best = Plan(tried[k], 0.0, over[k])
        spans = np.linspace(spans[max(k - 1, 0)], spans[min(k + 1, TRIED - 1)], TRIED)
    return best if best is not None and best.over <= BRIDGING else None


def _on_a_line(line: _Line, high: float, start: State, stop: State, near: float) -> list[Opening] | None:
    """Find openings on a straight line: the acceleration released at once, or behind a brake.

    Parameters
    ----------
    line : _Line
        The line.
    high : float
        Where the stretch ends, mm.
    start, stop : State
        How the motion is at both ends.
    near : float
        What a place may round by, mm.

    Returns
    -------
    list of Opening or None
        None if the line is too short for both.
    """
    v, a, whole, found = start.feed, start.acceleration, line.end == high, []
    most, room = (line.jerk, line.feed - v) if a > 0.0 else (line.jerk_down, v)
    least = 0.5 * a * a / max(room, SAME * v)  # the jerk that takes it away just when the feed is at its limit, or 0
    if least > most * (1.0 + OVER):
        way = 2.0 * max(line.feed, v) * room / abs(a)
        return None if line.low + way < line.end else []
    jerk = least if least > most * (1.0 - ALMOST) else most
    if jerk > 0.0:
        opening, place, feed = _phases(line.low, v, [(a, -jerk if a > 0.0 else jerk, abs(a) / jerk)])
        feed = 0.0 if feed < ALMOST * v else feed
        rest = line.profile(place, feed, stop.feed, max(line.feed, feed)) if whole else None
        if rest is not None:
            found.append(Opening(joined([opening, rest]), high, stop))
        if len(opening) and place < line.end:
            found.append(Opening(opening, place, State(feed)))
    if whole and a <= 0.0 and v >= stop.feed:
        braked = _braked(line, v, -a, stop, near)
        return None if braked is None else found + braked
    return found


def _braked(line: _Line, v: float, a: float, stop: State, near: float) -> list[Opening] | None:
    """Slowing down further, from v and deceleration a, to the fastest feed from which the end is in reach; to there.

    None if there is no room even for the shortest brake.
    """
    down, jerk = line.down * (1.0 + OVER), line.jerk_down * (1.0 + OVER)

    def brake(feed: float) -> tuple[MotionPieces, float]:
        """To a feed without acceleration, and where that is."""
        most = min(down, max(a, (jerk * (v - feed) + 0.5 * a * a) ** 0.5))
        hold = max((v - feed - (most * most - 0.5 * a * a) / jerk) / most, 0.0) if most > 0.0 else 0.0
        phases = [(-a, -jerk, (most - a) / jerk), (-most, 0.0, hold), (-most, jerk, most / jerk)]
        found, place, _ = _phases(line.low, v, phases)
        return found, place

    def needed(feed: float) -> float:
        return 0.5 * (feed + stop.feed) * float(ramp(feed - stop.feed, down, jerk)[0])

    least, most = stop.feed, v - 0.5 * a * a / jerk
    if most < least:
        return []
    if brake(least)[1] > line.end + near:
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (least + most)
        if brake(middle)[1] + needed(middle) * (1.0 + OVER) + near <= line.end:
            least = middle
        else:
            most = middle
    found, place = brake(least)
    if place > line.end - near:
        return [Opening(found, line.end, stop)]
    rest = replace(line, down=down, jerk_down=jerk).profile(
        place, least, stop.feed, least if least > 0.0 else line.feed
    )
    return [] if rest is None else [Opening(joined([found, rest]), line.end, stop)]


def _phases(low: float, v: float, phases: list[tuple[float, float, float]]) -> tuple[MotionPieces, float, float]:
    """Phases from a place and feed, each an acceleration to begin with, a jerk and a time; place and feed at last."""
    spans, rows = [], []
    for a, j, t in phases:
        if t > 0.0:
            spans.append(t)
            rows.append([low, v, 0.5 * a, j / 6.0, 0.0, 0.0])
            low += (v + (0.5 * a + j * t / 6.0) * t) * t
            v += (a + 0.5 * j * t) * t
    return MotionPieces(np.array(spans), np.array(rows).reshape(-1, LAW_COEFFICIENTS)), low, v


def _near(conditions: Conditions, low: float, high: float) -> float:
    """What a place may round by, mm."""
    return SAME * conditions.track.length + ALMOST * (high - low)
