"""The points of long curves as a page carries them: two bytes a value, or the least and the greatest of stretches."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Callable
from typing import Any

import numpy as np

from splinefeed.analysis.thinning import least_and_greatest
from splinefeed.records import Array

#: A curve of at most so many points stands in its trace; of a longer one the page draws what is seen.
FEW = 1000
#: Points of a curve, or stretches of a longer one, that a store keeps at the most.
MOST = 1_000_000
#: Values that share a scale of 65535 steps; the step after the last of them stands for what is not a number.
BLOCK, STEPS, GAP = 256, 65_534, 65_535
#: A step of x, in its unit: time to the nanosecond.
TICK = 1e-9


class DetailStore:
    """Curves by number in one row of bytes.

    Parameters
    ----------
    most : int, optional
        Points of a curve; of a longer one the least and the greatest of as many stretches are kept.
    """

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._bytes = bytearray()
        self._text: str | None = None
        self._known: dict[tuple[Any, ...], int] = {}
        self._held: list[Array] = []  # an array that is gone may leave its number to another
        self.series: list[dict[str, Any]] = []

    def curve(self, x: Array, y: Array, high: Array | None = None) -> dict[str, Any]:
        """Keep a curve, and give what a trace has of it.

        Parameters
        ----------
        x : array (n,)
            Rising; of a band the edges (n + 1,).
        y : array (n,)
            Its values; of a band the least.
        high : array (n,), optional
            Of a band the greatest.

        Returns
        -------
        dict of str to int
            Numbers of its series, `x` and `y`, or `x`, `low` and `high` where only the least and the greatest of
            stretches are kept, or known; and `count`, how many points or stretches it has.
        """
        if high is None and len(x) <= self._most:
            return {"x": self._once("x", x, self._put_times), "y": self._once("y", y, self._put), "count": len(x)}
        count = len(y) if high is None else len(high)
        starts = np.arange(0, count, -(-count // self._most))
        edges = np.append(x[starts], x[-1])
        top = y if high is None else high
        least, greatest = least_and_greatest(y[:count], starts)[0], least_and_greatest(top, starts)[1]
        if high is None:  # up to the first point of the next stretch
            least[:-1], greatest[:-1] = np.fmin(least[:-1], y[starts[1:]]), np.fmax(greatest[:-1], y[starts[1:]])
        return {
            "x": self._once("edges", x, lambda _: self._put_times(edges)),
            "low": self._once("low", y, lambda _: self._put(least, np.floor)),
            "high": self._once("high", top, lambda _: self._put(greatest, np.ceil)),
            "count": count,
        }

    def _once(self, kind: str, values: Array, put: Callable[[Array], int]) -> int:
        """The number of a series that is put in once, however many curves have it."""
        key = (kind, *values.__array_interface__["data"], *values.strides, len(values))
        if key not in self._known:
            self._held.append(values)
            self._known[key] = put(values)
        return self._known[key]

    def _put_times(self, x: Array) -> int:
        """Differences of x, planes of their four bytes; the first value stands in words."""
        steps = np.diff(x, prepend=x[:1])
        unit = max(TICK, float(np.max(steps, initial=0.0)) / (2**32 - 1))
        whole = np.rint((x - x[0]) / unit) if len(x) else x
        planes = np.diff(whole, prepend=whole[:1]).astype("<u4").view(np.uint8).reshape(-1, 4)
        return self._add({"n": len(x), "from": float(x[0]) if len(x) else 0.0, "unit": unit}, planes.T.tobytes())

    def _put(self, values: Array, rounded: Callable[[Array], Array] = np.rint) -> int:
        """Keep scales of the blocks, then planes of the low and the high bytes of differences of steps.

        `rounded` says which step stands for a value: the nearest, or one outside of it, so that an area has all of the
        motion.
        """
        values = np.asarray(values, dtype=np.float64)  # bands are in single precision
        count = len(values)
        padded = np.pad(values, (0, -count % BLOCK), constant_values=np.nan).reshape(-1, BLOCK)
        there = np.isfinite(padded)
        low = np.min(padded, axis=1, initial=np.inf, where=there)
        high = np.max(padded, axis=1, initial=-np.inf, where=there)
        low, high = np.where(np.isfinite(low), low, 0.0), np.where(np.isfinite(high), high, 0.0)
        step = (high - low) / STEPS
        size = np.where(step > 0.0, step, 1.0)[:, None]
        steps = rounded((np.where(there, padded, low[:, None]) - low[:, None]) / size)
        codes = np.where(there, np.minimum(steps, STEPS), GAP)
        codes = codes.astype(np.uint16).ravel()[:count]
        planes = np.diff(codes, prepend=np.zeros(1, np.uint16)).astype("<u2").view(np.uint8).reshape(-1, 2)
        return self._add({"n": count}, low.astype("<f8").tobytes() + step.astype("<f8").tobytes() + planes.T.tobytes())

    def _add(self, said: dict[str, Any], data: bytes) -> int:
        self.series.append({**said, "at": len(self._bytes)})
        self._bytes += data
        self._text = None
        return len(self.series) - 1

    @property
    def longest(self) -> int:
        """Points or stretches of the longest curve."""
        return max((each["n"] for each in self.series), default=0)

    def text(self) -> str:
        """All bytes through gzip, in base64; zoom.js unpacks them."""
        if self._text is None:
            self._text = base64.b64encode(gzip.compress(bytes(self._bytes), 6, mtime=0)).decode()
        return self._text
