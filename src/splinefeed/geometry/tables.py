"""Tables of pieces of many curves, made in a few calls of a kernel each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.geometry.arc_length import MAX_ROWS, ArcLength
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import Flat
from splinefeed.kernels import pieces
from splinefeed.kernels.arc_fitting import fill_curves
from splinefeed.kernels.span_rows import fill_spans
from splinefeed.records import Array, IntArray, frozen_array

T = TypeVar("T", Array, IntArray)

#: Rows of a table that a curved span is given room for at first, and the least room that is added.
ROWS_A_SPAN = 8
MORE_ROWS = 4096


def read_only(array: T) -> T:
    """The same array, not to be written to any more."""
    array.setflags(write=False)
    return array


def span_rows(flat: Flat, shape: pieces.Shape) -> tuple[Array, IntArray]:
    """Knot spans of all curves, some in parts, (pieces, width), in `shape`; first and last row of each curve (n, 2)."""
    table = np.empty((int(np.sum(np.diff(flat.point_starts) - flat.degrees)), pieces.width(shape)))
    rows = np.empty((len(flat), 2), dtype=np.int64)
    curve = filled = 0
    while True:
        curve, filled = fill_spans(*flat.for_kernels, shape, curve, table, filled, rows)
        if curve == len(flat):
            return _kept(table, filled), read_only(rows)
        table = _with_more_room(table, filled)


def arc_rows(
    flat: Flat, shape: pieces.Shape, spans: tuple[Array, IntArray] | None, curves: Sequence[NurbsCurve]
) -> tuple[Array, IntArray, Array]:
    """Arc-length pieces of all curves (pieces, width), first and last row (n, 2), and where each starts (n + 1,), mm.

    spans  what `span_rows` gave, not needed for lines; curves  the same as `flat`. Raises CurveError that names a curve
    without length, or one that would need too many pieces.
    """
    span_table, span_places = (np.empty((0, 0)), np.empty((0, 2), dtype=np.int64)) if spans is None else spans
    counts = np.diff(flat.point_starts) - flat.degrees
    curved = (flat.degrees > 1) | (flat.rational > 0)
    table = np.empty((int(np.sum(np.where(curved, ROWS_A_SPAN * counts, counts))), pieces.width(shape)))
    rows, starts, state = np.empty((len(flat), 2), dtype=np.int64), np.zeros(len(flat) + 1), np.zeros(2)
    given = (*flat.for_kernels, shape[2], span_table, span_places, shape)
    curve = filled = 0
    while True:
        curve, filled = fill_curves(*given, curve, MAX_ROWS, table, filled, rows, starts, state)
        if filled < 0:
            try:
                ArcLength(curves[curve], shape[2])
                raise CurveError("its length is no number greater than 0")
            except CurveError as error:
                raise CurveError(f"curve {curve} of the path: {error}") from None
        if curve == len(flat):
            return _kept(table, filled), read_only(rows), read_only(starts)
        table = _with_more_room(table, filled)


def _with_more_room(table: Array, filled: int) -> Array:
    return np.concatenate([table[:filled], np.empty((max(len(table) // 2, MORE_ROWS), table.shape[1]))])


def _kept(table: Array, rows: int) -> Array:
    """The first rows of a table, read-only, without the room behind them."""
    return frozen_array(table[:rows], "table", 2) if rows < len(table) else read_only(table)
