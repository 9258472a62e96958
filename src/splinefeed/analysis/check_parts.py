"""The check of a motion along a path that comes in parts: the same check, moved on from part to part."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.analysis.check_bounds import TOLERANCE, Bounds
from splinefeed.analysis.check_setpoints import Judge
from splinefeed.analysis.check_verdict import Whole, verdict_of
from splinefeed.errors import InputError
from splinefeed.geometry.parts import joined
from splinefeed.geometry.path import Path
from splinefeed.records import Limits, Setpoints, TimeLaw, Verdict, number

#: Ticks that are processed together: what bounds the memory.
BLOCK = 32768


@dataclass(eq=False)
class CheckInParts:
    """Checks setpoints chunk by chunk along a path that comes part by part; `check` is one of a whole path.

    `part` gives the next part of the path, `see` the next setpoints, whose `curve` counts from the first part on, and
    which may not be further than the parts that it knows; `verdict` ends it. Parts that the motion has left are
    dropped. What the whole path has at a joint (corners, stops, waits) is found between parts as within them.
    """

    limits: Limits
    tolerance: float = TOLERANCE
    resolution: float = 0.0
    law: TimeLaw | None = None

    def __post_init__(self) -> None:
        self._parts: deque[Path] = deque()  # those that the judge knows
        self._coming: deque[Path] = deque()
        self._first_curve = 0  # of the parts, among all
        self._known = 0  # curves of the parts behind that
        self._gone = 0.0  # length of the parts before, mm
        self._judge: _Rolling | None = None
        self._first: Setpoints | None = None
        self._axes: tuple[str, ...] = ()
        self._held: list[Setpoints] = []  # ticks of the next block
        self._count = 0  # of them
        self._turning: list[float] = []  # where the curves begin on which rotary axes move alone, mm

    def part(self, path: Path) -> None:
        """The next part of the path."""
        self._coming.append(path)
        self._axes = path.axes

    def see(self, setpoints: Setpoints) -> None:
        """The next setpoints; however they are cut, blocks of BLOCK ticks are looked at, and the last tick alone."""
        if not isinstance(setpoints, Setpoints):
            raise InputError(f"check: expected Setpoints or chunks of them, got {type(setpoints).__name__}")
        first = self._first = self._first or setpoints
        if setpoints.axes != self._axes:
            raise InputError(f"the setpoints have axes {setpoints.axes}, the path {self._axes}; they must be the same")
        if setpoints.period != number(first.period, "period") or not setpoints.period > 0.0:
            raise InputError(f"a chunk has a period of {setpoints.period:g} s, the first one {first.period:g} s")
        start = 0
        while start < len(setpoints):
            if self._count == BLOCK:
                self._look(Setpoints.joined(self._held), last=False)
                self._held, self._count = [], 0
            part = setpoints.part(start, min(start + BLOCK - self._count, len(setpoints)))
            start, self._count = start + len(part), self._count + len(part)
            self._held.append(part)

    def verdict(self) -> Verdict:
        """The result; InputError for no setpoints."""
        if self._first is None or not self._held:
            raise InputError("there are no setpoints to check")
        held, count = Setpoints.joined(self._held), self._count
        if count > 1:
            self._look(held.part(0, count - 1), last=False)
        self._look(held.part(count - 1, count), last=True)
        judge = self._judge
        assert judge is not None
        self._count_turning()
        length = self._gone + judge.bounds.path.length
        judge.shift(self._gone)
        whole = Whole(length, self._first_curve + self._known, np.array(self._turning))
        return verdict_of(judge, self._first, self.law, whole)

    def _look(self, setpoints: Setpoints, last: bool) -> None:
        self._reach(max(int(setpoints.curve[-1]), 0), everything=last)  # -1 where nothing says the curve
        judge = self._judge
        local = replace(setpoints, curve=setpoints.curve - self._first_curve)
        if judge is None:
            judge = self._judge = _Rolling(self._bounds(), local, self.law)
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
        """Record the curves among the parts that are known on which rotary axes move alone."""
        judge = self._judge
        assert judge is not None
        places = judge.bounds.turning
        self._turning += (places[places >= judge.seen] + self._gone).tolist()
        judge.seen = judge.bounds.path.length

    def _bounds(self) -> Bounds:
        return Bounds(joined(self._parts), self.limits, self.tolerance, self.resolution)


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
