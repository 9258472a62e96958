"""Check: whether setpoints lie on their path, cover it and hold every limit, by their definitions alone."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from splinefeed.checks.axes import check_whole
from splinefeed.checks.bounds import TOLERANCE, Bounds, Fault
from splinefeed.checks.by_tick import ByTick
from splinefeed.checks.law import check_law
from splinefeed.checks.setpoints import Judge
from splinefeed.errors import InputError, expect
from splinefeed.paths.parts import cut, joined
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import (
    LimitResult,
    Limits,
    Setpoints,
    State,
    TimeLaw,
    Verdict,
    axes_without_limits,
    number,
    shown_by,
    unit_along,
    unit_of,
)

#: Ticks that are processed together: what bounds the memory.
BLOCK = 16384
#: Sentence of each kind of fault of single setpoints, before its place.
_SENTENCES = {
    "off the curve": "off the curve by {amount:.6g} {unit}",
    "turned off": "a rotary axis is {degrees:.6g} deg from where the curve has it",
    "off the track": "an axis is {amount:.6g} mm or rad from where the track has it",
    "tilted": "the tool axis is off its path by {degrees:.6g} deg",
    "misplaced": "on the curve, but {amount:.6g} {unit} from the place of its u",
    "period": "is {amount:.6g} s early or late: the period is not kept",
    "back": "goes back by {amount:.6g} {unit} along the path",
    "skipped": "a part of the path is skipped: one step of {amount:.6g} {unit}",
    "twice": "the same point twice in the middle of the motion",
    "start": "the first setpoint is {detail} from the start of the motion",
    "end": "the last setpoint is {detail} from the end of the path: it is not reached",
}


def check(
    setpoints: Setpoints | Iterable[Setpoints],
    path: Track,
    limits: Limits,
    *,
    law: TimeLaw | None = None,
    start: State | None = None,
    tolerance: float = TOLERANCE,
    resolution: float = 0.0,
) -> Verdict:
    """Check that setpoints lie on a path, cover it, keep their period, and hold every limit.

    Parameters
    ----------
    setpoints : Setpoints or iterable of Setpoints
        Positions (n, axes), mm, rotary axes rad, whole or in chunks.
    path : Track
        What they should follow: a Path, ToolPath or JointPath, or a Track of one's own.
    limits : Limits
        What they must keep.
    law : TimeLaw, optional
        The law that they were made from; the exact derivatives of r(s(t)) are then held to the limits, too.
    start : State, optional
        Where on the path the motion begins, and how, as `plan` takes it; without it, as the law or else the setpoints
        say in their settings, which the verdict notes, or where the path does.
    tolerance : float, optional
        How far a setpoint may be off the curve, and an end off the path's end, mm (rotary axes rad).
    resolution : float, optional
        Step of the last digit of the positions, mm or rad, if they come from a text with few digits.

    Returns
    -------
    Verdict
        Worst value of each limit, and problems. A fault in the setpoints is a problem, not an error.

    Raises
    ------
    InputError
        For setpoints of other axes than the path's, for no setpoints, and for an invalid tolerance.
    LimitsError
        For limits of axes that the path lacks.

    Notes
    -----
    A limit holds if worst <= limit (1 + 1e-6) + floor at every place. Of a difference the floor is what the rounding of
    its own setpoints makes of it: up to 2^k r / T^k at order k,

        r = eps max(length of the path, |u| |C'(u)|) + eps t v   along the path, at time t and feed v
        r = |dx/ds| that + eps X + resolution / 2                on an axis, X as large as the numbers x is made of

    What the limits bound is measured as k! times the divided difference of the setpoints: a mean of the derivative over
    k periods, and so never above a bound that the derivative holds. Before a start and behind an end at rest the
    setpoints count as at rest.

    At a corner that is passed in motion under axis_velocity_step, the step of each axis' velocity counts, and the
    differences of axes that straddle it do not. Of soft limits (travel) limit and worst value are distances from the
    middle of the travel.

    On a JointPath the setpoints are joints: tip and tool axis come from them by the forward kinematics, the chord error
    is that of the tip while joints move straight.

    On a Track of one's own axes are compared with its positions where u is on the path of its tip, and chord errors are
    those that it says. On any track whose axes do not carry the tip, joints too, a law is held to the limits of the
    axes by derivatives that the check makes from positions alone. Where what the track says of its derivatives, by
    which it is planned, differs from these, that is a problem; a note says how near they are.

    Where u is NaN throughout, as in a file of another program, setpoints are placed on the path by nearest points.

    References
    ----------
    .. [1] docs/check.md has the derivations.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> limits = sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> setpoints = sf.interpolate(path, sf.plan(path, limits, period=1e-3))
    >>> verdict = sf.check(setpoints, path, limits)
    >>> verdict.ok, verdict.problems
    (True, ())
    """
    expect(
        "check(setpoints, path, limits)",
        (setpoints, (Setpoints, Iterable)),
        (path, (Path, Track)),
        (limits, Limits),
    )
    slack = number(tolerance, "tolerance"), number(resolution, "resolution")
    if min(slack) < 0.0:
        raise InputError(f"tolerance {slack[0]:g} and resolution {slack[1]:g} must not be negative")
    path.check_limits(limits)
    judged = Check(limits, *slack, law=law, start=start)
    judged.part(path)
    for chunk in [setpoints] if isinstance(setpoints, Setpoints) else setpoints:
        judged.see(chunk)
    return judged.verdict()


class TickBlocks:
    """Collect setpoints that come in pieces into records; `held` is what follows the last one.

    Parameters
    ----------
    size : int
        Ticks of a record.
    """

    def __init__(self, size: int) -> None:
        self._size, self._count = size, 0
        self._pieces: list[Setpoints] = []

    def push(self, setpoints: Setpoints) -> Iterator[Setpoints]:
        """Take more setpoints.

        Parameters
        ----------
        setpoints : Setpoints
            Those that follow.

        Yields
        ------
        Setpoints
            Whole records by now, of which the last tick of all that came is never one.
        """
        self._pieces.append(setpoints)
        self._count += len(setpoints)
        while self._count > self._size:
            yield self.held.part(0, self._size)
            self._pieces, self._count = [self.held.part(self._size, self._count)], self._count - self._size

    def cut(self, pieces: Iterable[Setpoints]) -> Iterator[Setpoints]:
        """Cut pieces into records.

        Parameters
        ----------
        pieces : iterable of Setpoints
            At least one.

        Yields
        ------
        Setpoints
            Records; the last one has the rest.
        """
        for piece in pieces:
            yield from self.push(piece)
        yield self.held

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
    """Check setpoints chunk by chunk along a path that comes part by part; `check` is one of a path in one part.

    Parameters
    ----------
    limits : Limits
        What they must keep.
    tolerance, resolution : float, optional
        mm or rad, as `check` takes them.
    law : TimeLaw, optional
        The law that they were made from.
    start : State, optional
        Where on the path the motion begins, and how.

    Notes
    -----
    `part` gives the next part of the path, `see` the next setpoints, whose `curve` counts from the first part on, and
    which may not be further than the parts that it knows; `verdict` ends it. Curves that the motion has left are
    dropped. What the whole path has at a joint (corners, stops, waits) is found between parts as within them.
    """

    limits: Limits
    tolerance: float = TOLERANCE
    resolution: float = 0.0
    law: TimeLaw | None = None
    start: State | None = None
    by_tick: ByTick | None = None  # gets what is measured at each tick

    def __post_init__(self) -> None:
        self._coming: deque[Path] = deque()  # parts that the judge does not know yet
        self._track: Track | None = None  # whose axes do not carry the tip
        self._bounds: Bounds | None = None  # the last ones
        self._axes: tuple[str, ...] = ()
        self._first_curve = 0  # that the judge knows, among those of all parts
        self._judge: Judge | None = None
        self._first: Setpoints | None = None
        self._said: State | None = None  # how the motion begins, where it says so itself
        self._blocks = TickBlocks(BLOCK)

    def part(self, path: Track) -> None:
        """Take the next part of the path.

        Parameters
        ----------
        path : Track
            One whose axes do not carry the tip comes whole.
        """
        self._axes = path.axes
        if not path.carries_tip:
            check_whole(path, self.limits)
            self._track = path
        self._coming.append(path.tip_path)

    def bounds(self, path: Path) -> Bounds:
        """The limits on a path of the tip, made once while it stays."""
        if self._bounds is None or self._bounds.path is not path:
            self._bounds = Bounds(path, self.limits, self.tolerance, self.resolution, self._track)
        return self._bounds

    def see(self, setpoints: Setpoints) -> None:
        """Take the next setpoints; however they are cut, blocks of BLOCK ticks are looked at, and the last tick alone.

        Parameters
        ----------
        setpoints : Setpoints
            Those that follow.
        """
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
        made = verdict_of(self._judge, self._first, self._first_curve + len(self._judge.bounds.path.curves))
        return made if self._said is None else replace(made, notes=(*made.notes, _begins(self._said, made.along)))

    def _look(self, setpoints: Setpoints, last: bool) -> None:
        """Judge setpoints along all parts up to their curves; curves that are left are forgotten, but for the last."""
        judge, left, come = self._judge, 0, []
        known = self._first_curve + (0 if judge is None else len(judge.bounds.path.curves))
        while self._coming and (last or max(setpoints.curve[-1], 0) >= known):  # -1 where nothing says the curve
            come.append(self._coming.popleft())
            known += len(come[-1].curves)
        if come and judge is not None:
            path, left = judge.bounds.path, max(judge.curve - 1, 0)
            come.insert(0, cut(path, left, len(path.curves)) if left else path)
        self._first_curve += left
        local = replace(setpoints, curve=setpoints.curve - self._first_curve)
        if come:
            bounds = self.bounds(joined(come))
            if judge is None:
                if self.start is None:
                    self._said = State.said((setpoints if self.law is None else self.law).settings)
                judge = self._judge = Judge(bounds, local, self.law, self.start or self._said, self.by_tick)
            else:
                judge.move_on(bounds, left)
        assert judge is not None
        judge.see(local, last)


def verdict_of(judge: Judge, first: Setpoints, curves: int) -> Verdict:
    """The report of a check; first  some of the setpoints; curves  of the whole path."""
    law, own = judge.law, judge.own
    unit = unit_along(judge.bounds.path.axes)
    problems = [_fault_sentence(kind, fault, unit) for kind, fault in judge.faults.items()]
    notes: list[str] = []
    if law is not None:
        faults, notes = check_law(law, judge.bounds, judge.worst, judge.period, judge.begins)
        problems += faults
        if abs(law.duration - judge.duration) > judge.period:
            problems.append(f"law: lasts {law.duration:.9g} s, the setpoints {judge.duration:.9g} s; is it their law?")
    results = {name: worst.result for name, worst in judge.worst.items() if worst.result.limit < math.inf}
    if judge.short is not None:
        notes.append(f"the last period is short, {judge.short:.9g} s; differences over it have a higher floor")
    if not judge.bounds.path.linear:
        notes.append("only rotary axes move: s is in degrees, and feed, acceleration and jerk along the path are too")
    elif judge.alone:
        notes.append(
            f"on {len(judge.alone)} of {curves} curves, the first from s = "
            f"{judge.alone[0]:.6g} mm, rotary axes move alone: there 1 mm along the path stands for 1 degree, "
            "in s and in its feed, acceleration and jerk"
        )
    if not judge.placed:
        notes.append("the setpoints have no u: each is placed at the nearest point of the path, one after the other")
    notes += axes_without_limits(judge.bounds.limits, judge.bounds.axes, judge.least, judge.greatest)
    problems += [_limit_sentence(name, result, unit) for name, result in results.items() if not result.holds]
    numbers = {
        "duration_s": judge.duration,
        "length_mm": judge.gone + judge.rows.tip.length,
        "ticks": judge.ticks,
        "period_s": judge.period,
        "method": first.method,
        "strategy": first.settings.get("strategy") if law is None else law.strategy,
        "start_error_mm": judge.start_error,
        "end_error_mm": judge.end_error,
        "end_reached": "end" not in judge.faults,
        "off_curve_max_mm": judge.off_path,
        "tolerance_mm": judge.allowed,
        "rounding_scale_mm": judge.scale,
    }
    if law is not None:
        numbers |= {"ripple_max": judge.ripple, "law_drift_max_mm": judge.drift}
    if own is not None:
        numbers |= {
            "chord_error_max_mm": own.chord_error,
            "off_axis_max_rad": own.off_axis,
            "axis_error_between_max_rad": own.turned,
        }
    return Verdict(limits=results, problems=tuple(problems), notes=tuple(notes), numbers=numbers, along=unit)


def _begins(said: State, unit: str) -> str:
    """The note of a motion that says itself how it begins, which the check takes from it."""
    return (
        f"the motion begins at s = {said.s:.6g} {unit}, with {said.feed:.6g} {unit}/s and {said.acceleration:.6g} "
        f"{unit}/s^2, as its settings say: what moved there before is not checked"
    )


def _fault_sentence(kind: str, fault: Fault, unit: str) -> str:
    if kind.startswith("finite "):
        text = fault.detail
    else:
        text = _SENTENCES[kind].format(
            amount=fault.amount, unit=unit, degrees=math.degrees(fault.amount), detail=fault.detail
        )
    more = f"; {fault.count} ticks in all, this is the worst" if fault.count > 1 else ""
    where = "" if math.isnan(fault.s) else f", s = {fault.s:.9g} {unit}"
    return f"tick {fault.tick} (t = {fault.t:.9g} s{where}): {text}{more}"


def _limit_sentence(name: str, result: LimitResult, along: str) -> str:
    unit, factor = unit_of(name, along), shown_by(name, result.axis)
    worst, limit = factor * result.worst, factor * result.limit
    source = "exact derivative of the law" if result.by == "law" else f"setpoints, floor {factor * result.floor:.3g}"
    return (
        f"{name}: {worst:.9g} {unit} is {100.0 * (result.share - 1.0):.3g} % over the limit of {limit:.9g} {unit} "
        f"at s = {result.at_s:.9g} {along}, t = {result.at_t:.9g} s ({source}; {result.over} places in all)"
    )
