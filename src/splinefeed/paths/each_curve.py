"""What is said of each curve of a path, and between them: names of axes, feeds, times, markers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import MAX_AXES
from splinefeed.errors import CurveError, InputError
from splinefeed.numbers import MOST
from splinefeed.records import ROTARY_AXES, Array, BoolArray, IntArray, frozen_array
from splinefeed.records.arrays import read_only

#: What is said of each curve.
_OF_EACH = ("feeds", "tolerances", "lines", "times")
DEFAULT_AXES = ("x", "y", "z", "a", "b", "c")
#: More axes than this without names are joints of an arm, q1 and so on: all alike.
MOST_UNNAMED = 3


@dataclasses.dataclass(frozen=True)
class Marker:
    """A command of a program between two moves, such as M3 S12000 or a dwell.

    Parameters
    ----------
    before : int
        Index of the curve that follows it; the number of curves at the end.
    text : str
        Its words, as they are written.
    dwell : float, optional
        Time at rest, s.
    stop : bool, optional
        Whether the tool stops here.

    Raises
    ------
    InputError
        By a Path, for a marker outside it.

    References
    ----------
    .. [1] docs/gcode.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> corner = sf.Path.polyline([[0, 0], [5, 0], [5, 5]], markers=[sf.paths.Marker(1, "G4 P0.5", dwell=0.5)])
    >>> corner.dwells
    ((5.0, 0.5),)
    """

    before: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.dwell < math.inf:
            raise InputError(f"a dwell of {self.dwell!r} s; it must be 0 or more and finite")
        if self.dwell > 0.0 and not self.stop:
            raise InputError(f"a dwell of {self.dwell:g} s without a stop; the tool can wait only at rest")


def chosen_of_each(said: dict[str, Any], index: IntArray) -> dict[str, Any]:
    """What is said of a path of its curves of these numbers (m,), in order: some left out, others in several parts."""
    each = {name: None if said.get(name) is None else read_only(np.array(said[name])[index]) for name in _OF_EACH}
    markers = [dataclasses.replace(m, before=int(np.searchsorted(index, m.before))) for m in said.get("markers", ())]
    return {**said, **each, "markers": tuple(markers)}


def default_axes(count: int) -> tuple[str, ...]:
    """Name axes that have no names.

    Parameters
    ----------
    count : int
        How many there are.

    Returns
    -------
    tuple of str
        x, y, z, or joints q1, q2, ... where there are more.
    """
    return DEFAULT_AXES[:count] if count <= MOST_UNNAMED else tuple(f"q{k}" for k in range(1, count + 1))


def checked_axes(axes: Sequence[str], count: int) -> int:
    """How many of `axes` are linear; CurveError unless they name `count` axes, the linear ones first."""
    if len(axes) != count or len(set(axes)) != count or count > MAX_AXES:
        raise CurveError(f"axes {axes} for curves of {count} axes; expected one distinct name each")
    rotary = [axis in ROTARY_AXES for axis in axes]
    if rotary != sorted(rotary):
        raise CurveError(f"axes {axes}: put the linear axes first and the rotary ones ({', '.join(ROTARY_AXES)}) last")
    return count - sum(rotary)


def floats(given: ArrayLike) -> Array:
    """A copy of what is given as numbers, of any shape; an empty array where it is no such thing."""
    try:
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        return np.zeros(0)


def of_times(given: ArrayLike | None, count: int) -> Array | None:
    """Wanted times (count,), read-only, NaN where there is none; InputError unless they grow from above 0."""
    if given is None:
        return None
    values = floats(given)
    if values.shape != (count,):
        raise InputError(f"times have shape {values.shape}; expected one number for each of {count} curve(s)")
    known = values[~np.isnan(values)]
    if not np.all(np.diff(known, prepend=0.0) > 0.0) or np.any(known > MOST):
        raise InputError(f"times are {known.tolist()} s; they must be above 0, at most {MOST:g}, and increase")
    return read_only(values) if len(known) else None


def of_curves(
    given: ArrayLike | None, count: int, name: str, wanted: str, fits: Callable[[Array], BoolArray]
) -> Array | None:
    """One number a curve, (count,), read-only; InputError for a number that does not fit."""
    if given is None:
        return None
    values = frozen_array(given, name, 1)
    if len(values) != count:
        raise InputError(f"{name} has {len(values)} numbers for {count} curves; give one each")
    wrong = ~fits(values)
    if np.any(wrong):
        i = int(np.argmax(wrong))
        raise InputError(f"{name}[{i}] is {values[i]:g}; it must be {wanted}")
    return values


def of_lines(given: ArrayLike | None, count: int) -> IntArray | None:
    """The line of a program that each curve stands on, (count,), read-only; InputError for one below 0."""
    lines = of_curves(given, count, "lines", "0 or more", lambda values: values >= 0.0)
    return None if lines is None else read_only(lines.astype(np.int64))
