"""What the check measures, tick by tick, until someone takes it: so reports know what binds, and how axes move."""

from __future__ import annotations

import numpy as np

from splinefeed.checks.law import LawTicks
from splinefeed.records import Array, IntArray


class ByTick:
    """How much of each limit setpoints use at each tick, and differences of the axes there.

    Attributes
    ----------
    names : tuple of str
        The limits, in the order of the report.
    final : int
        How many ticks are known for good.
    """

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.final = 0
        self._taken = self._first = 0  # ticks that are taken, and the tick of the first row
        self._share, self._motion = np.zeros((0, 0)), np.zeros((3, 0, 0))

    def begin(self, names: tuple[str, ...], axes: int, before: int) -> None:
        """Know the limits, the number of axes, and how many ticks before the first one something may be placed at."""
        self.names, self._first = names, -before
        self._share, self._motion = np.zeros((len(names), 0)), np.zeros((3, axes, 0))

    def grow(self, count: int) -> None:
        """Make room for ticks below `count`."""
        more = count - self._first - self._share.shape[1]
        self._share = np.pad(self._share, ((0, 0), (0, more)))
        self._motion = np.pad(self._motion, ((0, 0), (0, 0), (0, more)), constant_values=np.nan)

    def see(self, name: str, tick: int | IntArray, share: Array) -> None:
        """How much of a limit is used, (n,), at ticks (n,), or from one on: of each tick the largest share counts."""
        if name not in self.names:
            return
        own, at = self._share[self.names.index(name)], tick - self._first
        if isinstance(at, int):
            own[at : at + len(share)] = np.maximum(own[at : at + len(share)], share)
        else:
            np.maximum.at(own, at, share)

    def moved(self, order: int, tick: int, values: Array) -> None:
        """Differences of this order of the axes, (axes, n), from a tick on."""
        first = tick - self._first
        self._motion[order - 1, :, first : first + values.shape[1]] = values

    def take(self, law: LawTicks, inner: slice) -> tuple[Array, Array]:
        """Take what is known of the next ticks, which is forgotten.

        Parameters
        ----------
        law : LawTicks
            What the law makes of these ticks and those around them.
        inner : slice
            Where these are among them.

        Returns
        -------
        share : (n, limits) array
            How much of each limit they use.
        motion : (3, n, axes) array
            Velocity, acceleration and jerk of the axes.

        Notes
        -----
        Shares are those of exact derivatives, but of differences where only these say it, where C' = 0, and where they
        exceed the derivatives at all ticks that they are made of. Such a difference is no mean of the derivative:
        curvature jumps there, or the acceleration of the law, and the drive sees the difference. The motion is that of
        differences, where they are known. The third one that ends at the tick behind the first is of the first, too.
        """
        first = self._taken - self._first
        if first:
            before, own = self._motion[2, :, first - 1 : first + 1].T
            self._motion[2, :, first] = np.where(np.abs(before) > np.abs(own), before, own)
            self._share[:, first] = np.max(self._share[:, first - 1 : first + 1], axis=1)
        end = first + inner.stop - inner.start
        share, motion = self._share[:, first:end].T.copy(), np.swapaxes(self._motion[:, :, first:end], 1, 2)
        self._share, self._motion = self._share[:, end:].copy(), self._motion[:, :, end:].copy()
        self._taken += inner.stop - inner.start
        self._first = self._taken
        for k, name in enumerate(self.names):
            if (exact := law.share.get(name)) is not None:
                known = np.isfinite(exact)
                size = np.pad(np.where(known, exact, 0.0), (1, 2), mode="edge")
                near = np.max([size[i : i + len(exact)] for i in range(4)], axis=0)[inner]
                share[:, k] = np.where((share[:, k] > near) | ~known[inner], share[:, k], exact[inner])
        return share, np.where(np.isnan(motion), law.motion[:, inner], motion)
