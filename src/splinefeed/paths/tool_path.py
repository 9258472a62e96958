"""ToolPath: where the tool tip moves on the workpiece, and how the tool axis stands at the same parameter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import Flat
from splinefeed.curves.pieces import Pieces
from splinefeed.curves.tables import span_pieces
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray

#: What the second curve of a tool path can be.
POINTS, VECTORS, ANGLES = "points", "vectors", "angles"
#: A tool axis from points nearer to the tip than this, mm, or of shorter vectors, has no direction.
SHORTEST = 1e-6
#: A tool axis that differs by more than this between neighbouring curves, rad, jumps.
JUMP = 1e-6
#: Places are given to the resolution of geometry, 1 nm: below that is rounding.
PLACE_DECIMALS = 6
#: Places of each knot span at which the tool axis is looked at.
SAMPLES = 33
#: Ends of parameters further apart than this, as a share of the domain, are different ones.
SAME_DOMAIN = 1e-12


class ToolPath(Path):
    """The path of a tool tip, and the tool axis along it: a `Path` of x, y, z that knows how the tool stands.

    Parameters
    ----------
    tip : NurbsCurve, iterable of NurbsCurve, or Path
        Of (n, 3) control points, mm: x, y, z; coordinates of the workpiece.
    axis : NurbsCurve, iterable of NurbsCurve, or sequence of float, optional
        As many curves, each over the parameters of its tip curve; numbers for a tool axis that stays as it is (one
        vector, or angles); None for a tool that stands upright, along z.
    kind : str, optional
        "points" on the tool axis, mm, from which the tip is taken; "vectors" from the tip to the spindle, of any
        length; "angles" of the rotary joints of a machine, rad, as they are programmed.
    rotary : sequence of str, optional
        Names of the joints that the columns of "angles" are; those of the machine, in order, if none is given.
    tool_length : float, optional
        mm, by the table of tools that the program goes with; None for that of the machine.
    **said : object
        name, feeds, markers, lines, ... as for `Path`, taken from the tip where that is a Path.

    Raises
    ------
    CurveError
        For a tip that has other axes, for curves that do not belong together, and for a tool axis of no length, with
        the place.

    Notes
    -----
    A machine makes joints of it: `JointPath(tool_path, kinematics)`.

    References
    ----------
    .. [1] docs/how-to/five-axis.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> tip = sf.NurbsCurve.bezier([[0, 0, 0], [20, 25, 0], [40, -15, 2], [60, 10, 2]])
    >>> axis = sf.NurbsCurve.bezier([[-5, 3, 20], [16, 30, 20], [42, -8, 22], [66, 15, 22]])
    >>> sf.ToolPath(tip, axis, kind="points").axes
    ('x', 'y', 'z')
    """

    _tied = needs_machine = True

    def __init__(
        self,
        tip: NurbsCurve | Iterable[NurbsCurve] | Path,
        axis: NurbsCurve | Iterable[NurbsCurve] | Sequence[float] | None = None,
        *,
        kind: str = POINTS,
        rotary: Sequence[str] = (),
        tool_length: float | None = None,
        **said: Any,
    ) -> None:
        if kind not in (POINTS, VECTORS, ANGLES):
            raise InputError(f"kind is {kind!r}; choose {POINTS!r}, {VECTORS!r} or {ANGLES!r}")
        if isinstance(tip, Path):
            said = {**tip._said(), **said}
            if tip.axes != ("x", "y", "z"):
                raise CurveError(f"the tool tip has axes {', '.join(tip.axes)}; x, y, z are needed")
            tip = tip._joined
        curves = (tip,) if isinstance(tip, NurbsCurve) else tuple(tip)
        self.kind = kind
        self.rotary = tuple(rotary)
        self.tool_length = None if tool_length is None else float(tool_length)
        self.tool_axis: tuple[NurbsCurve, ...] | None = None
        if axis is not None:
            self.tool_axis = _curves_of_axis(axis, curves, kind)
            _check_axis(curves, self.tool_axis, kind)
        for i, curve in enumerate(curves):
            if isinstance(curve, NurbsCurve) and curve.axes != 3:
                raise CurveError(f"tip curve {i} has {curve.axes} axes; a tool tip has 3: x, y, z")
        if self.rotary and (self.tool_axis is None or kind != ANGLES or len(self.rotary) != self.tool_axis[0].axes):
            raise CurveError(f"rotary is {', '.join(self.rotary)}; name the columns of a tool axis of angles, one each")
        super().__init__(curves, ("x", "y", "z"), **said)
        if self.tool_axis is not None and kind != ANGLES:
            _check_length(self)
        if self.tool_axis is not None and len(self.tool_axis) > 1:
            _check_joined(self)

    def __reduce__(self) -> tuple[object, ...]:
        return partial(ToolPath, **self._all_said()), (tuple(self.curves), self.tool_axis)

    def _all_said(self) -> dict[str, Any]:
        own = {"kind": self.kind, "rotary": self.rotary, "tool_length": self.tool_length}
        return {**self._said(), **own}

    def place(self, s: float) -> str:
        """Say where the tip is, with the line of the program, where there is one.

        Parameters
        ----------
        s : float
            Arc length, mm.

        Returns
        -------
        str
            In words.
        """
        curve = min(max(int(np.searchsorted(self.curve_starts, s)) - 1, 0), len(self.curves) - 1)
        line = "" if self.lines is None else f" (line {self.lines[curve]})"
        return f"s = {round(s, PLACE_DECIMALS):.6g} mm{line}"

    def with_joints(self, names: Sequence[str]) -> ToolPath:
        """Name the rotary joints of the angles.

        Parameters
        ----------
        names : sequence of str
            The joints of a machine.

        Returns
        -------
        ToolPath
            The same, its angles those of these joints, which are 0 where none is given.

        Raises
        ------
        CurveError
            For angles of a joint that is not among them, unless they are 0, with the line.
        """
        names = tuple(names)
        if self.tool_axis is None or self.kind != ANGLES or not self.rotary or self.rotary == names:
            return self
        for k, name in enumerate(self.rotary):
            used = [i for i, curve in enumerate(self.tool_axis) if np.any(curve.control_points[:, k] != 0.0)]
            if name not in names and used:
                there = ", ".join(names).upper() or "none"
                place = self.place(float(np.mean(self.curve_starts[used[0] : used[0] + 2])))
                raise CurveError(
                    f"at {place} the tool path turns {name.upper()}, a rotary axis that the machine does not have; it "
                    f"has {there}: choose the machine that the program is for"
                )
        at = [self.rotary.index(name) if name in self.rotary else -1 for name in names]
        axes = []
        for curve in self.tool_axis:
            points = np.column_stack([curve.control_points, np.zeros(len(curve.control_points))])[:, at]
            axes.append(beside(curve, points))
        said = {**self._all_said(), "rotary": names}
        return ToolPath(self.curves, axes, **said) if names else ToolPath(self.curves, **said)

    @cached_property
    def columns(self) -> int:
        """Numbers by which the tool axis is given: 3, of angles 1 or 2, and 0 where it is upright."""
        return 0 if self.tool_axis is None else self.tool_axis[0].axes

    def orientation(self, curve: IntArray, u: Array, order: int = 0) -> Array:
        """Compute what stands for the tool axis, and its derivatives by u.

        Parameters
        ----------
        curve : (n,) array of int
            Indices of curves.
        u : (n,) array
            Parameters on them.
        order : int, optional
            Of the highest derivative.

        Returns
        -------
        (n, order + 1, columns) array
            Of points the vector from the tip, mm; vectors and angles as they are given.
        """
        assert self.tool_axis is not None
        if len(self.tool_axis) == 1:
            out = self.tool_axis[0].derivatives(u, order)
        else:
            out = self._axis_pieces.evaluate(curve, u, order, False)
        return out - self.evaluate(curve, u, order) if self.kind == POINTS else out

    @cached_property
    def _axis_pieces(self) -> Pieces:
        assert self.tool_axis is not None
        flat = Flat.of(self.tool_axis)
        return span_pieces(flat, (int(flat.degrees.max()), self.columns, self.columns, int(flat.rational.max())))

    @cached_property
    def samples(self) -> tuple[IntArray, Array]:
        """Curve and parameter (n,) of places that are dense on every span of tip and tool axis, in order."""
        found = []
        for i, curve in enumerate(self._joined):
            knots = curve.breaks if self.tool_axis is None else np.union1d(curve.breaks, self.tool_axis[i].breaks)
            u = knots[:-1, None] + np.diff(knots)[:, None] * np.linspace(0.0, 1.0, SAMPLES)[:-1]
            u = np.append(u.ravel(), knots[-1])
            found.append((np.full(len(u), i), u))
        return np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])

    def reversed(self) -> Path:
        """The same path traversed from its end to its start, the tool axis turned with it."""
        back = super().reversed()
        axis = None if self.tool_axis is None else [curve.reversed() for curve in reversed(self.tool_axis)]
        said = {**self._all_said(), **back._said()}
        return ToolPath(back.curves, axis, **said)


def beside(curve: NurbsCurve, points: Array) -> NurbsCurve:
    """Lay a curve over the knots and weights of another one.

    Parameters
    ----------
    curve : NurbsCurve
        The other one.
    points : (n, columns) array
        Its control points, as many; they may all be one.

    Returns
    -------
    NurbsCurve
        The curve.
    """
    return NurbsCurve.trusted(curve.degree, curve.knots, points, curve.weights, clamped=curve.clamped)


def _curves_of_axis(
    axis: NurbsCurve | Iterable[NurbsCurve] | Sequence[float], tip: Sequence[NurbsCurve], kind: str
) -> tuple[NurbsCurve, ...]:
    """The curves of a tool axis; numbers stand for one that stays as it is."""
    given = (axis,) if isinstance(axis, NurbsCurve) else tuple(axis)
    if not given or any(isinstance(each, NurbsCurve) or not np.isscalar(each) for each in given):
        return given  # type: ignore[return-value]  # _check_axis looks at each
    if kind == POINTS:
        raise InputError(f"the tool axis is {list(given)}: give kind='{VECTORS}' or kind='{ANGLES}' with numbers")
    row = np.array(given, dtype=float)
    if not np.all(np.isfinite(row)):
        raise CurveError(f"the tool axis is {list(given)}; give finite numbers")
    return tuple(beside(curve, np.tile(row, (len(curve.control_points), 1))) for curve in tip)


def _check_axis(tip: Sequence[NurbsCurve], axis: Sequence[NurbsCurve], kind: str) -> None:
    """CurveError unless the curves of the tool axis are as many as those of the tip, over the same parameters."""
    if len(axis) != len(tip):
        raise CurveError(f"the tool axis has {len(axis)} curves and the tip has {len(tip)}; give one for each")
    wanted = (1, 2) if kind == ANGLES else (3,)
    for i, (one, other) in enumerate(zip(tip, axis, strict=True)):
        if not isinstance(other, NurbsCurve):
            raise CurveError(f"curve {i} of the tool axis is a {type(other).__name__}; expected a NurbsCurve")
        if other.axes not in wanted or other.axes != axis[0].axes:
            numbers = " or ".join(map(str, wanted))
            raise CurveError(f"curve {i} of the tool axis has {other.axes} columns; {kind} have {numbers}")
        (low, high), (first, last) = one.domain, other.domain
        if max(abs(low - first), abs(high - last)) > SAME_DOMAIN * (high - low):
            raise CurveError(
                f"curve {i} of the tool axis runs over u = {first:g} to {last:g}, its tip over {low:g} to {high:g}; "
                "give both the same parameters"
            )


def _check_joined(path: ToolPath) -> None:
    """CurveError where the tool axis jumps from one curve to the next, with the place."""
    n = len(path.curves)
    domains, curve = path.flat.domains, np.arange(n)
    ends = [path.orientation(curve[:-1], domains[:-1, 1])[:, 0], path.orientation(curve[1:], domains[1:, 0])[:, 0]]
    if path.kind != ANGLES:
        ends = [each / np.linalg.norm(each, axis=1)[:, None] for each in ends]
    jump = np.max(np.abs(ends[1] - ends[0]), axis=1)
    worst = int(np.argmax(jump))
    if jump[worst] > JUMP:
        raise CurveError(
            f"the tool axis jumps by {np.degrees(jump[worst]):.3g} deg between curves {worst} and {worst + 1}, at "
            f"{path.place(float(path.curve_starts[worst + 1]))}; turn it along one of them"
        )


def _check_length(path: ToolPath) -> None:
    """CurveError where the tool axis has no length, with the place."""
    curve, u = path.samples
    length = np.linalg.norm(path.orientation(curve, u)[:, 0], axis=1)
    worst = int(np.argmin(length))
    if not length[worst] > SHORTEST:
        s = float(path.arc_length(curve[worst], u[worst]))
        raise CurveError(
            f"the tool axis has no length at {path.place(s)} (curve {curve[worst]}, u = {u[worst]:.6g}); give a second "
            "point away from the tip, or a vector that is not 0"
        )
