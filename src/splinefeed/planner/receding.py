"""A stretch by horizons: each is planned to rest, its first part becomes final, and the next begins in that state."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.conditions import Conditions
from splinefeed.planner.constants import BISECTIONS, HOPELESS, KEPT, TOGETHER
from splinefeed.planner.grid import Samples, counted
from splinefeed.planner.horizon import GUESS, Plan, SolverSettings, plan_window
from splinefeed.planner.law import MotionPieces, joined
from splinefeed.planner.openings import plan_from
from splinefeed.planner.profiles import pieces
from splinefeed.planner.straight import straights
from splinefeed.records import REST, Array, Limits, State
from splinefeed.telling import tell

#: What is left of a stretch joins a window if that holds no more than so many times its cells then.
JOINS = 1.25
#: Share of what is left of the last plan that stays open where no new one is found: it soon slows down to rest.
HELD_BACK = 0.5


class OutOfReachError(PlanError):
    """From where it is the motion cannot keep the limits."""


@dataclass(eq=False)
class RecedingHorizon:
    """Where the motion has come to, its state there, and the rest of the last plan, which ends at rest.

    Parameters
    ----------
    low : float
        Where the motion has come to, mm.
    state : State, optional
        How it moves there.
    left : MotionPieces, optional
        The rest of the last plan.
    end : float, optional
        Where that ends, mm.
    work : int, optional
        Cells that were planned so far.
    ahead : float, optional
        Share of a window that is known ahead.
    samples : Samples, optional
        By which `reach` found it.
    limits : Limits, optional
        Those that the last plan keeps.
    lines : dict of float to MotionPieces, optional
        Plans of straight lines from rest to rest, by where they begin.
    """

    low: float
    state: State = REST
    left: MotionPieces | None = None
    end: float = 0.0
    work: int = 0
    ahead: float = 0.0
    samples: Samples | None = None
    limits: Limits | None = None
    lines: dict[float, MotionPieces | None] | None = None

    def straight(self, conditions: Conditions, marks: Array) -> MotionPieces | None:
        """Plan the exact profile to the next stop, if the motion is at rest and the line to there straight.

        Parameters
        ----------
        conditions : Conditions
            What the motion must keep.
        marks : (m,) array
            Where it is, mm, and the stops ahead: what is found of TOGETHER of them is kept.

        Returns
        -------
        MotionPieces or None
            None where it is not straight.
        """
        if self.state.feed > 0.0 or len(marks) < 2:
            return None
        if self.lines is None or self.low not in self.lines:
            marks = marks[: TOGETHER + 1]
            exact, found = straights(conditions, marks)
            begin, end = marks[:-1][exact], marks[1:][exact]
            motions = zip(begin.tolist(), found.durations.T, pieces(found, begin, end), strict=True)
            self.lines = dict.fromkeys(marks[:-1].tolist())
            self.lines |= {s: MotionPieces(t[t > 0.0], c[t > 0.0]) for s, t, c in motions}
        line = self.lines[self.low]
        if line is None:
            return None
        self.limits = conditions.limits
        return self._take(line, len(line), float(marks[1]), REST)

    def advance(
        self,
        conditions: Conditions,
        mode: SolverSettings,
        near: float,
        stop: State,
        *,
        ends_here: bool,
    ) -> MotionPieces:
        """Plan the next final motion; where no new plan keeps the limits, take the next part of the last one, to rest.

        Parameters
        ----------
        conditions : Conditions
            What the motion must keep.
        mode : SolverSettings
            How closely to plan.
        near : float
            Where the window ends, mm.
        stop : State
            How the motion is there.
        ends_here : bool
            Whether the motion ends there.

        Returns
        -------
        MotionPieces
            The motion.

        Raises
        ------
        OutOfReachError
            Where there is no plan: from the state the motion cannot keep the limits.
        """
        into = stop if ends_here else REST
        mode = replace(mode, yielding=not ends_here)
        plan = None
        try:
            with np.errstate(all="ignore"):  # what is not a number is not a motion to take
                if max(self.state.feed, into.feed) > 0.0:
                    plan = plan_from(conditions, self.low, near, self.state, into, mode, known=self.samples)
                else:
                    plan = plan_window(
                        conditions, self.low, near, self.state, into, mode, exact=True, known=self.samples
                    )
                self.work += len(plan.pieces)
        except PlanError:
            if self.left is None:
                raise
        if self.left is not None and (plan is None or plan.over > 1.0 + KEPT):
            return self._take(self.left, _final(len(self.left), HELD_BACK), self.end, REST)
        assert plan is not None
        moving = self.state.feed > 0.0 or (ends_here and stop.feed > 0.0)
        if not plan.over < HOPELESS and not moving:
            raise PlanError(
                f"{conditions.between(self.low, near)} no motion within the limits was found: the path bends or "
                "turns too sharply there; smooth it"
            )
        if plan.over > 1.0 + KEPT and moving:
            raise OutOfReachError(
                f"from {self.state.feed:g} mm/s at s = {self.low:.6g} mm the motion up to {near:.6g} mm is over a "
                f"limit by {100.0 * (plan.over - 1.0):.3g} %"
            )
        pieces = plan.pieces.stretched(plan.over**0.5 if plan.over > 1.0 + KEPT else 1.0)
        self.limits = conditions.limits
        if ends_here:
            return self._take(pieces, len(pieces), near, stop)
        return self._take(pieces, _final(len(pieces), mode.open), near, REST)

    def hold(self, conditions: Conditions, mode: SolverSettings, high: float) -> MotionPieces:
        """Motion to rest on the shortest way that the limits allow, no further than `high`, mm, if rest is there.

        Where no shorter way is found, it is the rest of the last plan.
        """
        self.left, self.end = self._shortest(conditions, mode, high)
        return self._take(self.left, len(self.left), self.end, REST)

    def change(
        self, before: Conditions, conditions: Conditions, mode: SolverSettings, high: float
    ) -> MotionPieces | None:
        """Motion under the limits of before to where the new ones can be kept, if that is not at once.

        It ends at a feed that these allow, without acceleration, as soon as that can be, or at rest.
        """
        if self.state.feed == 0.0:
            return None
        near, low, state = self.reach(conditions, mode, high), self.low, self.state
        samples = self.samples
        if samples is None or self._found(conditions, mode, near) is not None:
            return None
        left, end = self._shortest(before, mode, high)
        for k in range(BISECTIONS):
            at = min(low + 2.0 * (end - low) * 0.5 ** (BISECTIONS - 1 - k), 0.5 * (low + near))
            into = State((GUESS * float(np.interp(at, samples.s, samples.q))) ** 0.5)
            bridge = self._found(before, mode, at, into)
            if bridge is None:
                continue
            self.low, self.state = at, into
            onwards = self._found(conditions, mode, near)
            if onwards is not None:
                self.left, self.end, self.limits = onwards, near, conditions.limits
                return bridge
            self.low, self.state = low, state
        return self._take(left, len(left), end, REST)

    def _found(
        self, conditions: Conditions, mode: SolverSettings, near: float, into: State = REST
    ) -> MotionPieces | None:
        """Motion to `near`, mm, if it keeps the limits."""
        with np.errstate(all="ignore"), suppress(PlanError):
            plan = plan_window(conditions, self.low, near, self.state, into, mode, exact=True)
            self.work += len(plan.pieces)
            return plan.pieces if plan.over <= 1.0 + KEPT else None
        return None

    def _shortest(self, conditions: Conditions, mode: SolverSettings, high: float) -> tuple[MotionPieces, float]:
        """The shortest way to rest, and where that is, mm: no further than the last plan or, without one, `high`."""
        least, most, best = self.low, high if self.left is None else self.end, self.left
        for _ in range(BISECTIONS):
            middle = 0.5 * (least + most)
            found = self._found(conditions, mode, middle)
            least, most, best = (middle, most, best) if found is None else (least, middle, found)
        if best is None:
            raise OutOfReachError(f"from {self.state} at s = {self.low:.6g} mm no stop within the limits was found")
        return best, most

    def reach(self, conditions: Conditions, mode: SolverSettings, high: float) -> float:
        """Where a window of about `mode.cells` cells ends, mm: `high` if there is no more."""
        near, self.ahead, self.samples = counted(conditions, self.low, high, mode.cell, mode.cells, JOINS)
        return near

    def move(self, origin: float) -> None:
        """Count arc length from a new origin, mm."""
        self.samples = None
        self.low, self.end = self.low - origin, self.end - origin
        if self.left is not None:
            coefficients = self.left.coefficients.copy()
            coefficients[:, 0] -= origin
            self.left = MotionPieces(self.left.spans, coefficients)

    def _take(self, pieces: MotionPieces, count: int, end: float, stop: State) -> MotionPieces:
        """Make the first pieces final."""
        taken, self.left, self.end = pieces.part(0, count), pieces.part(count, len(pieces)), end
        if len(self.left):
            self.low, feed, half = self.left.coefficients[0, :3].tolist()
            self.state = State(feed, 2.0 * half)
        else:
            self.low, self.state, self.left = end, stop, None
        return taken


def _final(count: int, share: float) -> int:
    """How many of so many pieces become final, where a share does not."""
    return max(count - int(share * count), 1)


def plan_stretch(
    conditions: Conditions, low: float, high: float, start: State, stop: State, mode: SolverSettings
) -> Plan:
    """Plan the motion between two ends, at rest or in motion, by as many horizons as it takes.

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

    Returns
    -------
    Plan
        The motion.
    """
    horizon = RecedingHorizon(low, State(start.feed, start.acceleration))
    if horizon.reach(conditions, mode, high) == high:
        if max(start.feed, stop.feed) > 0.0:
            return plan_from(conditions, low, high, horizon.state, stop, mode, known=horizon.samples)
        return plan_window(conditions, low, high, start, stop, mode, known=horizon.samples)
    mode = replace(mode, bounded=False)  # bounds of horizons do not add up to one
    parts = []
    while horizon.low < high:
        near = horizon.reach(conditions, mode, high)
        parts.append(horizon.advance(conditions, mode, near, stop, ends_here=near == high))
        tell("planning", horizon.low, conditions.track.length)
    return Plan(joined(parts), 0.0, 1.0)
