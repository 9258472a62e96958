"""Paths to a file of another format, and how far what the file then holds is from them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.errors import SplinefeedError
from splinefeed.formats import registry
from splinefeed.paths.fitting import distances
from splinefeed.paths.path import Path
from splinefeed.records import ROTARY_AXES, Array

#: Points a curve, at least, at which the file is held against the paths: ends, middles, and what lies between.
LEAST_SAMPLES = 5
#: Points in all where there are few curves.
SAMPLES = 4001
#: With more curves than this the file is not read back: it would take longer than writing it.
MOST_CURVES = 20_000


def convert(
    paths: Sequence[Path],
    target: str | os.PathLike[str],
    *,
    tolerance: float | str | None = None,
    writing: Mapping[str, Any] | None = None,
) -> tuple[tuple[str, ...], int | None, float | None]:
    """Write paths to a file, read it back, and measure how far it is from them.

    Parameters
    ----------
    paths : sequence of Path
        To be written.
    target : str or PathLike
        The file; its suffix says the format.
    tolerance : float or str, optional
        For what the format cannot hold exactly, mm.
    writing : mapping of str to object, optional
        Options of the format's writer.

    Returns
    -------
    notes : tuple of str
        What was approximated and what is lost, one sentence each.
    curves : int or None
        How many the file has, as it was read back; None where it cannot be, and of more than MOST_CURVES curves.
    distance : float or None
        The largest of points on the paths from the curves of the file, mm, over the linear axes that both have; None
        where it cannot be measured.

    Raises
    ------
    FormatError
        For what cannot be written.
    InputError
        For an option that the format does not have.
    """
    found = registry.format_to_write(target)
    options = {} if tolerance is None or "tolerance" not in found.writing_options else {"tolerance": tolerance}
    notes = registry.write(paths, target, **options, **(writing or {}))
    count = sum(len(path.curves) for path in paths)
    if found.reader is None or count > MOST_CURVES:
        return notes, None, None
    try:
        back = registry.read_all(target)
    except SplinefeedError as error:
        return (*notes, f"the file could not be read back: {error}"), None, None
    return notes, sum(len(path.curves) for path in back), _largest_distance(paths, back, count)


def _largest_distance(paths: Sequence[Path], back: Sequence[Path], count: int) -> float | None:
    """Largest distance, mm, of points on `paths` from the curves of `back`; None if they have no axes in common."""
    shared = [axis for axis in paths[0].axes if axis in back[0].axes and axis not in ROTARY_AXES]
    if not shared or any(path.axes != paths[0].axes for path in paths) or any(p.axes != back[0].axes for p in back):
        return None
    samples = max(LEAST_SAMPLES, SAMPLES // count)
    points: list[Array] = []
    for path in paths:
        columns = [path.axes.index(axis) for axis in shared]
        points += [curve(np.linspace(*curve.domain, samples))[:, columns] for curve in path.curves]
    pick = np.eye(len(back[0].axes))[[back[0].axes.index(axis) for axis in shared]]
    curves = [
        curve if len(pick) == curve.axes else curve.transformed(pick)
        for path in back
        for curve in path.curves
        if np.any(np.ptp(curve.control_points @ pick.T, axis=0) > 0.0)
    ]
    return float(distances(curves, np.concatenate(points)).max())
