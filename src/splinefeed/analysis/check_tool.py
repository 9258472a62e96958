"""The check of joints on a tool path: back through the forward kinematics to tip and tool axis, limits by differences.

Nothing of it comes from the planner or the inverse kinematics. A joint is known to

    r = 8 eps (X + |dq/ds| L)      X its largest position, L the length of the path, mm

and 2^k r / T^k is the floor of a difference of order k: what rounding makes of it, there is no other allowance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from splinefeed.analysis.ripple import steps
from splinefeed.errors import InputError
from splinefeed.geometry.differential import curvatures
from splinefeed.geometry.tool_path import ANGLES
from splinefeed.kinematics import JointPath
from splinefeed.records import AXIS_LIMITS, BOUNDED, Array, IntArray, LimitResult, Limits, Setpoints, TimeLaw

EPSILON = float(np.finfo(np.float64).eps)
#: Roundings of a position: those of the formulas of kinematics.
ROUNDINGS = 8.0
#: A tick that is early or late by less than this, in periods, is on time.
ON_TIME = 1e-6
#: Places between two setpoints at which the chord is looked at, as shares of the step.
BETWEEN = (0.25, 0.5, 0.75)
#: Newton steps that find the nearest point of the path.
NEWTON = 4


@dataclass(eq=False)
class Judged:
    """What a check of joints found: limits by name, faults one sentence each, notes, and numbers."""

    results: dict[str, LimitResult] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    numbers: dict[str, Any] = field(default_factory=dict)


def judge_tool(points: Setpoints, path: JointPath, limits: Limits, law: TimeLaw | None, tolerance: float) -> Judged:
    """Hold joint setpoints to their tool path and to limits; see `check`.

    tolerance  mm that the tip may be off its curve, and rad that the tool axis may be off its direction
    Raises InputError for setpoints of other joints, for no setpoints, and for setpoints without u.
    """
    if points.axes != path.axes:
        raise InputError(f"the setpoints have axes {points.axes}, the machine {path.axes}; they must be the same")
    if not len(points):
        raise InputError("there are no setpoints to check")
    if np.isnan(points.u).any():
        raise InputError("the setpoints have no u; joints can be checked only where u says their place on the path")
    found = Judged()
    finite = np.isfinite(points.position).all(axis=1)
    if not finite.all():
        found.problems.append(f"tick {int(np.argmin(finite))}: a joint is not a finite number")
        return found
    tool, period = path.tool, points.period
    dt = np.diff(points.t)
    late = np.abs(dt[:-1] - period) > ON_TIME * period
    if late.any():
        found.problems.append(f"tick {int(np.argmax(late)) + 1}: is early or late: the period is not kept")
    whole = len(points)
    if len(dt) and dt[-1] < period * (1.0 - ON_TIME):
        whole -= 1
        found.notes.append(f"the last period is short, {dt[-1]:.9g} s; no difference uses it")
    tip, axis = path.kinematics.forward(points.position)
    off_tip = np.linalg.norm(tip - tool.evaluate(points.curve, points.u, 0)[:, 0], axis=1)
    off_axis = _axis_errors(path, points.curve, points.u, axis, points.position)
    allowed = tolerance + ROUNDINGS * EPSILON * max(float(np.max(np.abs(points.position))), path.length)
    for name, off, unit in (("tool tip", off_tip, "mm"), ("tool axis", off_axis, "rad")):
        worst = int(np.argmax(off))
        if off[worst] > allowed:
            found.problems.append(
                f"tick {worst} (t = {points.t[worst]:.9g} s, s = {points.s[worst]:.9g} mm): the {name} is off its path "
                f"by {off[worst]:.6g} {unit}; {int(np.sum(off > allowed))} ticks in all"
            )
    travelled = steps(points, tool)
    back = travelled < -allowed
    if back.any():
        k = int(np.argmin(travelled))
        found.problems.append(f"tick {k + 1}: goes back by {-travelled[k]:.6g} mm along the path")
    ends = tool.ends[0, 0], tool.ends[-1, 1]
    start_error, end_error = (float(np.linalg.norm(tip[k] - end)) for k, end in zip((0, -1), ends, strict=True))
    for which, error in (("first", start_error), ("last", end_error)):
        if error > allowed:
            found.problems.append(f"the {which} setpoint is {error:.6g} mm from its end of the path")
    _along(found, points, path, limits, travelled)
    _joints(found, points, path, limits, travelled, whole)
    turned = _chords(found, points, path, limits)
    found.numbers |= {
        "duration_s": float(points.t[-1] - points.t[0]),
        "length_mm": path.length,
        "ticks": len(points),
        "period_s": period,
        "method": points.method,
        "strategy": points.settings.get("strategy") if law is None else law.strategy,
        "start_error_mm": start_error,
        "end_error_mm": end_error,
        "end_reached": end_error <= allowed,
        "off_curve_max_mm": float(np.max(off_tip)),
        "off_axis_max_rad": float(np.max(off_axis)),
        "axis_error_between_max_rad": turned,
        "tolerance_mm": allowed,
    }
    if law is not None:
        found.numbers["law_drift_max_mm"] = float(np.max(np.abs(points.s - law(points.t))))
    return found


def _axis_errors(path: JointPath, curve: IntArray, u: Array, axis: Array, joints: Array) -> Array:
    """Angle between the tool axis and that of the path at places (n,), rad; of angles their own difference."""
    tool = path.tool
    if tool.kind == ANGLES and tool.columns:
        wanted = tool.orientation(curve, u)[:, 0]
        return np.asarray(np.max(np.abs(wanted - joints[:, path.linear :]), axis=1))
    return _between(path, curve, u, axis)


def _between(path: JointPath, curve: IntArray, u: Array, axis: Array) -> Array:
    """Angle between the tool axis (n, 3) and that of the path at places (n,), rad."""
    tool, wanted = path.tool, np.array([0.0, 0.0, 1.0])
    if tool.columns:
        wanted = tool.orientation(curve, u)[:, 0]
        if tool.kind == ANGLES:
            wanted = np.column_stack([np.zeros((len(wanted), path.linear)), wanted])
            wanted = path.kinematics.forward(wanted)[1]
        wanted = wanted / np.linalg.norm(wanted, axis=1)[:, None]
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(axis - wanted, axis=1), 1.0)))


def _see(
    found: Judged,
    name: str,
    limit: float | Array | None,
    worst: Array,
    floor: float,
    points: Setpoints,
    axis: str | None = None,
) -> None:
    """Remember how a limit, one or (n,) or none, fares over values (n,), one from each of the first ticks on."""
    limit = np.broadcast_to(np.inf if limit is None else limit, worst.shape)
    if not np.any(np.isfinite(limit)):
        return
    k = int(np.argmax(worst / limit))
    at = min(k, len(points) - 1)
    over = int(np.sum(worst > limit * (1.0 + 1e-9) + floor))
    found.results[name] = LimitResult(
        limit=float(limit[k]),
        worst=float(worst[k]),
        at_s=float(points.s[at]),
        at_t=float(points.t[at]),
        floor=floor,
        axis=axis,
        over=over,
    )


def _along(found: Judged, points: Setpoints, path: JointPath, limits: Limits, travelled: Array) -> None:
    """Limits of the tip along its path, by differences of arc length over each step."""
    tool, period = path.tool, points.period
    floor = ROUNDINGS * EPSILON * path.length
    seconds = np.maximum(np.diff(points.t), period * ON_TIME)
    feed = travelled / seconds
    most = np.full(len(feed), limits.feed)
    if tool.feeds is not None:  # a step over a joint of curves has the feeds of both
        most = np.minimum(most, np.maximum(tool.feeds[points.curve[:-1]], tool.feeds[points.curve[1:]]))
    _see(found, "feed", most, feed, 2.0 * floor / period, points)
    rest = _padded(travelled[:, None], limits)[:, 0]
    change, jerks = np.diff(rest) / period**2, np.abs(np.diff(rest, n=2)) / period**3
    jerk = None if limits.jerk is None else max(limits.jerk, limits.deceleration_jerk or 0.0)
    for name, order, limit, seen in (
        ("acceleration", 2, limits.acceleration, change),
        ("deceleration", 2, limits.deceleration, -change),
        ("jerk", 3, jerk, jerks),
    ):
        _see(found, name, limit, seen, 2.0**order * floor / period**order, points)
    if limits.centripetal is not None:
        kappa = curvatures(tool.evaluate(points.curve, points.u, 2), 3)[:-1]
        _see(found, "centripetal", limits.centripetal, kappa * feed**2, 0.0, points)


def _padded(values: Array, limits: Limits) -> Array:
    """Steps (n, k) with the standstill before a start and behind an end at rest."""
    rest = np.zeros((2, values.shape[1]))
    parts = [rest] if limits.start_feed == 0.0 else []
    parts.append(values)
    if limits.end_feed == 0.0:
        parts.append(rest)
    return np.concatenate(parts)


def _joints(found: Judged, points: Setpoints, path: JointPath, limits: Limits, travelled: Array, whole: int) -> None:
    """Limits of each joint by differences of its setpoints, the first `whole` ones, and its travel."""
    period = points.period
    change = _padded(np.diff(points.position[:whole], axis=0), limits)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.abs(np.diff(points.position, axis=0)) / np.abs(travelled)[:, None]
    moving = np.abs(travelled) > 0.01 * np.max(np.abs(travelled), initial=0.0)
    steep = np.max(np.where(moving[:, None] & np.isfinite(slope), slope, 0.0), axis=0, initial=0.0)
    rounding = ROUNDINGS * EPSILON * (np.max(np.abs(points.position), axis=0) + steep * path.length)
    for order, kind in enumerate(AXIS_LIMITS, start=1):
        values = np.abs(np.diff(change, n=order - 1, axis=0)) / period**order
        given = getattr(limits, kind)
        bounds = limits.of_axes(kind, path.axes) if given is not None else np.full(len(path.axes), np.inf)
        for k, name in enumerate(path.axes):
            floor = float(2.0**order * rounding[k] / period**order)
            _see(found, f"{kind}.{name}", float(bounds[k]), values[:, k], floor, points, name)
    for label, each in (limits.combinations or {}).items():
        w = each.on(path.axes)
        for order, kind in enumerate(BOUNDED, start=1):
            values = np.abs(np.diff(change, n=order - 1, axis=0) @ w) / period**order
            floor = float(2.0**order * np.abs(w) @ rounding / period**order)
            _see(found, f"combinations.{label}.{kind}", getattr(each, kind), values, floor, points)
    if limits.torque is not None:
        before, after = (2 * (feed == 0.0) for feed in (limits.start_feed, limits.end_feed))
        q = np.pad(points.position[:whole], ((before, after), (0, 0)), mode="edge")
        columns = limits.torque.columns(path.axes)
        torques, _, floors = limits.torque.by_differences(q[:, columns], period, rounding[columns])
        for k, (name, most) in enumerate(limits.torque.most.items()):
            _see(found, f"torque.{name}", most, np.abs(torques[:, k]), float(np.max(floors[:, k])), points, name)
    for name, (low, high) in limits.travel_of(path.axes).items():
        away = np.abs(points.position[:, path.axes.index(name)] - 0.5 * (low + high))
        _see(found, f"travel.{name}", 0.5 * (high - low), away, 0.0, points, name)


def _chords(found: Judged, points: Setpoints, path: JointPath, limits: Limits) -> float:
    """The chord error: how far the tip is from its path while joints move straight from one setpoint to the next.

    Returns how far the tool axis is from that of the path meanwhile, rad, at most.
    """
    tool = path.tool
    if len(points) < 2:
        return 0.0
    same = points.curve[1:] == points.curve[:-1]
    worst, turned = np.zeros((2, len(points) - 1))
    domains = tool.flat.domains
    for share in BETWEEN:
        joints = (1.0 - share) * points.position[:-1] + share * points.position[1:]
        tip, axis = path.kinematics.forward(joints)
        # a step over the joint of two curves is looked at on the one behind it, or before it, whichever is nearer
        options = []
        for curve, u in (
            (points.curve[:-1], np.where(same, (1.0 - share) * points.u[:-1] + share * points.u[1:], points.u[:-1])),
            (points.curve[1:], np.where(same, (1.0 - share) * points.u[:-1] + share * points.u[1:], points.u[1:])),
        ):
            low, high = domains[curve].T
            for _ in range(NEWTON):
                d = tool.evaluate(curve, u, 2)
                away = d[:, 0] - tip
                slope = np.sum(away * d[:, 1], axis=1)
                bend = np.sum(d[:, 1] ** 2, axis=1) + np.sum(away * d[:, 2], axis=1)
                step = np.where(bend > 0.0, slope / np.where(bend > 0.0, bend, 1.0), 0.0)
                u = np.clip(u - step, low, high)
            off = np.linalg.norm(tool.evaluate(curve, u, 0)[:, 0] - tip, axis=1)
            options.append((off, _between(path, curve, u, axis)))
        first = options[0][0] <= options[1][0]
        worst = np.maximum(worst, np.where(first, options[0][0], options[1][0]))
        turned = np.maximum(turned, np.where(first, options[0][1], options[1][1]))
    found.numbers["chord_error_max_mm"] = float(np.max(worst))
    floor = ROUNDINGS * EPSILON * max(float(np.max(np.abs(points.position))), path.length)
    _see(found, "chord_error", limits.chord_error, worst, floor, points)
    _see(found, "orientation_error", limits.orientation_error, turned, ROUNDINGS * EPSILON, points)
    return float(np.max(turned))
