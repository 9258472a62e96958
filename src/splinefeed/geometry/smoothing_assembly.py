"""Curves shortened by the transitions between them, and their feeds, tolerances and markers, reassembled."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS, Flat, Packed
from splinefeed.geometry.editing import section
from splinefeed.geometry.path import Marker, Path
from splinefeed.geometry.smoothing_batch import Batch
from splinefeed.geometry.smoothing_joints import NO_REST, Transitions, transitions
from splinefeed.records import Array, IntArray

#: Share of what is left of the tolerance that transitions use: the rest covers rounding and what lies between samples.
JOINT = 0.95
#: A parameter this near a knot, relative to the largest one, is the knot.
SAME_KNOT = 1e-12
_QUINTIC: Array = np.repeat([0.0, 1.0], 6)
#: How often the halves of a quintic hold each of its points (de Casteljau's algorithm; The NURBS Book, 2nd ed., A1.5).
_FRONT: Array = np.array([[1, 0, 0, 0, 0, 0], [16, 16, 0, 0, 0, 0], [8, 16, 8, 0, 0, 0], [4, 12, 12, 4, 0, 0],
                          [2, 8, 12, 8, 2, 0], [1, 5, 10, 10, 5, 1]]) / [[1], [32], [32], [32], [32], [32]]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Done:
    """Curves that are final; feed and said (n,) as of a Batch, markers by the number of the curve among these."""

    flat: Flat
    feed: Array
    said: Array
    markers: list[Marker]


@dataclass(frozen=True, eq=False)
class _Begin:
    """How the first of the curves that wait begins: a transition that reaches it, 0 if none does."""

    reach: float
    u: float
    point: Array


@dataclass
class Assembly:
    """Transitions at the joints of the curves that come, which lead from one to the other with continuous curvature.

    axes, angular  as for `smoothed`; rounded  whether corners are rounded; gap  of the paths, mm; made  transitions
    """

    axes: tuple[str, ...]
    angular: float
    rounded: bool
    gap: float = 0.0
    made: int = 0
    _last: Batch | None = None
    _begin: _Begin = field(default_factory=lambda: _Begin(0.0, 0.0, np.empty(0)))

    def push(self, batch: Batch | None, last: bool, markers: list[Marker]) -> Done | None:
        """Take more curves; those that are final, all with `last`, with those of `markers` that stand among them.

        These are taken from the list; they are in order, `before` being the number of a curve of the path.
        """
        given = [each for each in (self._last, batch) if each is not None]
        if not given:
            return None
        batch = Batch.joined(given)
        base = Path(Packed(batch.flat), self.axes, tolerance=self.gap)
        budget = np.minimum(batch.allowed[:-1], batch.allowed[1:])
        share = JOINT * (1.0 - np.maximum(batch.spent[:-1], batch.spent[1:]))
        may = batch.free[1:] if self.rounded else batch.free[1:] & ~batch.corner[1:]
        made = transitions(base, share * budget, share * self.angular, may)
        self.made += int(np.count_nonzero(made.reach))
        count = len(batch) if last else len(batch) - 1
        if not count:
            self._last = batch
            return None
        done = self._put_together(batch, base, made, count, markers)
        if last:
            self._last = None
        else:
            self._last = batch.part(count, count + 1)
            self._begin = _Begin(float(made.reach[-1]), float(made.behind[-1]), made.points[-1, 5])
        return done

    def _put_together(self, batch: Batch, base: Path, made: Transitions, count: int, markers: list[Marker]) -> Done:
        """The first `count` curves, as the transitions leave them, and the transitions behind them."""
        flat, start = batch.flat, self._begin
        before = np.append(start.reach, made.reach)[:count]  # reach of the transition before each, and of that behind
        behind = np.append(made.reach, 0.0)[:count]
        lengths = np.diff(base.curve_starts)[:count]
        left = lengths - before - behind > NO_REST * lengths
        halves = np.append(batch.apart[1:], False)[:count]
        steps = np.where(behind > 0.0, 1 + halves, 0)
        slots = np.concatenate([[0], np.cumsum(left + steps)])
        rests, joints = slots[:-1][left], (slots[:-1] + left)[behind > 0.0]
        total = int(slots[-1])
        # what is left of each
        ends = base.ends[:count].copy()
        ends[1:, 0] = np.where(before[1:, None] > 0.0, made.points[: count - 1, 5], ends[1:, 0])
        if start.reach > 0.0:
            ends[0, 0] = start.point
        inner = made.points[:count, 0]
        ends[: len(inner), 1] = np.where(behind[: len(inner), None] > 0.0, inner, ends[: len(inner), 1])
        straight = (flat.degrees[:count] == 1) & (np.diff(flat.point_starts[: count + 1]) == 2)
        parts: list[Flat] = []
        slot: list[IntArray] = []
        whole = left & (before == 0.0) & (behind == 0.0)
        cut = left & ~whole
        if whole.any():
            parts.append(flat.chosen(np.flatnonzero(whole)))
            slot.append(slots[:-1][whole])
        if (lines := cut & straight).any():
            parts.append(_lines(ends[lines]))
            slot.append(slots[:-1][lines])
        if (bent := cut & ~straight).any():
            us = np.append(start.u, made.behind), np.append(made.before, 0.0)
            at = np.flatnonzero(bent).tolist()
            parts.append(Flat.of([_shortened(flat.curve(i), us[0][i] if before[i] else None,
                                             us[1][i] if behind[i] else None) for i in at]))  # fmt: skip
            slot.append(slots[:-1][bent])
        led = np.flatnonzero(behind > 0.0)
        if len(led):
            points = made.points[led].copy()
            # where nothing is left of a curve, one transition begins at the end of the other
            closed = ~left[led] & (before[led] > 0.0)
            ahead = np.where(led[closed] > 0, led[closed] - 1, 0)
            points[closed, 0] = np.where((led[closed] > 0)[:, None], made.points[ahead, 5], ends[0, 0])
            split = halves[led]
            front = np.einsum("ij,njk->nik", _FRONT, points)
            back = np.einsum("ij,njk->nik", _FRONT[::-1, ::-1], points)
            back[:, 0] = front[:, 5]
            parts += [_quintics(np.where(split[:, None, None], front, points)), _quintics(back[split])]
            slot += [joints, joints[split] + 1]
        order = np.argsort(np.concatenate(slot), kind="stable")
        owner = np.empty(total, dtype=np.int64)
        owner[rests] = np.flatnonzero(left)
        owner[joints] = led
        owner[joints[halves[led]] + 1] = led[halves[led]] + 1
        begins = slots.copy()  # where each curve begins, the one behind included
        begins[led[halves[led]] + 1] = joints[halves[led]] + 1
        return Done(
            Flat.joined([part for part in parts if len(part)]).chosen(order),
            batch.feed[owner],
            batch.said[owner],
            _placed(batch, begins, total, markers),
        )


def _placed(batch: Batch, begins: IntArray, total: int, markers: list[Marker]) -> list[Marker]:
    """Markers that stand before curves that are final, taken from the list, with the numbers of these."""
    out = []
    while markers:
        i = int(np.searchsorted(batch.first, markers[0].before))
        if i >= len(begins) or i >= len(batch) or begins[i] >= total:
            break
        out.append(dataclasses.replace(markers.pop(0), before=int(begins[i])))
    return out


def _lines(ends: Array) -> Flat:
    """Lines between ends (n, 2, axes)."""
    n = len(ends)
    return Flat(
        np.ones(n, dtype=np.int64), np.zeros(n, dtype=np.int64), 4 * np.arange(n + 1), np.tile(LINE_KNOTS, n),
        2 * np.arange(n + 1), ends.reshape(2 * n, ends.shape[2]), np.empty(0),
    )  # fmt: skip


def _quintics(points: Array) -> Flat:
    """Bezier curves of degree 5 of points (n, 6, axes)."""
    n = len(points)
    return Flat(
        np.full(n, 5), np.zeros(n, dtype=np.int64), 12 * np.arange(n + 1), np.tile(_QUINTIC, n),
        6 * np.arange(n + 1), points.reshape(6 * n, points.shape[2]), np.empty(0),
    )  # fmt: skip


def _shortened(curve: NurbsCurve, low: float | None, high: float | None) -> NurbsCurve:
    """The curve between two parameters, or up to its ends."""
    ends = (at_knot(curve, end if u is None else float(u)) for u, end in zip((low, high), curve.domain, strict=True))
    return section(curve, *ends)


def at_knot(curve: NurbsCurve, u: float) -> float:
    """The knot that u is but for rounding, or u."""
    nearest = float(curve.breaks[np.argmin(np.abs(curve.breaks - u))])
    size = max(map(abs, curve.domain))
    return nearest if abs(nearest - u) <= SAME_KNOT * size and nearest not in curve.domain else u
