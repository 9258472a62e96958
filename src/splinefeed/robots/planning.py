"""What the planner gets of an arm: its limits, and joint waypoints as one smooth path."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import CurveError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.records import Array
from splinefeed.records.limits import Limits
from splinefeed.records.torque import Torque
from splinefeed.records.torque_rate import TorqueRate

#: Degree of the spline through waypoints: its jerk, and the rate of its torque, have no steps.
DEGREE = 5


class Jointed(Protocol):
    """What planning needs of an arm: its joints with their limits, (joints,), in rad or mm, and its bodies."""

    @property
    def joints(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def units(self) -> Any: ...  # noqa: D102

    @property
    def minimum(self) -> Array: ...  # noqa: D102

    @property
    def maximum(self) -> Array: ...  # noqa: D102

    @property
    def velocity(self) -> Array: ...  # noqa: D102

    @property
    def acceleration(self) -> Array: ...  # noqa: D102

    @property
    def jerk(self) -> Array: ...  # noqa: D102

    @property
    def bodies(self) -> Any: ...  # noqa: D102

    @property
    def torque(self) -> Any: ...  # noqa: D102

    @property
    def friction(self) -> Any: ...  # noqa: D102

    @property
    def torque_rate(self) -> Any: ...  # noqa: D102

    @property
    def most_torque(self) -> Array: ...  # noqa: D102


def limits_of(arm: Jointed) -> Limits:
    """The limits of every joint of an arm, by name, and of its torques."""

    def by_joint(values: Array) -> dict[str, float]:
        return {name: float(each) for name, each in zip(arm.joints, values, strict=True) if np.isfinite(each)}

    def each_joint(values: Array) -> dict[str, float]:
        return dict(zip(arm.joints, values.tolist(), strict=True))

    rated = bool(np.any(np.isfinite(arm.torque_rate)))
    ended = np.isfinite(arm.minimum) & np.isfinite(arm.maximum)
    return Limits(
        axis_velocity=by_joint(arm.velocity),
        axis_acceleration=by_joint(arm.acceleration),
        axis_jerk=by_joint(arm.jerk),
        axis_minimum=by_joint(np.where(ended, arm.minimum, np.inf)),
        axis_maximum=by_joint(np.where(ended, arm.maximum, np.inf)),
        torque=None
        if arm.bodies is None
        else Torque(arm.torque, each_joint(arm.most_torque), arm.friction.get("coulomb"), arm.friction.get("viscous")),
        modelled=[TorqueRate(arm.torque, each_joint(arm.torque_rate))] if arm.bodies is not None and rated else [],
    )


def path_through(arm: Jointed, waypoints: ArrayLike) -> Path:
    """The spline of degree 5 (fewer for less than 6 waypoints) through joint waypoints (n, joints), as a path.

    Its parameter grows from one waypoint to the next by the root of their distance, each joint measured by its velocity
    limit: so joints in rad and in mm count alike. Source: E. T. Y. Lee, Computer-Aided Design 21(6),
    1989, the centripetal choice.
    """
    from scipy.interpolate import make_interp_spline

    try:
        points = np.asarray(waypoints, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != len(arm.joints) or len(points) < 2 or not np.all(np.isfinite(points)):
        raise CurveError(
            f"waypoints have shape {points.shape}; expected 2 or more rows of {len(arm.joints)} finite joints: "
            f"{', '.join(arm.joints)}"
        )
    out = np.maximum(arm.minimum - points, points - arm.maximum)
    row, joint = np.unravel_index(np.argmax(out), out.shape)
    if out[row, joint] > 0.0:
        raise CurveError(
            f"waypoint {row + 1} has {arm.joints[joint]} at {points[row, joint]:g} {arm.units[joint]}; its limits are "
            f"{arm.minimum[joint]:g} to {arm.maximum[joint]:g}"
        )
    apart = np.sqrt(np.linalg.norm(np.diff(points, axis=0) / arm.velocity, axis=1))
    if not np.all(apart > 0.0):
        same = int(np.argmin(apart)) + 1
        raise CurveError(f"waypoints {same} and {same + 1} are the same; leave one out, or plan two paths for a stop")
    u = np.append(0.0, np.cumsum(apart))
    spline = make_interp_spline(u / u[-1], points, min(DEGREE, len(points) - 1))
    return Path([NurbsCurve(spline.k, spline.t, spline.c)], axes=arm.joints)
