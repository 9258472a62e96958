"""Inverse kinematics of an arm: joints and their exact derivatives for places and rotations of the tip.

With J the Jacobian of the joints that are free, the Taylor coefficients q_k of the joints follow one by one from those
of the wanted pose: all that J q_k does not contribute to the k-th coefficient comes from lower ones,

    J q_k = x_k - x_k(q_0, ..., q_(k-1), 0)

and q_0 is Newton's. A row of the residual is metres or, of the rotation, rad: vee of (R_k - A_k) A_0'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.records import Array
from splinefeed.robots.frames import MM, Frames

#: Newton steps from a guess; damped ones from a far start; a residual, m and rad, that is rounding.
STEPS, FAR_STEPS, ROUNDING = 12, 400, 1e-13
#: Most that a damped step may move a joint, rad or m, and what is added to J J' there.
LONGEST_STEP, DAMPING = 0.2, 1e-6


@dataclass(frozen=True)
class Inverse:
    """The joints `free` (6,) of an arm follow a pose; all others stay where they are."""

    frames: Frames
    free: tuple[int, ...]

    @property
    def units(self) -> Array:
        """What a unit of each joint counts, (joints,): rad as they are, mm as m."""
        return np.where(self.frames.turns, 1.0, 1.0 / MM)

    def jacobian(self, q: Array) -> Array:
        """m and rad by free joints, rad or m, (n, 6, 6), for joints (n, joints)."""
        return self._scaled(self.frames.jacobian(q))

    def newton(self, q: Array, place: Array, rotation: Array, steps: int = STEPS) -> tuple[Array, Array]:
        """Find joints from a guess by Newton's method.

        Parameters
        ----------
        q : array (n, joints)
            The guess, rad and mm.
        place : array (n, 3)
            Of the tip, mm.
        rotation : array (n, 3, 3)
            Of the tip.
        steps : int, optional
            At the most; fewer where all residuals are rounding.

        Returns
        -------
        q : array (n, joints)
            Joints, not finite where the Jacobian is singular.
        left : array (n,)
            The residual before the last step, m and rad.
        """
        q = q.copy()
        left = np.full(len(q), np.inf)
        for _ in range(steps):
            off, jacobian = self._off(q, place, rotation)
            left = np.max(np.abs(off), axis=1)
            q[:, self.free] += self._solved(jacobian, off)
            if not np.any(left > ROUNDING):
                break
        return q, left

    def damped(self, q: Array, place: Array, rotation: Array) -> tuple[Array, Array]:
        """Find joints from afar by damped Newton steps.

        Parameters
        ----------
        q : array (joints,)
            Where the search begins, rad and mm.
        place : array (3,)
            Of the tip, mm.
        rotation : array (3, 3)
            Of the tip.

        Returns
        -------
        q : array (joints,)
            Joints at the place, or as near as it gets.
        left : array (6,)
            The residual there, m and rad.
        """
        q = q.copy()
        best, least = q.copy(), np.inf
        for _ in range(FAR_STEPS):
            off, jacobian = (each[0] for each in self._off(q[None], place[None], rotation[None]))
            size = float(np.linalg.norm(off))
            if size < least:
                best, least = q.copy(), size
            if size < ROUNDING:
                break
            step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + DAMPING * size * np.eye(6), off)
            step *= min(1.0, LONGEST_STEP / max(float(np.max(np.abs(step))), 1e-300))
            q[list(self.free)] += step / self.units[list(self.free)]
        return best, self._off(best[None], place[None], rotation[None])[0][0]

    def taylor(self, q: Array, place: Array, rotation: Array) -> Array:
        """Compute Taylor coefficients of the joints from those of the pose.

        Parameters
        ----------
        q : array (n, joints)
            The joints at the places, rad and mm.
        place : array (4, n, 3)
            Coefficients of the tip's place, mm.
        rotation : array (4, n, 3, 3)
            Coefficients of its rotation.

        Returns
        -------
        array (4, n, joints)
            Coefficients of the joints; the first is `q`.

        Notes
        -----
        J q_k = x_k - x_k(q_0, ..., q_(k-1), 0), see the head of the module.
        """
        c = np.zeros((4, *q.shape))
        c[0] = q
        jacobian = self.jacobian(q)
        for k in (1, 2, 3):
            if k == 1:
                own_place, own = np.zeros_like(q[:, :3]), np.zeros((len(q), 3, 3))
            else:
                places, rotations = self.frames.pose(c[: k + 1])
                own_place, own = places[k], rotations[k]
            turn = (rotation[k] - own) @ np.swapaxes(rotation[0], 1, 2)
            off = np.concatenate([(place[k] - own_place) / MM, _vee(turn)], axis=1)
            c[k][:, self.free] = self._solved(jacobian, off)
        return c

    def smallest(self, q: Array) -> Array:
        """Least singular value of the Jacobian, m and rad, at joints (n, joints), (n,)."""
        return np.asarray(np.min(np.linalg.svd(self.jacobian(q), compute_uv=False), axis=1))

    def _off(self, q: Array, place: Array, rotation: Array) -> tuple[Array, Array]:
        """What is left to a pose, (n, 6), m and rad, and the Jacobian (n, 6, 6)."""
        own, turned, jacobian = self.frames.pose_and_jacobian(q)
        turn = rotation @ np.swapaxes(turned, 1, 2)
        return np.concatenate([(place - own) / MM, _vee(turn)], axis=1), self._scaled(jacobian)

    def _scaled(self, jacobian: Array) -> Array:
        rows = np.repeat([1.0 / MM, 1.0], 3)[:, None]
        return np.asarray(jacobian[:, :, self.free] * rows / self.units[list(self.free)])

    def _solved(self, jacobian: Array, off: Array) -> Array:
        try:
            step = np.linalg.solve(jacobian, off[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            step = np.full_like(off, np.nan)
        return np.asarray(step / self.units[list(self.free)])


def _vee(turn: Array) -> Array:
    """The vector (n, 3) of the skew part of matrices (n, 3, 3)."""
    x, y, z = turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]
    return 0.5 * np.stack([x, y, z], axis=1)
