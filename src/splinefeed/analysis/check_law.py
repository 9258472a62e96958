"""The part of the check for a time law: exact derivatives of r(s(t)), and what they cannot decide."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from splinefeed.analysis.check_bounds import STEP, Bounds, Worst
from splinefeed.analysis.law_motion import ALONG, LawMotion, breaks_apart, times_at
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import EPSILON, Rows
from splinefeed.records import Array, LimitResult, Limits, TimeLaw, unit_along

#: Limits that only setpoints can keep or exceed.
BY_SETPOINTS = ("chord_error", "orientation_error", "travel.", "combinations.", "torque.")
#: Roundings of arc length that two pieces of a law, or a law and its path, may be apart.
ROUNDINGS = 64.0
#: A jump of the feed or the acceleration below this share of the largest one is rounding.
NO_JUMP = 1e-9
#: Corners that a note names one by one.
LISTED = 3


@dataclass(frozen=True)
class LawFindings:
    """Results by limit, problems, and notes on what the setpoints decide."""

    results: dict[str, LimitResult]
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def check_law(law: TimeLaw, bounds: Bounds, period: float) -> LawFindings:
    """Compare a law's exact derivatives with the limits, at many instants of each of its pieces; period in s."""
    path = bounds.path
    rounding = 4.0 * EPSILON * path.length
    motion = LawMotion(law, Rows(path.arc_pieces), bounds.limits, path.axes, rounding)
    worsts = {name: worst for name, worst in bounds.worsts().items() if not name.startswith(BY_SETPOINTS)}
    steps = {name: worst for name, worst in worsts.items() if name.startswith(STEP)}
    held = {name: worst for name, worst in worsts.items() if name not in steps}
    motion.hold(held, None if path.feeds is None else bounds.row_feeds)
    corners = bounds.corners.s
    times, feeds = times_at(law, corners), _least_feeds(law, corners, rounding)
    for worst in steps.values():
        worst.see(feeds * bounds.corners.jumps[:, worst.column - 1], times, corners, np.zeros(len(corners)))
    results = {name: _result(worst, path) for name, worst in worsts.items() if name not in steps or len(corners)}
    problems: list[str] = []
    notes: list[str] = []
    _ends(law, bounds, motion, problems)
    _jumps(law, bounds, motion, period, problems, notes)
    if motion.irregular:
        notes.append(
            f"at {motion.irregular} instants of the law C' is 0 to rounding and exact axis derivatives are "
            "0/0; there the differences of the setpoints decide"
        )
    notes += _corner_notes(law, bounds)
    return LawFindings(results, tuple(problems), tuple(notes))


def limits_along(law: TimeLaw, path: Path, limits: Limits) -> dict[str, LimitResult]:
    """How the limits along the path fare in a law alone: feed, acceleration, deceleration and jerk."""
    bounds = Bounds(path, limits.for_axes(path.axes), 0.0, 0.0)
    worsts = {name: worst for name, worst in bounds.worsts().items() if name in ALONG}
    motion = LawMotion(law, Rows(path.arc_pieces), bounds.limits, path.axes, 0.0)
    motion.hold(worsts, None if path.feeds is None else bounds.row_feeds)
    return one_jerk({name: _result(worst, path) for name, worst in worsts.items()})


def one_jerk(results: dict[str, LimitResult]) -> dict[str, LimitResult]:
    """Results with one for jerk, whichever way the feed goes: the worse of both."""
    if "deceleration_jerk" in results:
        results["jerk"] = worse(results.pop("deceleration_jerk"), results.get("jerk"))
    return results


def _result(worst: Worst, path: Path) -> LimitResult:
    axis = path.axes[worst.column - 1] if worst.column else None
    return LimitResult(
        limit=worst.limit, worst=worst.value, at_s=worst.s, at_t=worst.t, floor=worst.floor, axis=axis, by="law",
        over=worst.over,
    )  # fmt: skip


def _ends(law: TimeLaw, bounds: Bounds, motion: LawMotion, problems: list[str]) -> None:
    """The law runs from 0 to the end of the path, forwards, with the end feeds of the limits."""
    length, limits = bounds.path.length, bounds.limits
    unit = unit_along(bounds.path.axes)
    if abs(law.length - length) > bounds.tolerance + ROUNDINGS * EPSILON * length:
        problems.append(f"law: ends at s = {law.length:.12g} {unit}; the path is {length:.12g} {unit} long")
    start = float(law(0.0))
    if abs(start) > bounds.tolerance + ROUNDINGS * EPSILON * length:
        problems.append(f"law: begins at s = {start:.6g} {unit} instead of 0")
    top = motion.top
    value, t, s = motion.backwards
    if value > NO_JUMP * top:
        problems.append(f"law: runs backwards at {value:.6g} {unit}/s at t = {t:.6g} s, s = {s:.6g} {unit}")
    for name, time in (("start_feed", 0.0), ("end_feed", law.duration)):
        feed, wanted = float(law.feed(time)), getattr(limits, name)
        if abs(feed - wanted) > NO_JUMP * max(top, wanted):
            problems.append(
                f"law: its feed at t = {time:.6g} s is {feed:.9g} {unit}/s; {name} is {wanted:.9g} {unit}/s"
            )


def _jumps(
    law: TimeLaw, bounds: Bounds, motion: LawMotion, period: float, problems: list[str], notes: list[str]
) -> None:
    """Jumps of s and of the feed between pieces are faults; of the acceleration, an infinite jerk."""
    length, limits = bounds.path.length, bounds.limits
    along = unit_along(bounds.path.axes)
    top, steepest = motion.top, motion.steepest
    kinds = (
        ("s", along, ROUNDINGS * EPSILON * length + NO_JUMP * top * period),
        ("its feed", f"{along}/s", NO_JUMP * top),
        ("its acceleration", f"{along}/s^2", NO_JUMP * steepest),
    )
    for k, ((what, unit, rounding), (value, t, s)) in enumerate(zip(kinds, breaks_apart(law), strict=True)):
        if not value > rounding:
            continue
        text = f"law: {what} jumps by {value:.6g} {unit} at t = {t:.9g} s, s = {s:.9g} {along}"
        if k < 2:
            problems.append(text)
        elif limits.jerk < np.inf or float(limits.deceleration_jerk or np.inf) < np.inf:
            problems.append(f"{text}: its jerk is infinite there")
        elif limits.axis_jerk is not None:
            notes.append(f"{text}: the exact axis jerk is infinite there, and the third difference decides")


def _corner_notes(law: TimeLaw, bounds: Bounds) -> list[str]:
    """Where tangent or curvature jumps and the law does not stop, derivatives of the axes are infinite: note it."""
    corners = bounds.path.corners
    limits = bounds.limits
    if not corners or (limits.axis_jerk is None and limits.axis_acceleration is None):
        return []
    high = times_at(law, np.array([corner.s for corner in corners]))
    moving = law.feed(high) > 1e-3 * float(np.max(law.feed(np.linspace(0.0, law.duration, 257))))
    notes = []
    unit = unit_along(bounds.path.axes)
    steps = set(bounds.corners.s.tolist())
    for stop, what, which in (
        (False, "the curvature jumps and the exact axis jerk is infinite", "third"),
        (True, "the direction jumps and the exact axis acceleration is infinite", "second and third"),
    ):
        places = [c.s for c, m in zip(corners, moving, strict=True) if m and c.stop == stop and c.s not in steps]
        if places:
            notes.append(
                f"at {len(places)} place(s), s = {_listed(places)} {unit}, {what}: there the {which} difference "
                "of the setpoints over the period decides: it is what the drive sees"
            )
    places = [c.s for c, m in zip(corners, moving, strict=True) if m and c.s in steps]
    if places:
        notes.append(
            f"at {len(places)} corner(s), s = {_listed(places)} {unit}, the tool does not stop: there the "
            "velocity step of each axis is checked, and no difference across the corner"
        )
    return notes


def _listed(places: list[float]) -> str:
    return ", ".join(f"{each:.6g}" for each in places[:LISTED]) + (", ..." if len(places) > LISTED else "")


def _least_feeds(law: TimeLaw, s: Array, rounding: float) -> Array:
    """Least feed of a law within the rounding of arc lengths s (n,), mm/s: where it rests, it is 0 at a break there."""
    first, last = times_at(law, s - rounding), times_at(law, s + rounding)
    least: Array = np.minimum(law.feed(first), law.feed(last))
    begin, end = np.searchsorted(law.breaks, first, "left"), np.searchsorted(law.breaks, last, "right")
    for k in np.flatnonzero(end > begin):
        least[k] = min(least[k], float(np.min(law.feed(law.breaks[begin[k] : end[k]]))))
    return np.maximum(least, 0.0)


def worse(one: LimitResult, other: LimitResult | None) -> LimitResult:
    """Of two findings on one limit the one that is further over it, or nearer to it; counted together."""
    if other is None:
        return one
    pairs = sorted((one, other), key=lambda result: (result.worst - result.floor) / result.limit)
    return replace(pairs[1], over=one.over + other.over)
