"""The check of a motion along a path that comes in parts: the same judge, moved on from part to part."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.analysis.check import BLOCK, TOLERANCE, Whole, verdict_of
from splinefeed.analysis.check_bounds import Bounds
from splinefeed.analysis.check_setpoints import Judge
from splinefeed.errors import InputError
from splinefeed.geometry.parts import joined
from splinefeed.geometry.path import Path
from splinefeed.records import Limits, Setpoints, Verdict


@dataclass(eq=False)
class CheckInParts:
    """Sees a path part by part and its setpoints chunk by chunk, and judges them as `check` does, without their law.

    `part` tells it of the next part of the path, `see` of the next setpoints, whose `curve` counts from the first part
    on, and which may not be further than the parts that it knows; `verdict` ends it. Parts that the motion has left are
    forgotten. What the whole path has at a joint (corners, stops, waits) is found between parts as within them.
    """

    limits: Limits
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        self._parts: deque[Path] = deque()  # those that the judge knows
        self._coming: deque[Path] = deque()
        self._first_curve = 0  # of the parts, among all
        self._known = 0  # curves of the parts behind that
        self._gone = 0.0  # length of the parts before, mm
        self._judge: _Rolling | None = None
        self._first: Setpoints | None = None
        self._held: Setpoints | None = None
        self._turning: list[float] = []  # where the curves begin on which rotary axes move alone, mm

    def part(self, path: Path) -> None:
        """The next part of the path."""
        self._coming.append(path)

    def see(self, points: Setpoints) -> None:
        """The next setpoints."""
        self._first = self._first or points
        for start in range(0, len(points), BLOCK):
            if self._held is not None:
                self._look(self._held, last=False)
            self._held = points.part(start, min(start + BLOCK, len(points)))

    def verdict(self) -> Verdict:
        """What came of it; InputError for no setpoints."""
        held = self._held
        if held is None or self._first is None:
            raise InputError("there are no setpoints to check")
        if len(held) > 1:
            self._look(held.part(0, len(held) - 1), last=False)
        self._look(held.part(len(held) - 1, len(held)), last=True)
        judge = self._judge
        assert judge is not None
        self._count_turning()
        length = self._gone + judge.bounds.path.length
        judge.shift(self._gone)
        return verdict_of(
            judge, self._first, None, Whole(length, self._first_curve + self._known, np.array(self._turning))
        )

    def _look(self, points: Setpoints, last: bool) -> None:
        self._reach(int(points.curve[-1]), everything=last)
        judge = self._judge
        local = replace(points, curve=points.curve - self._first_curve)
        if judge is None:
            judge = self._judge = _Rolling(self._bounds(), local, None)
        judge.see(local, last)

    def _reach(self, curve: int, everything: bool) -> None:
        """Have the judge know of all parts up to that curve, and forget those that it has left."""
        come = []
        while self._coming and (everything or curve >= self._first_curve + self._known):
            come.append(self._coming.popleft())
            self._known += len(come[-1].curves)
        if not come:
            return
        judge, left = self._judge, 0
        if judge is not None:
            self._count_turning()
            while len(self._parts) > 1 and judge.curve >= left + len(self._parts[0].curves):
                left += len(self._parts.popleft().curves)
        self._parts.extend(come)
        self._first_curve, self._known = self._first_curve + left, self._known - left
        if judge is not None:
            self._gone += judge.move_on(self._bounds(), left)

    def _count_turning(self) -> None:
        """Take note of the curves among the parts that are known on which rotary axes move alone."""
        judge = self._judge
        assert judge is not None
        places = judge.bounds.turning
        self._turning += (places[places >= judge.seen] + self._gone).tolist()
        judge.seen = judge.bounds.path.length

    def _bounds(self) -> Bounds:
        return Bounds(joined(self._parts), self.limits, self.tolerance, 0.0)


class _Rolling(Judge):
    """A judge whose path changes under way: `curve` is that of the last tick, `seen` how far of the path is known."""

    seen = 0.0

    @property
    def curve(self) -> int:
        """The curve on which the last tick lies."""
        assert self._place is not None
        return int(np.searchsorted(self.bounds.path.curve_rows[:, 0], self._place.row[0], side="right")) - 1

    def move_on(self, bounds: Bounds, left: int) -> float:
        """Go on with a path that lacks the first `left` curves and goes on further; the length that is lacking, mm."""
        assert self._place is not None
        path, start = self.bounds.path, self._follower
        gone, row = float(path.curve_starts[left]), int(path.curve_rows[left, 0])
        self._know(bounds)
        self._follower.go_on(start, gone)
        self._place = replace(self._place, row=self._place.row - row)
        self.seen -= gone
        self.shift(-gone)
        return gone

    def shift(self, by: float) -> None:
        """Count arc length from elsewhere, mm."""
        if self._place is not None:
            self._place = replace(self._place, s=self._place.s + by)
        self._step_places[1:] += by
        for worst in self.worst.values():
            worst.s += by
        for fault in self.faults.values():
            fault.s += by
