"""What the planner gets of an arm: its limits, and joint waypoints as one smooth path."""

from __future__ import annotations

from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import CurveError
from splinefeed.paths.path import Path
from splinefeed.paths.waypoints import checked_waypoints
from splinefeed.records import Array
from splinefeed.records.limits import Limits
from splinefeed.records.torque import Torque
from splinefeed.records.torque_rate import TorqueRate
from splinefeed.robots.frames import Frames


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
    def frames(self) -> Any: ...  # noqa: D102

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


def path_through(arm: Jointed, waypoints: ArrayLike, **how: Any) -> Path:
    """The path through joint waypoints (n, joints), as `Path.through` makes it.

    Each joint is measured by its velocity limit: so joints in rad and in mm count alike.
    """
    points = checked_waypoints(waypoints, arm.joints)
    out = np.maximum(arm.minimum - points, points - arm.maximum)
    row, joint = np.unravel_index(np.argmax(out), out.shape)
    if out[row, joint] > 0.0:
        raise CurveError(
            f"waypoint {row + 1} has {arm.joints[joint]} at {points[row, joint]:g} {arm.units[joint]}; its limits are "
            f"{arm.minimum[joint]:g} to {arm.maximum[joint]:g}"
        )
    return WaypointPath.through(points, arm.joints, weights=1.0 / arm.velocity, frames=arm.frames, **how)


class WaypointPath(Path):
    """A path of the joints of an arm, which knows where its links are: pictures of it show the arm in space.

    Source: docs/readers/robots.md. Example: `arm.through(waypoints)`
    """

    def __init__(self, *made: Any, frames: Frames, **said: Any) -> None:
        self.frames = frames
        super().__init__(*made, **said)

    def __reduce__(self) -> tuple[object, ...]:
        return partial(WaypointPath, frames=self.frames, **self._said()), (self.curves, self.axes)

    def sticks(self, position: Array) -> Array:
        """The arm as lines: base, each joint and the tip, (n, joints + 2, 3), mm, for joints (n, joints)."""
        return self.frames.sticks(position)

    def with_findings(self, *findings: str) -> WaypointPath:
        """The same path with other findings."""
        said = {**self._said(), "findings": findings}
        return WaypointPath(self.curves, self.axes, frames=self.frames, **said)
