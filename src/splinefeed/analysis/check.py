"""Check: whether setpoints lie on their path, cover it and hold every limit, by their definitions alone."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from splinefeed.analysis.check_bounds import TOLERANCE, Bounds
from splinefeed.analysis.check_setpoints import Judge
from splinefeed.analysis.check_verdict import verdict_of
from splinefeed.errors import InputError, expect
from splinefeed.geometry.parts import joined
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Limits, Setpoints, TimeLaw, Verdict, number, refuse_orientation

#: Ticks that are processed together: what bounds the memory.
BLOCK = 32768


def check(
    setpoints: Setpoints | Iterable[Setpoints],
    path: Path | JointPath,
    limits: Limits,
    *,
    law: TimeLaw | None = None,
    tolerance: float = TOLERANCE,
    resolution: float = 0.0,
) -> Verdict:
    """Check that setpoints, whole or in chunks, lie on `path`, cover it, keep their period, and hold every limit.

    A limit holds if worst <= limit (1 + 1e-9) + floor at every place. Of a difference the floor is what the rounding of
    its own setpoints makes of it: up to 2^k r / T^k at order k,

        r = eps max(length of the path, |u| |C'(u)|)             along the path
        r = |dx/ds| that + eps X + resolution / 2                on an axis, X as large as the numbers x is made of

    What the limits bound is measured as k! times the divided difference of the setpoints: a mean of the derivative over
    k periods, and so never above a bound that the derivative holds. Before a start and behind an end at rest the
    setpoints count as at rest. With `law` the exact derivatives of r(s(t)) are held to the limits, too.

    tolerance   mm (rotary axes rad) that a setpoint may be off the curve, and an end off the path's end
    resolution  step of the last digit of the positions, mm or rad, if they come from a text with few digits
    At a corner that is passed in motion under axis_velocity_step, the step of each axis' velocity counts, and the
    differences of axes that straddle it do not.
    Of soft limits (travel) limit and worst value are distances from the middle of the travel.

    On a JointPath the setpoints are joints: tip and tool axis come from them by the forward kinematics, the chord error
    is that of the tip while joints move straight, and only differences count, not the law; see `check_tool`.

    Where u is NaN throughout, as in a file of another program, setpoints are placed on the path by nearest points.
    A fault in the setpoints is a problem of the verdict, not an error. Raises InputError for setpoints of other axes
    than the path's, for no setpoints, and for an invalid tolerance; LimitsError for limits of axes that it lacks.
    Setpoints hold (n, axes) positions, mm, rotary axes rad. Source: docs/check.md has the derivations.
    Example: `sf.check(setpoints, path, limits, law=law).problems`
    """
    expect(
        "check(setpoints, path, limits)",
        (setpoints, (Setpoints, Iterable)),
        (path, (Path, JointPath)),
        (limits, Limits),
    )
    slack = number(tolerance, "tolerance"), number(resolution, "resolution")
    if min(slack) < 0.0:
        raise InputError(f"tolerance {slack[0]:g} and resolution {slack[1]:g} must not be negative")
    if isinstance(path, Path):
        refuse_orientation(limits, path.name)
    judged = Check(limits, *slack, law=law)
    judged.part(path)
    for chunk in [setpoints] if isinstance(setpoints, Setpoints) else setpoints:
        judged.see(chunk)
    return judged.verdict()


class Blocks:
    """Setpoints that come in pieces, in records of `size` ticks; `held` is what follows the last one."""

    def __init__(self, size: int) -> None:
        self._size, self._count = size, 0
        self._pieces: list[Setpoints] = []

    def push(self, setpoints: Setpoints) -> Iterator[Setpoints]:
        """Whole records by now, of which the last tick of all that came is never one."""
        self._pieces.append(setpoints)
        self._count += len(setpoints)
        while self._count > self._size:
            yield self.held.part(0, self._size)
            self._pieces, self._count = [self.held.part(self._size, self._count)], self._count - self._size

    @property
    def held(self) -> Setpoints:
        """The ticks that are not yet in a record."""
        if len(self._pieces) > 1:
            self._pieces = [Setpoints.joined(self._pieces)]
        return self._pieces[0]

    def __len__(self) -> int:
        return self._count


@dataclass(eq=False)
class Check:
    """Checks setpoints chunk by chunk along a path that comes part by part; `check` is one of a path in one part.

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
        self._joints: JointPath | None = None
        self._axes: tuple[str, ...] = ()
        self._first_curve = 0  # of the parts, among all
        self._known = 0  # curves of the parts behind that
        self._judge: Judge | None = None
        self._first: Setpoints | None = None
        self._blocks = Blocks(BLOCK)

    def part(self, path: Path | JointPath) -> None:
        """The next part of the path; a JointPath comes whole."""
        self._axes = path.axes
        if isinstance(path, JointPath):
            self._joints, path = path, path.tool
        self._coming.append(path)

    def see(self, setpoints: Setpoints) -> None:
        """The next setpoints; however they are cut, blocks of BLOCK ticks are looked at, and the last tick alone."""
        if not isinstance(setpoints, Setpoints):
            raise InputError(f"check: expected Setpoints or chunks of them, got {type(setpoints).__name__}")
        first = self._first = self._first or setpoints
        if setpoints.axes != self._axes:
            raise InputError(f"the setpoints have axes {setpoints.axes}, the path {self._axes}; they must be the same")
        if setpoints.period != number(first.period, "period") or not setpoints.period > 0.0:
            raise InputError(f"a chunk has a period of {setpoints.period:g} s, the first one {first.period:g} s")
        for block in self._blocks.push(setpoints):
            self._look(block, last=False)

    def verdict(self) -> Verdict:
        """The result; InputError for no setpoints."""
        if self._first is None or not len(self._blocks):
            raise InputError("there are no setpoints to check")
        held, count = self._blocks.held, len(self._blocks)
        if count > 1:
            self._look(held.part(0, count - 1), last=False)
        self._look(held.part(count - 1, count), last=True)
        assert self._judge is not None
        self._judge.end()
        return verdict_of(self._judge, self._first, self._first_curve + self._known)

    def _look(self, setpoints: Setpoints, last: bool) -> None:
        self._reach(max(int(setpoints.curve[-1]), 0), everything=last)  # -1 where nothing says the curve
        local = replace(setpoints, curve=setpoints.curve - self._first_curve)
        if self._judge is None:
            self._judge = Judge(self._bounds(), local, self.law)
        self._judge.see(local, last)

    def _reach(self, curve: int, everything: bool) -> None:
        """Have the judge know of all parts up to that curve, and forget those that it has left."""
        come = []
        while self._coming and (everything or curve >= self._first_curve + self._known):
            come.append(self._coming.popleft())
            self._known += len(come[-1].curves)
        if not come:
            return
        left = 0
        while self._judge is not None and len(self._parts) > 1:
            if self._judge.curve < left + len(self._parts[0].curves):
                break
            left += len(self._parts.popleft().curves)
        self._parts.extend(come)
        self._first_curve, self._known = self._first_curve + left, self._known - left
        if self._judge is not None:
            self._judge.move_on(self._bounds(), left)

    def _bounds(self) -> Bounds:
        return Bounds(joined(self._parts), self.limits, self.tolerance, self.resolution, self._joints)
