"""Check: whether setpoints lie on their path, cover it and hold every limit, judged by the definitions alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from splinefeed.analysis.check_bounds import Bounds, Fault
from splinefeed.analysis.check_law import check_law, worse
from splinefeed.analysis.check_setpoints import Judge
from splinefeed.analysis.check_tool import judge_tool
from splinefeed.errors import InputError, expect
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import (
    ANGLES,
    ROTARY_AXES,
    Array,
    LimitResult,
    Limits,
    Setpoints,
    TimeLaw,
    Verdict,
    number,
    refuse_orientation,
    unit_along,
)

#: How far a setpoint may be from the curve, and an end from the path's, mm (rotary axes rad), if nobody says else.
TOLERANCE = 1e-9
#: Ticks that are looked at together: what bounds the memory.
BLOCK = 32768
#: Sentence of each kind of fault of single setpoints, before its place.
_SENTENCES = {
    "off the curve": "off the curve by {amount:.6g} {unit}",
    "turned off": "a rotary axis is {degrees:.6g} deg from where the curve has it",
    "misplaced": "on the curve, but {amount:.6g} {unit} from where its own u says",
    "period": "comes {amount:.6g} s early or late: the period is not kept",
    "back": "goes back by {amount:.6g} {unit} along the path",
    "skipped": "a part of the path is skipped: one step of {amount:.6g} {unit}",
    "twice": "the same point twice in the middle of the motion",
    "start": "the first setpoint is {detail} from the start of the path",
    "end": "the last setpoint is {detail} from the end of the path: it is not reached",
}

#: A limit exceeded this many times is said as a multiple; an excess from PERCENT on in percent, below in ppm.
MANY, PERCENT = 10.0, 1e-3


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

    What the limits bound is measured as k! times the divided difference of the setpoints: a mean of the derivative
    over k periods, and so never above a bound that the derivative holds. Before a start and behind an end at rest the
    setpoints are taken to stand still. With `law` the exact derivatives of r(s(t)) are held to the limits, too.

    tolerance   mm (rotary axes rad) that a setpoint may be off the curve, and an end off the path's
    resolution  step of the last digit of the positions, mm or rad, if they come from a text with few digits
    At a corner that is passed in motion under axis_velocity_step, the step of each axis' velocity counts, and the
    differences of axes that straddle it do not.
    Of soft limits (travel) limit and worst value are distances from the middle of the travel.

    On a JointPath the setpoints are joints: tip and tool axis come from them by the forward kinematics, the chord error
    is that of the tip while joints move straight, and only differences count, not the law; see `check_tool`.

    Where u is NaN throughout, as in a file of another program, setpoints are placed on the path by nearest points.
    A fault in the setpoints is no error but a problem of the verdict. Raises InputError for setpoints of other axes
    than the path's, for none at all, and for a tolerance that cannot be; LimitsError for limits of axes that it lacks.
    Setpoints hold (n, axes) positions, mm, rotary axes rad. Source: docs/check.md has the derivations.
    Example: `sf.check(setpoints, path, limits, law=law).problems`
    """
    expect(
        "check(setpoints, path, limits)",
        (setpoints, (Setpoints, Iterable)),
        (path, (Path, JointPath)),
        (limits, Limits),
    )
    limits = limits.for_axes(path.axes)
    slack = number(tolerance, "tolerance"), number(resolution, "resolution")
    if min(slack) < 0.0:
        raise InputError(f"tolerance {slack[0]:g} and resolution {slack[1]:g} must not be negative")
    if isinstance(path, JointPath):
        return _of_tool(setpoints, path, limits, law, slack[0])
    refuse_orientation(limits, path.name)
    bounds = Bounds(path, limits, *slack)
    judge: Judge | None = None
    first: Setpoints | None = None
    for block, last in _blocks(setpoints, path):
        if judge is None:
            first = block
            judge = Judge(bounds, block, law)
        judge.see(block, last)
    if judge is None or first is None:
        raise InputError("there are no setpoints to check")
    return verdict_of(judge, first, law, Whole.of(judge.bounds))


def _of_tool(
    points: Setpoints | Iterable[Setpoints], path: JointPath, limits: Limits, law: TimeLaw | None, tolerance: float
) -> Verdict:
    """The verdict on joints of a tool path."""
    whole = points if isinstance(points, Setpoints) else Setpoints.joined(list(points))
    judged = judge_tool(whole, path, limits, law, tolerance)
    over = [_limit_sentence(name, each, "mm") for name, each in judged.results.items() if not each.holds]
    return Verdict(
        limits=judged.results,
        problems=(*judged.problems, *over),
        notes=tuple(judged.notes),
        numbers=judged.numbers,
    )


def _blocks(points: Setpoints | Iterable[Setpoints], path: Path) -> Iterator[tuple[Setpoints, bool]]:
    """Blocks of BLOCK ticks, and whether each is the last; the last one is the last tick alone.

    However the chunks are cut, the blocks are the same.
    """
    first: Setpoints | None = None
    waiting: list[Setpoints] = []
    count = 0
    for chunk in [points] if isinstance(points, Setpoints) else points:
        if not isinstance(chunk, Setpoints):
            raise InputError(f"check: expected Setpoints or chunks of them, got {type(chunk).__name__}")
        first = first or chunk
        if chunk.axes != path.axes:
            raise InputError(f"the setpoints have axes {chunk.axes}, the path {path.axes}; they must be the same")
        if chunk.period != number(first.period, "period") or not chunk.period > 0.0:
            raise InputError(f"a chunk has a period of {chunk.period:g} s, the first one {first.period:g} s")
        start = 0
        while start < len(chunk):
            if count == BLOCK:
                yield Setpoints.joined(waiting), False
                waiting, count = [], 0
            part = chunk.part(start, min(start + BLOCK - count, len(chunk)))
            start, count = start + len(part), count + len(part)
            waiting.append(part)
    if count:
        block = Setpoints.joined(waiting)
        if count > 1:
            yield block.part(0, count - 1), False
        yield block.part(count - 1, count), True


@dataclass(frozen=True)
class Whole:
    """What a verdict says of the whole path: its length, mm, its curves, and where rotary axes move alone, (k,), mm."""

    length: float
    curves: int
    turning: Array

    @classmethod
    def of(cls, bounds: Bounds) -> Whole:
        """Of a path that the bounds have as a whole."""
        return cls(bounds.path.length, len(bounds.path.curves), bounds.turning)


def verdict_of(judge: Judge, first: Setpoints, law: TimeLaw | None, whole: Whole) -> Verdict:
    """What a judge has to say at the end; first  some of the setpoints."""
    results, unit = judge.results(), unit_along(judge.bounds.path.axes)
    problems = [_fault_sentence(kind, fault, unit) for kind, fault in judge.faults.items()]
    notes: list[str] = []
    if law is not None:
        findings = check_law(law, judge.bounds, judge.period)
        results = {name: worse(result, findings.results.get(name)) for name, result in results.items()}
        problems += findings.problems
        notes += findings.notes
        if abs(law.duration - judge.duration) > judge.period:
            problems.append(f"law: lasts {law.duration:.9g} s, the setpoints {judge.duration:.9g} s; is it their law?")
    if "deceleration_jerk" in results:  # one name for both: what counts is the one that is nearer to its own limit
        results["jerk"] = worse(results.pop("deceleration_jerk"), results.get("jerk"))
    if judge.short is not None:
        notes.append(f"the last period is a short one of {judge.short:.9g} s; differences over it have a higher floor")
    if not judge.bounds.path.linear:
        notes.append("only rotary axes move: s is in degrees, and feed, acceleration and jerk along the path are too")
    elif len(whole.turning):
        notes.append(
            f"on {len(whole.turning)} of {whole.curves} curves, the first from s = "
            f"{whole.turning[0]:.6g} mm, rotary axes move alone: there 1 mm along the path stands for 1 degree, "
            "in s and in its feed, acceleration and jerk"
        )
    if not judge.placed:
        notes.append("the setpoints say no u: they were placed on the path by nearest points, one after the other")
    problems += [_limit_sentence(name, result, unit) for name, result in results.items() if not result.holds]
    numbers = {
        "duration_s": judge.duration,
        "length_mm": whole.length,
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
    order = {name: results[name] for name in judge.bounds.report_order() if name in results}
    return Verdict(limits=order, problems=tuple(problems), notes=tuple(notes), numbers=numbers)


def _fault_sentence(kind: str, fault: Fault, unit: str) -> str:
    """What is wrong, at how many ticks, and where it is worst."""
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
    """By how much a limit is exceeded, and where."""
    unit, factor = _unit(name, result.axis, along)
    worst, limit = factor * result.worst, factor * result.limit
    source = "exact derivative of the law" if result.by == "law" else f"setpoints, floor {factor * result.floor:.3g}"
    return (
        f"{name}: {worst:.9g} {unit} is {_over(result.share)} the limit of {limit:.9g} {unit} "
        f"at s = {result.at_s:.9g} {along}, t = {result.at_t:.9g} s ({source}; {result.over} in all)"
    )


def _over(share: float) -> str:
    """How far a share is above 1: as a multiple, in percent, or in parts of a million."""
    if share >= MANY:
        return f"{share:.3g} times"
    excess = share - 1.0
    return f"{100.0 * excess:.3g} % over" if excess >= PERCENT else f"{1e6 * excess:.3g} ppm over"


def _unit(name: str, axis: str | None, along: str) -> tuple[str, float]:
    """Unit of a limit for people, and what one base unit is in it."""
    if name in ANGLES:
        return "deg", 180.0 / math.pi
    base, factor = ("deg", 180.0 / math.pi) if axis in ROTARY_AXES else ("mm" if axis else along, 1.0)
    if name.startswith("torque."):
        return "N" if axis not in ROTARY_AXES else "N m", 1.0
    kind = name.rpartition(".")[2] if name.startswith("combinations.") else name.partition(".")[0].removeprefix("axis_")
    power = {
        "chord_error": "",
        "travel": "",
        "feed": "/s",
        "velocity": "/s",
        "velocity_step": "/s",
        "jerk": "/s^3",
    }.get(kind, "/s^2")
    return base + power, factor
