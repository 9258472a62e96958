"""Nearest: the nearest point of one curve, or of all pieces of a path, to any number of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.kernels import cells as cell_kernels
from splinefeed.kernels import layout as pieces
from splinefeed.kernels import nearest as kernels
from splinefeed.records import Array, IntArray, check_finite

#: A query coordinate beyond this, mm, has a square that is no number.
FARTHEST = 1e150


class Nearest:
    """Nearest points over the linear axes of an arc-length table; made once, asked often.

    table  (pieces, width) and shape as in `kernels.layout`: of a curve's `arc`, or of a `Path`
    """

    def __init__(self, table: Array, shape: pieces.Shape) -> None:
        self.table = table
        self.shape = shape
        linear = abs(shape[2])
        cells = np.empty((2 * len(table), cell_kernels.ENDS + 2 * linear))
        while (needed := cell_kernels.make_cells(table, shape, cells)) > len(cells):
            cells = np.empty((needed, cells.shape[1]))
        self.cells: Array = cells[:needed].copy()
        leaves = 1 << (needed - 1).bit_length()
        self.boxes: Array = np.empty((2 * leaves, 2 * linear))
        cell_kernels.make_boxes(self.cells, linear, self.boxes)

    def find(self, points: ArrayLike) -> tuple[IntArray, Array, Array]:
        """Row of the table (...), parameter u on it (...) and distance (...), mm, for points (..., linear), mm.

        Global: of all points of the curve none is nearer, by more than rounding; of several as near, any one.
        Points in order along the curve are found fastest. Raises InputError for a wrong shape or values not finite.
        """
        linear = abs(self.shape[2])
        try:
            queries = np.array(points, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise InputError(f"points: expected numbers, got {type(points).__name__} ({error})") from None
        if queries.ndim == 0 or queries.shape[-1] != linear:
            raise InputError(f"points: expected shape (..., {linear}), got {queries.shape}")
        check_finite(queries, "points")
        if queries.size and np.abs(queries).max() > FARTHEST:
            raise InputError(f"points: a coordinate is beyond {FARTHEST:g} mm; distances to it cannot be told")
        shape = queries.shape[:-1]
        flat = queries.reshape(int(np.prod(shape)), linear)
        rows = np.empty(len(flat), dtype=np.int64)
        parameters = np.empty(len(flat))
        distances = np.empty(len(flat))
        kernels.nearest_points(self.table, self.shape, self.cells, self.boxes, flat, rows, parameters, distances)
        return rows.reshape(shape), parameters.reshape(shape), distances.reshape(shape)


def nearest(curve: NurbsCurve, points: ArrayLike) -> tuple[Array, Array]:
    """Parameters (...) and distances (...), mm, of the curve's nearest points to `points` (..., axes), mm.

    u = argmin |C(u) - Q| over the whole domain. Raises InputError for a wrong shape or values that are not finite.
    """
    _, parameters, distances = curve.arc.nearest.find(points)
    return parameters, distances
