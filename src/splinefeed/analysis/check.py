"""Check: whether setpoints lie on their path, cover it and hold every limit, by their definitions alone."""

from __future__ import annotations

from collections.abc import Iterable

from splinefeed.analysis.check_bounds import TOLERANCE
from splinefeed.analysis.check_parts import CheckInParts
from splinefeed.analysis.check_tool import judge_tool
from splinefeed.analysis.check_verdict import limit_sentence
from splinefeed.errors import InputError, expect
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Limits, Setpoints, TimeLaw, Verdict, number, refuse_orientation


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
    limits = limits.for_axes(path.axes)
    slack = number(tolerance, "tolerance"), number(resolution, "resolution")
    if min(slack) < 0.0:
        raise InputError(f"tolerance {slack[0]:g} and resolution {slack[1]:g} must not be negative")
    if isinstance(path, JointPath):
        return _of_tool(setpoints, path, limits, law, slack[0])
    refuse_orientation(limits, path.name)
    judged = CheckInParts(limits, *slack, law=law)
    judged.part(path)
    for chunk in [setpoints] if isinstance(setpoints, Setpoints) else setpoints:
        judged.see(chunk)
    return judged.verdict()


def _of_tool(
    setpoints: Setpoints | Iterable[Setpoints], path: JointPath, limits: Limits, law: TimeLaw | None, tolerance: float
) -> Verdict:
    """The verdict on joints of a tool path."""
    whole = setpoints if isinstance(setpoints, Setpoints) else Setpoints.joined(list(setpoints))
    judged = judge_tool(whole, path, limits, law, tolerance)
    over = [limit_sentence(name, each, "mm") for name, each in judged.results.items() if not each.holds]
    return Verdict(
        limits=judged.results,
        problems=(*judged.problems, *over),
        notes=tuple(judged.notes),
        numbers=judged.numbers,
    )
