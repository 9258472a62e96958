"""Moves that LinuxCNC's task hands to its trajectory planner, as curves with feeds and tolerances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_wire import FREE, LINE
from splinefeed.programs.gcode.arcs import Arcs, arc_curve
from splinefeed.records import Array

#: LinuxCNC's numbers: a rapid move; how a move ends: at rest (G61.1), exactly (G61), blended (G64).
TRAVERSE = 1
STOP, EXACT, BLEND = 0, 1, 2
#: Bit of `enables`: whether feed override counts (M48, M50).
OVERRIDE = 2
#: Ends of an arc nearer than this, mm, make it a full circle; a shorter move is none.
SAME_PLACE, POINT = 1e-6, 2e-6


def curve_of(move: Any, mill: Mill) -> NurbsCurve:
    """Make a curve of a move.

    Parameters
    ----------
    move : SEGMENT
        As the task hands it over.
    mill : Mill
        The machine.

    Returns
    -------
    NurbsCurve
        Over the machine's axes, mm and rad.
    """
    start, end = move["from"] * mill.units, move["to"] * mill.units
    if move["kind"] == LINE:
        return NurbsCurve.bezier([start[mill.columns], end[mill.columns]])
    # in a frame whose third axis is the arc's, where any plane is that of x and y
    centre = move["centre"] * mill.linear
    turn = int(move["turn"])
    axis = move["normal"] / np.linalg.norm(move["normal"])
    k = int(np.argmax(np.abs(axis)))
    u = np.eye(3)[(k + 1) % 3]
    u = u - (u @ axis) * axis
    u /= np.linalg.norm(u)
    frame = np.array([u, np.cross(axis, u), axis])
    p, q = start.copy(), end.copy()
    p[:3], q[:3] = frame @ (start[:3] - centre), frame @ (end[:3] - centre)
    ccw = turn >= 0
    sweep = math.atan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1])
    sweep = (sweep if ccw else -sweep) % (2.0 * math.pi)
    if sweep == 0.0 or math.hypot(p[0] - q[0], p[1] - q[1]) < SAME_PLACE:
        sweep = 2.0 * math.pi
    sweep += 2.0 * math.pi * (turn if ccw else -1 - turn)
    arcs = Arcs(
        np.zeros(1, dtype=np.int64), np.array([[0, 1]]), np.zeros((1, 2)), np.array([math.hypot(p[0], p[1])]),
        np.array([math.hypot(q[0], q[1])]), np.array([math.atan2(p[1], p[0])]), np.array([sweep if ccw else -sweep]),
    )  # fmt: skip
    local = arc_curve(p, q, arcs, 0, np.arange(9))
    points = np.array(local.control_points)
    points[:, :3] = points[:, :3] @ frame + centre
    points[0], points[-1] = start, end
    return NurbsCurve(local.degree, local.knots, points[:, mill.columns], local.weights)


def size_of(move: Any, mill: Mill) -> float:
    """Measure how far a move goes.

    Parameters
    ----------
    move : SEGMENT
        As the task hands it over.
    mill : Mill
        The machine.

    Returns
    -------
    float
        The longest way of an axis, mm or rad: 0 for a move that is none, inf for an arc.
    """
    if move["kind"] != LINE:
        return math.inf
    return float(np.max(np.abs((move["to"] - move["from"]) * mill.units)))


def feeds_of(moves: Any, mill: Mill, feed_scale: float, rapid_scale: float, vlimit: float) -> tuple[Array, Array]:
    """Compute the feeds of moves under overrides and the largest velocity.

    Parameters
    ----------
    moves : array (n,) of SEGMENT
        As the task hands them over.
    mill : Mill
        The machine.
    feed_scale, rapid_scale : float
        Overrides of feeds and rapid moves, 1 as programmed.
    vlimit : float
        The largest velocity, in LinuxCNC's units a second.

    Returns
    -------
    feeds : array (n,)
        In mm/s.
    scale : array (n,)
        The override of each.

    Notes
    -----
    LinuxCNC counts a feed along x, y and z, else along u, v and w, else in degrees; a path counts all its linear axes.
    In step with a spindle the largest velocity does not count.
    """
    step = np.abs(moves["to"] - moves["from"])
    arc = moves["kind"] != LINE
    xyz, uvw = np.linalg.norm(step[:, :3], axis=1), np.linalg.norm(step[:, 6:], axis=1)
    straight = np.where(arc | (xyz == 0.0), 1.0, np.hypot(xyz, uvw) / np.where(xyz > 0.0, xyz, 1.0))
    linear = arc | (xyz > 0.0) | (uvw > 0.0)
    unit = np.where(linear, mill.linear, 1.0)
    scale = np.where(moves["canon"] == TRAVERSE, rapid_scale, feed_scale)
    scale = np.where(moves["enables"] & OVERRIDE, scale, 1.0)
    feeds = np.minimum(moves["feed"] * scale, moves["top"])
    feeds = np.where(linear & (moves["sync"] == FREE), np.minimum(feeds, vlimit), feeds)
    return np.maximum(feeds * unit * straight, 1e-6), scale
