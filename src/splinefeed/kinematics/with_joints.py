"""A path in axes that carry the tip, and beside them the joints that move these axes: all of them have limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.kinematics.jets import Jet, Number, as_jet
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Array, IntArray

#: What rounding of a joint may come to, in units of its last place.
ROUNDINGS = 8.0


@dataclass(frozen=True, eq=False)
class Joints:
    """Joints that are no axes of a path: their names, and where they are for its axes.

    Parameters
    ----------
    names : tuple of str
        As `Limits` name them.
    of : callable
        From axes, in the path's order, to joints, mm and rad: jets, arrays or numbers.
    bend : bool, optional
        Whether they move along curves while all axes move along straight lines.
    """

    names: tuple[str, ...]
    of: Callable[[tuple[Number, ...]], tuple[Number, ...]]
    bend: bool = True

    def beside(self, d: Array) -> Array:
        """Put the joints behind axes and their derivatives.

        Parameters
        ----------
        d : (n, orders, axes) array
            Axes and their derivatives by one parameter.

        Returns
        -------
        (n, orders, axes + joints) array
            mm and rad, by that parameter.
        """
        jets = tuple(Jet.of_derivatives(np.ascontiguousarray(d[:, :, k].T)) for k in range(d.shape[2]))
        return np.concatenate([d, *(as_jet(q, jets[0]).derivatives.T[:, :, None] for q in self.of(jets))], axis=2)

    def along(self, path: Path) -> PathWithJoints:
        """Return a path with these joints beside its axes.

        Parameters
        ----------
        path : Path
            In axes that `of` takes.

        Returns
        -------
        PathWithJoints
            The path and the joints.
        """
        return PathWithJoints(path, self)


def _of_path(name: str) -> Any:
    """Return a property or method that is the path's own: joints change nothing of it."""
    return property(lambda self: getattr(self.path, name), doc=f"See `Path.{name}`.")


class PathWithJoints(Track):
    """A path and joints beside its axes: `Limits` name them as further axes.

    Parameters
    ----------
    path : Path
        In axes that carry the tip.
    joints : Joints
        Of these axes.

    References
    ----------
    .. [1] docs/how-to/linuxcnc-planner.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> from splinefeed.kinematics.with_joints import Joints
    >>> core = Joints(("left", "right"), lambda r: (r[0] + r[1], r[0] - r[1]))  # belts of a CoreXY
    >>> core.along(sf.Path.polyline([[0, 0], [30, 40]]))(50.0)
    array([ 30.,  40.,  70., -10.])
    """

    sided = Path.sided
    length = _of_path("length")
    stops = _of_path("stops")
    dwells = _of_path("dwells")
    breaks = _of_path("breaks")
    jumps = _of_path("jumps")
    mixed = _of_path("mixed")
    alone = _of_path("alone")
    tip_columns = _of_path("tip_columns")
    pieces = _of_path("pieces")
    check_travel = _of_path("check_travel")
    check_limits = _of_path("check_limits")
    tip_length = _of_path("tip_length")

    def __init__(self, path: Path, joints: Joints) -> None:
        self.path, self.joints = path, joints
        self.name, self.linear = path.name, path.linear
        self.axes = (*path.axes, *joints.names)
        self._own = len(path.axes)

    @property
    def weights(self) -> Array:
        """Joints count nothing in sigma, (axes,)."""
        return np.append(self.path.weights, np.zeros(len(self.joints.names)))

    @property
    def tip_path(self) -> Path:
        """The path."""
        return self.path

    def __call__(self, s: ArrayLike) -> Array:
        """Return axes and joints (..., axes), mm and rad, at places s (...), mm."""
        values = self.path(s)
        flat = values.reshape(-1, 1, self._own)
        return self.joints.beside(flat).reshape(*values.shape[:-1], len(self.axes))

    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """Return axes and joints and their first three derivatives by sigma, (n, 4, axes), at places s (n,), mm."""
        return self.joints.beside(self.path.derivatives(s, row))

    def positions(self, curve: IntArray, u: Array, s: Array, tip: Array) -> Array:
        """Return axes and joints (n, axes), mm and rad, where the path is at `tip` (n, axes)."""
        return self.joints.beside(tip[:, None])[:, 0]

    @property
    def reach(self) -> tuple[Array, Array]:
        """Least and greatest of axes, and of joints at places along the path, (axes,) each, mm or rad."""
        low, high = self.path.reach
        places = self(self.path.curve_starts)[:, self._own :]
        return np.append(low, places.min(axis=0)), np.append(high, places.max(axis=0))

    def between_ticks(self, d: Array) -> tuple[Array | None, Array | None]:
        """Return what `Track.between_ticks` of the path does."""
        return self.path.between_ticks(d[:, :, : self._own])

    def chords(self, s: Array, r: Array, places: Array) -> tuple[IntArray, Array, Array | None]:
        """Return what `Track.chords` of the path does."""
        return self.path.chords(s, r[:, : self._own], places)

    def rounding(self, s: Array, r: Array) -> Array:
        """Return roundings of positions r (n, axes), mm and rad, at s (n,), mm: (n, axes)."""
        own, size = self.path.rounding(s, r[:, : self._own]), np.max(np.abs(r[:, self._own :]), axis=0, initial=0.0)
        return np.column_stack([own, np.broadcast_to(ROUNDINGS * np.spacing(size), (len(r), len(size)))])

    def tip(self, d: Array) -> Array:
        """Return what `Track.tip` of the path does."""
        return self.path.tip(d[:, :, : self._own])
