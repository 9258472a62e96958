"""A tool path on a machine: where every joint is along it, with derivatives by arc length of the tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.differential import by_arc_length
from splinefeed.errors import CurveError, InputError, LimitsError
from splinefeed.kinematics.chains import Kinematics
from splinefeed.kinematics.jets import Jet, as_jet, root
from splinefeed.paths.resolution import RESOLUTION
from splinefeed.paths.tool_path import ANGLES, ToolPath
from splinefeed.paths.track import Track
from splinefeed.records import ROTARY_AXES, Array, IntArray, Limits, Setpoints, unit_of_axis

if TYPE_CHECKING:
    from scipy.interpolate import KroghInterpolator

#: A tool axis nearer to the axis of the last rotary joint than this, rad, is at the pole: the joint may turn anyhow.
POLE = 1e-5
#: A tool axis that is nowhere further from the pole than this, rad, is upright.
UPRIGHT = 1e-9
#: Places at the pole nearer than this share of the path are one.
APART = 1e-3
#: How far from the pole, rad, the window ends in which a joint passes it by a polynomial; and how far the tool axis may
#: be off there, rad.
PASS, OFF_AXIS, SAMPLES_OF_PASS = 1e-2, 2e-10, 65
#: Most turn of the last rotary joint from one sample to the next, rad; halvings until it is that; and samples at most.
SAMPLE_TURN, HALVINGS, MOST_SAMPLES = 0.5, 48, 2_000_000
#: Golden section, and the steps that bring it from one sample to rounding.
GOLDEN, SECTIONS = 0.5 * (5.0**0.5 - 1.0), 60
#: ... as a share of the path: a place found so that is nearer to a knot is the knot.
FOUND = 1e-7
#: The tool axis is looked at closely where it comes nearer to the pole than this, rad: joints turn fast there.
NEAR_POLE = 0.1
#: A path in joints turns sharply where a joint's r' jumps by more than this share of the largest one: it stops there.
KINK = 1e-6
#: How far beside a joint of curves derivatives are taken, as a share of the path.
BESIDE = 1e-9
#: Travel is left by more than this, mm or rad: rounding is not.
LEFT = 1e-9
#: Places beside the sample at which a joint is furthest, at which it is looked at once more.
CLOSER = 257
#: Places along a path at which its joints are looked at to see which of them move.
LOOKED = 257
#: What rounding of a joint may come to, in units of its last place; slopes of joints count where the tip moves by more
#: than this share of its longest step.
ROUNDINGS, MOVING = 8.0, 0.01

#: A picture shows the tool axis so long, as a share of the path's size.
DRAWN = 0.2

Pass = tuple[float, float, "KroghInterpolator"]
"""Arc lengths, mm, between which the last joint passes the pole, and its polynomial there."""


class JointPath(Track):
    """The joints of a machine along a tool path, continuous, as functions of the tip's arc length.

    Parameters
    ----------
    tool : ToolPath
        Tip and tool axis.
    kinematics : Kinematics
        Of the machine.
    travel : mapping of str to (float, float), optional
        Least and greatest position of joints, mm or rad: the turns of rotary joints are chosen inside it.
    start : mapping of str to float, optional
        Where the rotary joints are before, rad: the turn nearest to it is taken. 0 by default.

    Raises
    ------
    InputError
        For a path without a tool axis, and a joint that the machine does not have.
    CurveError
        Where the tool turns off at the pole, or tilts and the machine cannot.
    LimitsError
        Where it leaves the travel of a joint: with the joint, the place and how to fix it.

    Notes
    -----
    Of the two ways to turn to a tool axis, and all whole turns of the last joint, one is taken for the whole path: the
    nearest to `start` that stays inside the travel. Near the pole, where the tool axis is the axis of the last joint,
    that turns fast, and its limits slow the tip down. A path that goes straight through the pole tilts on to the other
    side, and no joint turns fast; where the tool stays at the pole for a while, the joint turns meanwhile.

    References
    ----------
    .. [1] docs/how-to/five-axis.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> tip = sf.NurbsCurve.bezier([[0, 0, 0], [10, 0, 0]])
    >>> axis = sf.NurbsCurve.bezier([[0, 0, 20], [15, 0, 20]])  # points on the tool axis
    >>> path = sf.kinematics.JointPath(sf.ToolPath(tip, axis), sf.Machine.load("trunnion").kinematics)
    >>> path.axes
    ('x', 'y', 'z', 'a', 'c')
    >>> path([0.0, 10.0]).shape
    (2, 5)
    """

    beside = ("tip.x", "tip.y", "tip.z")

    def __init__(
        self,
        tool: ToolPath,
        kinematics: Kinematics,
        *,
        travel: Mapping[str, tuple[float, float]] | None = None,
        start: Mapping[str, float] | None = None,
    ) -> None:
        if not isinstance(tool, ToolPath):
            raise InputError(f"a JointPath needs a ToolPath; this is a {type(tool).__name__}: give its tool axis too")
        if tool.tool_length is not None and "tool-offset" in kinematics.lengths:
            kinematics = replace(kinematics, lengths={**kinematics.lengths, "tool-offset": tool.tool_length})
        self.tool, self.kinematics = tool.with_joints(kinematics.joints[kinematics.linear :]), kinematics
        self.axes, self.linear = kinematics.joints, kinematics.linear
        self.name = tool.name
        self.travel = dict(travel or {})
        for name in {**self.travel, **(start or {})}:
            if name not in self.axes:
                raise InputError(f"{name}: {kinematics.kind} has no such joint; it has {', '.join(self.axes)}")
        self._start = np.array([(start or {}).get(name, 0.0) for name in self.axes[self.linear :]])
        self._fixed: Array | None = None  # where the rotary joints stay all along
        self._passes: tuple[Pass, ...] = ()  # windows in which a joint passes the pole
        self._s, self._turns = np.zeros(0), np.zeros(0)  # the last joint at samples, without jumps of whole turns
        self._dips = np.zeros(0)  # arc lengths where the tool axis is nearest to the pole
        self._choose()
        self.check_travel(self.travel)

    # --- where it is ------------------------------------------------------------------------------------------------

    def __call__(self, s: ArrayLike) -> Array:
        """Return the joints at arc lengths of the tip.

        Parameters
        ----------
        s : (...) array_like
            Arc lengths, mm.

        Returns
        -------
        (..., joints) array
            mm and rad.
        """
        values = np.asarray(s, dtype=np.float64)
        curve, u = self.tool.locate(values.ravel())
        return self.joints(curve, u, values.ravel()).reshape(*values.shape, len(self.axes))

    @property
    def tip_path(self) -> ToolPath:
        """The path of the tool tip."""
        return self.tool

    @property
    def length(self) -> float:
        """Arc length of the tip, mm."""
        return self.tool.length

    @property
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Where the tool waits and how long, (mm, s), in order."""
        return self.tool.dwells

    def drawn(self, places: int) -> Array | None:
        """Return the tool axis as lines from the tip, evenly along the path, for a picture.

        Parameters
        ----------
        places : int
            How many lines.

        Returns
        -------
        (places, 2, 3) array
            Both ends of each line, mm.
        """
        s = np.linspace(0.0, self.length, places)
        tip, axis = self.kinematics.forward(self(s))
        return np.stack([tip, tip + DRAWN * max(self.tool.size, 1e-9) * axis], axis=1)

    @property
    def tip_columns(self) -> slice:
        """The tip's coordinates are behind the joints."""
        return slice(len(self.axes), len(self.axes) + len(self.beside))

    @cached_property
    def weights(self) -> Array:
        """Only the tip counts, (joints + 3,)."""
        return np.repeat([0.0, 1.0], [len(self.axes), len(self.beside)])

    @property
    def pieces(self) -> Array:
        """Start and breaks, mm."""
        return np.append(0.0, self.breaks)

    def lengths_of(self, setpoints: Setpoints) -> Array:
        """Return the length along the path at setpoints: their s, the arc length of the tip.

        Parameters
        ----------
        setpoints : Setpoints
            Of this path.

        Returns
        -------
        (n,) array
            mm.
        """
        return setpoints.s

    def positions(self, curve: IntArray, u: Array, s: Array, tip: Array) -> Array:
        """Return the joints where the tip is at places of its curves.

        Parameters
        ----------
        curve : (n,) array of int
            Index of the tip's curve.
        u : (n,) array
            Its parameter.
        s : (n,) array
            Arc length of the tip, mm.
        tip : (n, 3) array
            Where the tip is, mm; not read.

        Returns
        -------
        (n, joints) array
            mm and rad.
        """
        return self.joints(curve, u, s)

    def joints(self, curve: IntArray, u: Array, s: Array) -> Array:
        """Return the joints at parameters of the tip's curves.

        Parameters
        ----------
        curve : (n,) array of int
            Index of the tip's curve.
        u : (n,) array
            Its parameter.
        s : (n,) array
            Arc length of the tip, mm.

        Returns
        -------
        (n, joints) array
            mm and rad.
        """
        return np.stack([jet.value for jet in self._jets(curve, u, s, 0)[3:]], axis=1)

    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """Return joints and tip and their first three derivatives by arc length.

        Parameters
        ----------
        s : (n,) array
            Arc lengths of the tip, mm.
        row : (n,) array of int, optional
            Not read; see `Track.derivatives`.

        Returns
        -------
        (n, 4, joints + 3) array
            mm and rad per mm^k; the tip's x, y, z behind the joints.
        """
        curve, u = self.tool.locate(s)
        jets = self._jets(curve, u, s, 3)
        return np.stack([np.moveaxis(jet.derivatives, 0, 1) for jet in (*jets[3:], *jets[:3])], axis=2)

    def _jets(self, curve: IntArray, u: Array, s: Array, order: int) -> tuple[Jet, ...]:
        """Tip and joints as jets by arc length, (3 + joints,); of order 0 or 3."""
        tip = self.tool.evaluate(curve, u, order)
        if self.tool.columns:
            tip = np.concatenate([tip, self.tool.orientation(curve, u, order)], axis=2)
        if order:
            tip = by_arc_length(tip, 3)
        each = [Jet.of_derivatives(np.ascontiguousarray(tip[:, :, k].T)) for k in range(tip.shape[2])]
        turns = self._rotary(tuple(each[3:]), s, each[0])
        tip_jets = each[0], each[1], each[2]
        slides = self.kinematics.slides(tip_jets, turns)
        return *tip_jets, *(as_jet(q, each[0]) for q in slides), *turns

    def _rotary(self, given: tuple[Jet, ...], s: Array, like: Jet) -> tuple[Jet, ...]:
        if self._fixed is not None:
            return tuple(as_jet(value, like) for value in self._fixed)
        if self.tool.kind == ANGLES:
            return given
        axis = _unit(given)
        with np.errstate(divide="ignore", invalid="ignore"):  # at the pole itself there is no direction
            turn = self.kinematics.turn(axis)
        near = np.interp(s, self._s, self._turns)
        turn = turn + math.pi * np.round((near - turn.value) / math.pi)
        for low, high, through in self._passes:
            inside = np.flatnonzero((s >= low) & (s <= high))
            if len(inside):
                turn.c[:, inside] = Jet.of_derivatives(through.derivatives(s[inside], len(turn.c))).c
        return self.kinematics.tilted(axis, turn), turn

    # --- what it is as a `Track` ------------------------------------------------------------------------------------

    @cached_property
    def breaks(self) -> Array:
        """Arc lengths (k,) strictly inside, mm: knots and joints of tip and tool axis, corners, nearest to the pole."""
        tool = self.tool
        places = [tool.curve_starts[1:-1], tool.corners.s]
        for i, curve in enumerate(tool._joined):
            knots = curve.breaks if tool.tool_axis is None else np.union1d(curve.breaks, tool.tool_axis[i].breaks)
            places.append(tool.arc_length(np.full(len(knots), i), knots))
        s = np.unique(np.concatenate(places))
        k = np.clip(np.searchsorted(s, self._dips), 1, len(s) - 1)
        own = np.minimum(self._dips - s[k - 1], s[k] - self._dips) > FOUND * self.length
        s = np.unique(np.concatenate([s, self._dips[own], self._own_breaks]))
        s = s[s < self.length - RESOLUTION]
        return s[np.diff(s, prepend=0.0) > RESOLUTION]

    @property
    def _own_breaks(self) -> Array:
        """Arc lengths, mm, where something else than tip and tool axis may have jumps of derivatives."""
        return np.zeros(0)

    @cached_property
    def stops(self) -> tuple[float, ...]:
        """Arc lengths strictly inside, mm, at which the tool must rest: those of the tip, and kinks of a joint."""
        away = BESIDE * self.length
        b = self.breaks[(self.breaks > away) & (self.breaks < self.length - away)]
        if not len(b):
            return self.tool.stops
        before, after = (self.derivatives(b + way)[:, :, : len(self.axes)] for way in (-away, away))
        first = np.concatenate([before[:, 1], after[:, 1]])
        own = away * (np.abs(before[:, 2]) + np.abs(after[:, 2]))  # how far r' goes by itself from one to the other
        unit = np.where(np.arange(len(self.axes)) < self.linear, 1.0, 1.0 / self.length)  # less is a joint that stays
        least = KINK * np.maximum(np.max(np.abs(first), axis=0), unit) + 3.0 * own
        kinks = b[np.any(np.abs(after[:, 1] - before[:, 1]) > least, axis=1)]
        near = np.array(self.tool.stops)
        far = [s for s in kinks.tolist() if not np.any(np.abs(near - s) <= 2.0 * away)]
        return tuple(sorted([*self.tool.stops, *far]))

    @property
    def reach(self) -> tuple[Array, Array]:
        """Least and greatest position of each joint at places along the path, (joints,) each, mm or rad."""
        places = self(np.linspace(0.0, self.length, LOOKED))
        return places.min(axis=0), places.max(axis=0)

    def check_limits(self, limits: Limits) -> None:
        """Check that the limits are of a kind that joints can have.

        Parameters
        ----------
        limits : Limits
            Of the motion.

        Raises
        ------
        LimitsError
            For steps of velocity at corners.
        """
        if limits.axis_velocity_step is not None:
            raise LimitsError("axis_velocity_step: a tool stops at the corners of its path; leave it out")

    def chords(self, s: Array, r: Array, places: Array) -> tuple[IntArray, Array, Array]:
        """Measure how far tip and tool axis are off halfway between setpoints of the joints.

        Parameters
        ----------
        s : (n + 1,) array
            Arc lengths of the tip, mm.
        r : (n + 1, joints) array
            Joints there, mm and rad.
        places : (n + 1, axes) array
            Not read; see `Track.chords`.

        Returns
        -------
        steps : (n,) array of int
            All steps, by number.
        off : (n,) array
            Of the tip, mm.
        turned : (n,) array
            Of the tool axis, rad.
        """
        tip, axis = self.kinematics.forward(0.5 * (r[1:] + r[:-1]))
        middle = 0.5 * (s[1:] + s[:-1])
        d = self.tool.evaluate(*self.tool.locate(middle), 1)
        away, tangent = tip - d[:, 0], d[:, 1] / np.linalg.norm(d[:, 1], axis=1)[:, None]
        ahead = np.sum(away * tangent, axis=1)
        _, wanted = self.kinematics.forward(self(np.clip(middle + ahead, 0.0, self.length)))
        off = np.linalg.norm(away - ahead[:, None] * tangent, axis=1)
        return np.arange(len(s) - 1), off, np.linalg.norm(axis - wanted, axis=1)

    def rounding(self, s: Array, r: Array) -> Array:
        """Estimate the rounding of joints, eps (|q| + |dq/ds| L).

        Parameters
        ----------
        s : (n,) array
            Arc lengths of the tip, mm.
        r : (n, joints) array
            Joints there, mm and rad.

        Returns
        -------
        (joints,) array
            mm and rad.
        """
        moved = np.diff(s)
        moving = moved > MOVING * np.max(moved, initial=0.0)
        steep = np.max(np.abs(np.diff(r, axis=0)[moving]) / moved[moving, None], axis=0, initial=0.0)
        return np.asarray(ROUNDINGS * np.finfo(float).eps * (np.max(np.abs(r), axis=0) + steep * self.length))

    def between_ticks(self, d: Array) -> tuple[Array, Array]:
        """Return the curvatures that leave tip and tool axis off between setpoints.

        Parameters
        ----------
        d : (n, 4, joints + 3) array
            What `derivatives` returns.

        Returns
        -------
        tip : (n,) array
            1/mm.
        axis : (n,) array
            rad/mm^2.

        Notes
        -----
        Joints that move straight from r to r + r' h move the tip on a curve of its own, with second derivative c; the
        tip's is r''. So a step h leaves the tip off by h^2 / 8 |r'' - c|, across the path: along it the tip is ahead by
        t (r'' - c) h^2 / 8. The tool axis k is off that of the place where the tip is by
        h^2 / 8 |k'' - c_k - (t (r'' - c)) k'|, likewise.
        """
        tip, joints = d[:, 1, self.tip_columns], np.moveaxis(d[:, :3, : len(self.axes)], 0, 1)
        straight = joints.copy()
        straight[2] = 0.0
        own, path = (self._forward(each) for each in (straight, joints))
        off, turned = path[2] - own[2], path[1, :, 3:]
        ahead = np.sum(off[:, :3] * tip, axis=1)[:, None]
        across = off[:, :3] - ahead * tip
        return np.linalg.norm(across, axis=1), np.linalg.norm(off[:, 3:] - ahead * turned, axis=1)

    def _forward(self, joints: Array) -> Array:
        """Tip and tool axis with two derivatives, (3, n, 6), of joints that have them, (3, n, joints)."""
        q = tuple(Jet.of_derivatives(joints[:, :, k]) for k in range(joints.shape[2]))
        parts = *self.kinematics.tip(q), *self.kinematics.axis(q[self.linear :])
        return np.stack([as_jet(part, q[0]).derivatives for part in parts], axis=2)

    # --- the turns of rotary joints ---------------------------------------------------------------------------------

    def _choose(self) -> None:
        tool, rotary = self.tool, self.kinematics.rotary
        if tool.kind == ANGLES and tool.columns:
            if tool.columns != rotary:
                raise CurveError(
                    f"the tool path gives {tool.columns} rotary angle(s), {self.kinematics.kind} has {rotary}; give "
                    "points or vectors of the tool axis, or the angles of this machine"
                )
            return
        tilt = 0.0
        if tool.columns:
            curve, u = tool.samples
            away = self._from_pole(curve, u)
            if rotary == 2 and np.max(away) > UPRIGHT:
                self._unwind(curve, u, away)
                return
            down = tool.orientation(curve, u)[:, 0, 2] < 0.0
            tilts = np.where(down, math.pi - away, away)
            k = int(np.argmax(tilts))
            tilt = math.pi if down[k] else 0.0
            if rotary < 2 and tilts[k] > UPRIGHT:
                place = tool.place(float(tool.arc_length(curve[k], u[k])))
                raise CurveError(
                    f"the tool axis tilts by {math.degrees(tilts[k]):.3g} deg at {place}; {self.kinematics.kind} "
                    "cannot tilt the tool: choose a machine with two rotary joints"
                )
        # upright all along, or upside down: the joint that turns about the tool stays where it is, inside its travel
        ends = [self.travel.get(name, (-math.inf, math.inf)) for name in self.axes[self.linear :]]
        fixed = [min(max(at, low), high) for at, (low, high) in zip(self._start, ends, strict=True)]
        if rotary == 2:
            fixed[0] = -tilt if ends[0][1] < tilt else tilt
        self._fixed = np.array(fixed)

    def _from_pole(self, curve: IntArray, u: Array) -> Array:
        """Angle between tool axis and the axis of the last rotary joint, either way along it, rad, (n,)."""
        k = self.tool.orientation(curve, u)[:, 0]
        return np.asarray(np.arctan2(np.hypot(k[:, 0], k[:, 1]), np.abs(k[:, 2])))

    def _turn_at(self, curve: IntArray, u: Array) -> Array:
        """The last rotary joint, rad, within a turn, (n,)."""
        k = self.tool.orientation(curve, u)[:, 0].T
        return np.asarray(self.kinematics.turn((Jet(k[:1]), Jet(k[1:2]), Jet(k[2:]))).value)

    def _unwind(self, curve: IntArray, u: Array, away: Array) -> None:
        """Follow the last rotary joint along samples, halved until it turns little between them."""
        low = np.flatnonzero((away[1:-1] <= away[:-2]) & (away[1:-1] <= away[2:]))
        low = low[(curve[low] == curve[low + 1]) & (curve[low + 2] == curve[low + 1])] + 1
        left, right, owner = u[low - 1], u[low + 1], curve[low]
        for _ in range(SECTIONS if len(low) else 0):
            a, b = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
            lower = self._from_pole(owner, a) <= self._from_pole(owner, b)
            left, right = np.where(lower, left, a), np.where(lower, b, right)
        nearest = 0.5 * (left + right)
        at, whole = np.append(curve, owner), np.append(u, nearest)
        order = np.lexsort((whole, at))
        curve, u = at[order], whole[order]
        away, s = self._from_pole(curve, u), self.tool.arc_length(curve, u)
        if len(low):
            near = self._from_pole(owner, nearest) < NEAR_POLE
            self._dips = self.tool.arc_length(owner[near], nearest[near])
        stays = self._at_pole(s, away)
        at_pole = np.array([0.5 * (first + last) for first, last in stays])
        turnable = np.array([*(last - first > RESOLUTION for first, last in stays), False])  # there it may turn anyhow
        for first, last in stays:
            self._dips = self._dips[(self._dips < first) | (self._dips > last)]
        clear = away >= POLE
        if not np.any(clear):
            self._refuse_pole(0.0)
        curve, u, s = curve[clear], u[clear], s[clear]
        turn = self._turn_at(curve, u)
        for _ in range(HALVINGS):
            before = np.searchsorted(at_pole, s)
            through, anyhow = np.diff(before) > 0, turnable[before[:-1]]
            whole_turn = np.where(through, math.pi, 2.0 * math.pi)  # through the pole it may be half a turn further
            step = (np.diff(turn) + 0.5 * whole_turn) % whole_turn - 0.5 * whole_turn
            turns = (np.abs(step) > SAMPLE_TURN) & ~(through & anyhow)
            more = np.flatnonzero(turns & (np.diff(curve) == 0) & (np.diff(u) > 0.0))
            if not len(more):
                break
            if len(u) + len(more) > MOST_SAMPLES or np.any(through[more]):
                self._refuse_pole(float(s[more[0]]))
            middle = 0.5 * (u[more] + u[more + 1])
            turn = np.insert(turn, more + 1, self._turn_at(curve[more], middle))
            u, curve = np.insert(u, more + 1, middle), np.insert(curve, more + 1, curve[more])
            s = self.tool.arc_length(curve, u)
        self._s = s
        self._take_turn(np.concatenate([turn[:1], turn[0] + np.cumsum(step)]), curve, u)
        self._passes = tuple(window for each in stays for window in self._pass(*each))

    def _at_pole(self, s: Array, away: Array) -> list[tuple[float, float]]:
        """From where to where, mm, the tool is at the pole; often one place."""
        found = np.flatnonzero(away < POLE)
        if not len(found):
            return []
        ends = np.flatnonzero((np.diff(found) > 1) & (np.diff(s[found]) > APART * self.length)) + 1
        return [(float(s[group[0]]), float(s[group[-1]])) for group in np.split(found, ends)]

    def _pass(self, first: float, last: float) -> tuple[Pass, ...]:
        """Return windows of arc length, mm, in which the last joint passes the pole at first to last, as polynomials.

        So near to the pole the direction of k_xy is lost in rounding. The joint goes on as the polynomial of degree 7
        that has its value and three derivatives at both ends of a window. Where the tool stays, and at an end of the
        path, each side goes on as that of degree 3, and what is between them is turned while the tool is at the pole.
        CurveError where that leaves the tool axis by more than OFF_AXIS.
        """
        from scipy.interpolate import KroghInterpolator

        def through(*places: float, d: Array) -> KroghInterpolator:
            return KroghInterpolator(np.repeat(places, 4), d.ravel())

        ends = (0.0, self.length)
        for k in range(3, HALVINGS):
            reach = 0.5**k * self.length
            sides = (max(first - reach, 0.0), min(last + reach, self.length))
            inner = [s for s, end in zip(sides, ends, strict=True) if s != end]
            rho = self._from_pole(*self.tool.locate(inner))
            if not inner or np.max(rho) > PASS:
                continue
            if np.min(rho) < 1e-2 * PASS:
                break
            d = self.derivatives(np.array(inner))[:, :, len(self.axes) - 1]
            found: tuple[Pass, ...] = ((*sides, through(*inner, d=d)),)
            if len(inner) == 2 and last - first > RESOLUTION:
                left, right = through(inner[0], d=d[0]), through(inner[1], d=d[1])
                between = np.array([left.derivatives(first, 4), right.derivatives(last, 4)])
                found = (sides[0], first, left), (last, sides[1], right), (first, last, through(first, last, d=between))
            places = np.linspace([sides[0], first, last], [first, last, sides[1]], SAMPLES_OF_PASS, axis=1)
            if self._off_axis(places.ravel(), found) <= OFF_AXIS:
                return found
        self._refuse_pole(first)

    def _off_axis(self, s: Array, windows: tuple[Pass, ...]) -> float:
        """How far the tool axis is from that of the path at s (n,) in windows, rad."""
        self._passes = windows
        curve, u = self.tool.locate(s)
        _, axis = self.kinematics.forward(self.joints(curve, u, s))
        self._passes = ()
        wanted = self.tool.orientation(curve, u)[:, 0]
        return float(np.max(np.linalg.norm(axis - wanted / np.linalg.norm(wanted, axis=1)[:, None], axis=1)))

    def _take_turn(self, turn: Array, curve: IntArray, u: Array) -> None:
        """Take the solution that leaves the travel of joints least, among those inside it the nearest to the start."""
        k = self.tool.orientation(curve, u)[:, 0].T
        axis, tip = (Jet(k[:1]), Jet(k[1:2]), Jet(k[2:])), self.tool.evaluate(curve, u, 0)[:, 0].T
        ends = np.array([self.travel.get(name, (-math.inf, math.inf)) for name in self.axes])
        found = []
        for half in (0.0, math.pi):
            turns = turn + half
            tilts = self.kinematics.tilted(axis, Jet(turns[None])).value
            slides = self.kinematics.slides((tip[0], tip[1], tip[2]), (tilts, turns))
            joints = np.stack([*(np.asarray(each) for each in slides), tilts, turns])
            first = round((self._start[1] - turns[0]) / (2.0 * math.pi))
            possible = {first - 1, first, first + 1}
            if self.axes[-1] in self.travel:
                possible |= {
                    math.ceil((ends[-1, 0] - LEFT - np.min(turns)) / (2.0 * math.pi)),
                    math.floor((ends[-1, 1] + LEFT - np.max(turns)) / (2.0 * math.pi)),
                }
            for by in (2.0 * math.pi * whole for whole in possible):
                joints[-1] = turns + by
                beyond = float(np.max(np.maximum(ends[:, :1] - joints, joints - ends[:, 1:])))
                cost = float(abs(tilts[0] - self._start[0]) + abs(turns[0] + by - self._start[1]))
                found.append((max(beyond, LEFT), cost, half + by))
        self._turns = turn + min(found)[2]

    def _refuse_pole(self, s: float) -> NoReturn:
        names = self.axes[self.linear :]
        raise CurveError(
            f"at {self.tool.place(s)} the tool axis is that of joint {names[1]} (within {POLE:g} rad) and turns off "
            "there, so that the joint would have to turn at once; tilt the workpiece or the tool axis a little, or "
            f"give the angles of {' and '.join(names)}"
        )

    def check_travel(self, travel: Mapping[str, tuple[float, float]]) -> None:
        """Check that every joint stays inside its travel.

        Parameters
        ----------
        travel : mapping of str to (float, float)
            Least and greatest position by joint, mm or rad.

        Raises
        ------
        LimitsError
            Where a joint leaves it: which, how far, and where on the path.
        """
        if not travel:
            return
        s = np.unique(np.concatenate([self.tool.arc_length(*self.tool.samples), self._s, self._dips]))
        joints = self(s)
        for k, name in enumerate(self.axes):
            if name not in travel:
                continue
            low, high = travel[name]
            worst = int(np.argmax(np.maximum(low - joints[:, k], joints[:, k] - high)))
            near = s[[max(worst - 1, 0), min(worst + 1, len(s) - 1)]]
            closer = np.append(np.linspace(near[0], near[1], CLOSER), s[worst])  # the extreme lies between samples
            beyond = self(closer)[:, k]
            out = np.maximum(low - beyond, beyond - high)
            if np.max(out) > LEFT:
                unit, factor = unit_of_axis(name), 180.0 / math.pi if name in ROTARY_AXES else 1.0
                reached = np.append(joints[:, k], beyond)
                ends = reached.min(), reached.max(), low, high
                least, most, bottom, top = (f"{factor * end:.6g}" for end in ends)
                place = self.tool.place(float(closer[np.argmax(out)]))
                raise LimitsError(
                    f"travel.{name}: the path takes joint {name} from {least} to {most} {unit}, most at {place}; its "
                    f"travel is {bottom} to {top} {unit}; mount the workpiece elsewhere or split the path"
                )

    def __repr__(self) -> str:
        return f"JointPath({self.name!r}, {self.kinematics.kind}, joints {' '.join(self.axes)}, {self.length:.6g} mm)"


def _unit(v: tuple[Jet, ...]) -> tuple[Jet, Jet, Jet]:
    x, y, z = v
    size = root(x * x + y * y + z * z)
    return x / size, y / size, z / size
