"""The report of a check: limits, problems and notes as sentences, and numbers."""

from __future__ import annotations

import math

from splinefeed.analysis.check_bounds import Fault
from splinefeed.analysis.check_law import check_law, one_jerk, worse
from splinefeed.analysis.check_setpoints import Judge
from splinefeed.records import LimitResult, Setpoints, Verdict, shown_by, unit_along, unit_of

#: Sentence of each kind of fault of single setpoints, before its place.
_SENTENCES = {
    "off the curve": "off the curve by {amount:.6g} {unit}",
    "turned off": "a rotary axis is {degrees:.6g} deg from where the curve has it",
    "tilted": "the tool axis is off its path by {degrees:.6g} deg",
    "misplaced": "on the curve, but {amount:.6g} {unit} from the place of its u",
    "period": "is {amount:.6g} s early or late: the period is not kept",
    "back": "goes back by {amount:.6g} {unit} along the path",
    "skipped": "a part of the path is skipped: one step of {amount:.6g} {unit}",
    "twice": "the same point twice in the middle of the motion",
    "start": "the first setpoint is {detail} from the start of the path",
    "end": "the last setpoint is {detail} from the end of the path: it is not reached",
}


def verdict_of(judge: Judge, first: Setpoints, curves: int) -> Verdict:
    """The report of a check; first  some of the setpoints; curves  of the whole path."""
    law, tool = judge.law, judge.tool
    results = {name: worst.result(judge.bounds.axes) for name, worst in judge.worst.items()}
    unit = unit_along(judge.bounds.path.axes)
    problems = [_fault_sentence(kind, fault, unit) for kind, fault in judge.faults.items()]
    notes: list[str] = []
    if law is not None and tool is None:
        found, faults, noted = check_law(law, judge.bounds, judge.period)
        results = {name: worse(result, found.get(name)) for name, result in results.items()}
        problems += faults
        notes += noted
        if abs(law.duration - judge.duration) > judge.period:
            problems.append(f"law: lasts {law.duration:.9g} s, the setpoints {judge.duration:.9g} s; is it their law?")
    results = one_jerk(results)
    if judge.short is not None:
        notes.append(f"the last period is short, {judge.short:.9g} s; differences over it have a higher floor")
    if not judge.bounds.path.linear:
        notes.append("only rotary axes move: s is in degrees, and feed, acceleration and jerk along the path are too")
    elif judge.turning:
        notes.append(
            f"on {len(judge.turning)} of {curves} curves, the first from s = "
            f"{judge.turning[0]:.6g} mm, rotary axes move alone: there 1 mm along the path stands for 1 degree, "
            "in s and in its feed, acceleration and jerk"
        )
    if not judge.placed:
        notes.append("the setpoints have no u: each is placed at the nearest point of the path, one after the other")
    problems += [_limit_sentence(name, result, unit) for name, result in results.items() if not result.holds]
    numbers = {
        "duration_s": judge.duration,
        "length_mm": judge.gone + judge.bounds.path.length,
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
    if tool is not None:
        numbers |= {
            "chord_error_max_mm": tool.chord_error,
            "off_axis_max_rad": tool.off_axis,
            "axis_error_between_max_rad": tool.turned,
        }
    order = {name: results[name] for name in judge.bounds.report_order() if name in results}
    return Verdict(limits=order, problems=tuple(problems), notes=tuple(notes), numbers=numbers)


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
