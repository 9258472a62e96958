"""What the check of joints adds: back through the forward kinematics to tip and tool axis.

Nothing of it comes from the planner or the inverse kinematics. A joint is known to

    r = 8 eps (X + |dq/ds| L)      X its largest position, L the length of the path, mm

and 2^k r / T^k is the floor of a difference of order k: what rounding makes of it, there is no other allowance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.checks.axes import AxesCheck
from splinefeed.checks.place import Placer
from splinefeed.checks.spans import PathSpans
from splinefeed.curves.packed import Flat
from splinefeed.paths.tool_path import ANGLES, POINTS
from splinefeed.paths.track import Track
from splinefeed.records import Array, IntArray, Setpoints

#: Places between two setpoints at which the chord is looked at, as shares of the step.
BETWEEN = (0.25, 0.5, 0.75)


class ToolCheck(AxesCheck):
    """Tip and tool axis of joints on their path, by the forward kinematics."""

    fault = "tilted"

    def __init__(self, path: Track, rows: PathSpans, placer: Placer) -> None:
        super().__init__(path, rows, placer)
        self.tool, self.kinematics = path.tip_path, path.kinematics
        axis = self.tool.tool_axis
        self._axis = None if axis is None else PathSpans(Flat.of(axis), self.tool.columns, None)

    def tip(self, setpoints: Setpoints) -> tuple[Setpoints, Array]:
        """Setpoints of the tip, and by how much the tool axis is off, rad (n,); of angles their own difference."""
        path, tool = self.track, self.tool
        finite = np.isfinite(setpoints.position)
        joints = np.where(finite, setpoints.position, np.nan)
        tip, axis = self.kinematics.forward(joints)
        curve, u = np.clip(setpoints.curve, 0, len(tool.curves) - 1), np.nan_to_num(setpoints.u)
        if tool.kind == ANGLES and tool.columns:
            off = np.max(np.abs(self._orientation(curve, u) - joints[:, path.linear :]), axis=1)
        else:
            off = self._angles(curve, u, axis)
        self.off_axis = max(self.off_axis, float(np.fmax.reduce(off, initial=0.0)))
        return replace(setpoints, position=tip, axes=tool.axes), off

    def _angles(self, curve: IntArray, u: Array, axis: Array) -> Array:
        """Angle between the tool axis (n, 3) and that of the path at places (n,), rad."""
        path, tool, wanted = self.track, self.tool, np.array([0.0, 0.0, 1.0])
        given = path.standing(curve, u)
        if given is not None:
            wanted = given
        elif tool.columns:
            wanted = self._orientation(curve, u)
            if tool.kind == ANGLES:
                wanted = self.kinematics.forward(np.pad(wanted, ((0, 0), (path.linear, 0))))[1]
            wanted = wanted / np.linalg.norm(wanted, axis=1)[:, None]
        return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(axis - wanted, axis=1), 1.0)))

    def _orientation(self, curve: IntArray, u: Array) -> Array:
        """What stands for the tool axis at places (n,), (n, columns): a point of the axis counts from the tip, mm."""
        assert self._axis is not None
        value = self._axis.points(curve if len(self._axis.curves) > 1 else 0 * curve, u)
        return (value - self._rows.points(curve, u) if self.tool.kind == POINTS else value).T

    def _between(self, joints: Array, s: Array) -> Array:
        """How far tip, mm, and tool axis, rad, are off, (2, n), while joints (joints, n + 1) move straight.

        s (n + 1,) is where the setpoints are, mm: the nearest point is sought around there.
        """
        off = np.zeros((2, joints.shape[1] - 1))
        first, search = self._rows.curves[:, 0], self._placer.search
        known = np.flatnonzero(np.all(np.isfinite(joints[:, 1:] + joints[:, :-1]), axis=0))
        for share in BETWEEN if len(known) else ():
            between, hint = ((1.0 - share) * each[..., known] + share * each[..., known + 1] for each in (joints, s))
            tip, axis = self.kinematics.forward(between.T)
            found = search.near(np.ascontiguousarray(tip.T), hint)
            u = self._placer.parameter(found)
            curve = np.searchsorted(first, found.row, side="right") - 1
            off[:, known] = np.maximum(off[:, known], [np.sqrt(found.square), self._angles(curve, u, axis)])
        return off


def axes_check(track: Track, rows: PathSpans, placer: Placer) -> AxesCheck:
    """What checks the axes of a track that do not carry the tip: joints go through their kinematics."""
    return (AxesCheck if track.kinematics is None else ToolCheck)(track, rows, placer)
