"""How the tip of an arm stands along a path: one rotation, or one that turns smoothly through given ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from splinefeed.errors import InputError
from splinefeed.kinematics.jets import Jet, root
from splinefeed.records import Array

#: Degree of the spline through quaternions: three derivatives without steps.
DEGREE = 5
#: A matrix is a rotation within this; a quaternion shorter than the next has no direction.
ROTATION, SHORTEST = 1e-6, 1e-9
#: Neighbouring quaternions further apart than this, rad, leave open which way to turn.
MOST_TURN = np.pi - 1e-3


@dataclass(frozen=True)
class Orientation:
    """Rotations along a path of this length, mm: normalized, the spline of quaternions by the share of the length."""

    quaternions: BSpline
    length: float

    @classmethod
    def of(cls, given: ArrayLike, length: float) -> Orientation:
        """Make the rotations along a path from what a user gives.

        Parameters
        ----------
        given : array
            A rotation (3, 3); a quaternion (4,); or quaternions (k, 4) at equal shares of the length: x, y, z, w, of
            any size, as in ROS.
        length : float
            Of the path, mm.

        Returns
        -------
        Orientation
            Constant, or turning smoothly.

        Raises
        ------
        InputError
            For what is none of these, with the row, and for half a turn from one quaternion to the next.
        """
        try:
            values = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.full(1, np.nan)
        if values.shape == (3, 3):
            if not np.allclose(values @ values.T, np.eye(3), atol=ROTATION) or np.linalg.det(values) < 0.0:
                raise InputError("orientation: the matrix is no rotation; its columns must be a right-handed frame")
            from scipy.spatial.transform import Rotation

            values = Rotation.from_matrix(values).as_quat()
        rows = values[None] if values.shape == (4,) else values
        if rows.ndim != 2 or rows.shape[1] != 4 or not np.all(np.isfinite(rows)):
            raise InputError(
                f"orientation has shape {values.shape}; expected finite numbers: a rotation (3, 3), a quaternion x, y, "
                "z, w, or quaternions (k, 4) along the curve"
            )
        sizes = np.linalg.norm(rows, axis=1)
        if np.min(sizes) < SHORTEST:
            raise InputError(f"orientation: quaternion {int(np.argmin(sizes)) + 1} has length 0; give x, y, z, w")
        rows = rows / sizes[:, None]
        for k in range(1, len(rows)):
            rows[k] *= -1.0 if rows[k] @ rows[k - 1] < 0.0 else 1.0
            if 2.0 * np.arccos(min(rows[k] @ rows[k - 1], 1.0)) > MOST_TURN:
                raise InputError(
                    f"orientation: from quaternion {k} to {k + 1} is half a turn, which may go either way; give one "
                    "between them"
                )
        if len(rows) == 1:
            rows = np.repeat(rows, 2, axis=0)
        spline = make_interp_spline(np.linspace(0.0, 1.0, len(rows)), rows, min(DEGREE, len(rows) - 1))
        return cls(spline, length)

    @property
    def breaks(self) -> Array:
        """Lengths (k,) strictly inside, mm, at which a derivative up to the third may jump."""
        spline = self.quaternions
        return np.unique(spline.t[spline.k + 1 : -spline.k - 1]) * self.length if spline.k < 4 else np.zeros(0)

    def jets(self, s: Array, order: int) -> Array:
        """Compute Taylor coefficients of the rotation by length.

        Parameters
        ----------
        s : array (n,)
            Lengths along the path, mm.
        order : int
            Of the highest coefficient.

        Returns
        -------
        array (order + 1, n, 3, 3)
            Coefficients, 1/mm^k.

        Notes
        -----
        R = 1 + 2 (w [v]x + [v]x [v]x) of a quaternion (v, w) of length 1.
        """
        share = s / self.length
        orders = range(order + 1)
        d = np.stack([self.quaternions(share, k) / self.length**k for k in orders])
        x, y, z, w = (Jet.of_derivatives(d[:, :, k]) for k in range(4))
        size = root(x * x + y * y + z * z + w * w)
        x, y, z, w = (each / size for each in (x, y, z, w))
        rows = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
            (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
            (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
        )
        return np.stack([np.stack([each.c for each in row], axis=-1) for row in rows], axis=-2)
