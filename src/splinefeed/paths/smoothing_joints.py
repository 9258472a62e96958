"""Transitions: at each joint a quintic that leaves one curve and meets the next with continuous curvature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.differential import angles
from splinefeed.curves.editing import section
from splinefeed.curves.packed import Flat, Packed
from splinefeed.paths.corners import CORNER_ANGLE, CURVATURE_JUMP
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.smoothing_runs import LineBatch
from splinefeed.records import Array, BoolArray, IntArray

#: A quintic over [-d, d] that meets value, slope and second derivative of a function at both ends differs from it by at
#: most TANGENT d, BEND d^2 and RATE d^3 times the jumps of its first and second derivative in the middle and the
#: largest value of its third one: see docs/math/smoothing.md.
TANGENT, BEND, RATE = 3.0 / 16.0, 0.010737, 0.049511
#: A transition is no longer than this many tolerances on each side: beyond, a long line stays what it was.
REACH = 500.0
#: A jump of curvature below CURVATURE_JUMP over this, mm, is rounding: no path is larger.
LARGE = 1e4
#: A transition shorter than this, relative to the coordinates and the curves there, is dropped.
LEAST = 1e-9
#: Directions that turn by more than this, rad, are a reversal: no transition, the tool stops there.
REVERSAL = np.radians(175.0)
#: What is left of a curve between two transitions is left out below this share of the curve.
NO_REST = 1e-6
#: Places on each curve at which its third derivative, and then the transition, are sampled.
PLACES = 9
#: A third derivative between the places may be larger by this factor; errors of that are found afterwards.
BETWEEN = 1.5
#: Times that a transition is shortened by half before the joint stays as it is.
MOST_HALVINGS = 30
#: Newton steps that tell the length of a transition.
NEWTON_STEPS = 40
#: Share of what is left of the tolerance that transitions use: the rest covers rounding and what lies between samples.
JOINT = 0.95
#: A parameter this near a knot, relative to the largest one, is the knot.
SAME_KNOT = 1e-12
#: How often the halves of a quintic hold each of its points (de Casteljau's algorithm; The NURBS Book, 2nd ed., A1.5).
_FRONT: Array = np.array([[1, 0, 0, 0, 0, 0], [16, 16, 0, 0, 0, 0], [8, 16, 8, 0, 0, 0], [4, 12, 12, 4, 0, 0],
                          [2, 8, 12, 8, 2, 0], [1, 5, 10, 10, 5, 1]]) / [[1], [32], [32], [32], [32], [32]]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Done:
    """Curves that are final; first, feed, said (n,) as of a Batch; markers by the number of the curve among these."""

    flat: Flat
    first: IntArray
    feed: Array
    said: Array
    markers: list[Marker]


@dataclass
class Assembly:
    """Make transitions at the joints of the curves that come, from one to the other with continuous curvature.

    Parameters
    ----------
    axes : tuple of str
        As for `smoothed`.
    angular : float
        Tolerance of rotary axes, rad.
    rounded : bool
        Whether corners are rounded.
    gap : float, optional
        Of the paths, mm.
    made : int, optional
        Transitions so far.
    """

    axes: tuple[str, ...]
    angular: float
    rounded: bool
    gap: float = 0.0
    made: int = 0
    _last: LineBatch | None = None
    _begin: Transitions | None = None  # of the joint before the last one

    def push(self, batch: LineBatch | None, last: bool, markers: list[Marker]) -> Done | None:
        """Take more curves; those that are final, all with `last`, with those of `markers` that stand among them.

        These are taken from the list; they are in order, `before` being the number of a curve of the path.
        """
        given = [each for each in (self._last, batch) if each is not None]
        if not given:
            return None
        batch = LineBatch.joined(given)
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
        self._last = None if last else batch.part(count, count + 1)
        self._begin = Transitions(*(each[-1:] for each in made))
        return done

    def _put_together(self, batch: LineBatch, base: Path, made: Transitions, count: int, markers: list[Marker]) -> Done:
        """The first `count` curves, as the transitions leave them, and the transitions behind them."""
        flat = batch.flat
        nothing = Transitions(*(np.zeros(1),) * 3, np.zeros((1, 6, len(self.axes))))
        # of each curve the transition before it, and that behind it one further on
        around = self._begin or nothing, made, nothing
        reach, leaves, enters, points = (np.concatenate(each)[: count + 1] for each in zip(*around, strict=True))
        reached = np.stack([reach[:-1], reach[1:]], axis=1) > 0.0
        ends = np.where(reached[..., None], np.stack([points[:-1, 5], points[1:, 0]], axis=1), base.ends[:count])
        us = np.where(reached, np.stack([enters[:-1], leaves[1:]], axis=1), flat.domains[:count])
        lengths = np.diff(base.curve_starts)[:count]
        left = lengths - reach[:-1] - reach[1:] > NO_REST * lengths
        cut = reached.any(axis=1)
        straight = (flat.degrees[:count] == 1) & (np.diff(flat.point_starts[: count + 1]) == 2)
        # the place of each part: 4 i is what is left of curve i, 4 i + 1 the transition behind it or its first half,
        # 4 i + 2 its second half, which stands for the next curve where feed or tolerance changes in the middle
        whole, lines, bent = (np.flatnonzero(left & each) for each in (~cut, cut & straight, cut & ~straight))
        parts = [(4 * whole, flat.chosen(whole)), (4 * lines, Flat.beziers(ends[lines]))]
        if len(bent):
            curves = zip((base.joined[i] for i in bent.tolist()), us[bent].tolist(), strict=True)
            parts.append((4 * bent, Flat.of([section(curve, *(at_knot(curve, x) for x in u)) for curve, u in curves])))
        led = np.flatnonzero(reached[:, 1])
        quintics = points[led + 1]
        # where nothing is left of a curve, one transition begins at the end of the other
        closed = ~left[led] & reached[led, 0]
        quintics[closed, 0] = points[led[closed], 5]
        split = np.append(batch.apart[1:], False)[led]
        front = np.einsum("ij,njk->nik", _FRONT, quintics[split])
        back = np.einsum("ij,njk->nik", _FRONT[::-1, ::-1], quintics[split])
        back[:, 0] = front[:, 5]
        quintics[split] = front
        parts += [(4 * led + 1, Flat.beziers(quintics)), (4 * led[split] + 2, Flat.beziers(back))]
        place = np.concatenate([each for each, _ in parts])
        order = np.argsort(place)
        place = place[order]
        begins = np.searchsorted(place, 4 * np.arange(count + 1) - 2)  # where each begins, the one behind included
        of = (place + 2) // 4
        return Done(
            Flat.joined([part for _, part in parts if len(part)]).chosen(order),
            batch.first[of],
            batch.feed[of],
            batch.said[of],
            _placed(batch, begins, len(place), markers),
        )


def _placed(batch: LineBatch, begins: IntArray, total: int, markers: list[Marker]) -> list[Marker]:
    """Markers that stand before curves that are final, taken from the list, with the numbers of these."""
    out = []
    while markers:
        i = int(np.searchsorted(batch.first, markers[0].before))
        if i >= len(begins) or i >= len(batch) or begins[i] >= total:
            break
        out.append(replace(markers.pop(0), before=int(begins[i])))
    return out


def at_knot(curve: NurbsCurve, u: float) -> float:
    """The knot that u is but for rounding, or u."""
    nearest = float(curve.breaks[np.argmin(np.abs(curve.breaks - u))])
    size = max(map(abs, curve.domain))
    return nearest if abs(nearest - u) <= SAME_KNOT * size and nearest not in curve.domain else u


class Transitions(NamedTuple):
    """One transition a joint, or none.

    Parameters
    ----------
    reach : (joints,) array
        Arc length that it takes of either curve, mm; 0 for none.
    before, behind : (joints,) array
        Parameters at which it leaves the curve in front, and meets the one behind.
    points : (joints, 6, axes) array
        Bezier points of degree 5.
    """

    reach: Array
    before: Array
    behind: Array
    points: Array


def transitions(path: Path, tolerance: Array, angular: Array, free: BoolArray) -> Transitions:
    """Transitions of the joints (curves - 1,) that are `free`, within tolerance (joints,), mm, and angular, rad.

    With r(s) by arc length of the linear axes, and p the quintic that meets r, r' and r'' at s = -d and d:
    |p - r| <= TANGENT |jump of r'| d + BEND |jump of r''| d^2 + RATE max |r'''| d^3, d at most half of each curve.
    Between two lines p is the quartic V - d T1 (1-u)^3 (1+u) + d T2 u^3 (2-u), its distance 3/8 d sin(angle / 2).
    Source of the form: Sencer, Ishizaki, Shamoto, "A curvature optimal sharp corner smoothing algorithm for high-speed
    feed motion generation of NC systems along linear tool paths", Int. J. Adv. Manuf. Technol. 76 (2015), 1977-1992,
    doi 10.1007/s00170-014-6386-2; their middle points differ, ours keep the speed even.
    """
    count, linear = len(path.flat), path.linear
    joint = np.arange(count - 1)
    lengths = np.diff(path.curve_starts)
    domains = path.flat.domains
    left = path.by_length(joint, domains[:-1, 1], side="left")
    right = path.by_length(joint + 1, domains[1:, 0])
    jumps = right - left
    tangent = _norms(jumps[:, 1], linear)
    bend = _norms(jumps[:, 2], linear)
    angle = angles(left[:, 1, :linear], right[:, 1, :linear])
    bent = 1.0 / LARGE + np.linalg.norm(left[:, 2], axis=1) + np.linalg.norm(right[:, 2], axis=1)
    rough = (tangent.max(axis=1) > 0.5 * CORNER_ANGLE) | (bend.max(axis=1) > 0.5 * CURVATURE_JUMP * bent)
    wanted = free & rough & (angle < REVERSAL) & np.isfinite(tangent).all(axis=1) & np.isfinite(bend).all(axis=1)
    reach = np.where(wanted, np.minimum(0.5 * np.minimum(lengths[:-1], lengths[1:]), REACH * tolerance), 0.0)
    straight = path.flat.degrees == 1
    curved = wanted & ~(straight[:-1] & straight[1:])
    rate = np.zeros((count - 1, 2))
    if curved.any():
        rate[curved] = BETWEEN * _rates(path, joint[curved], reach[curved])
    allowed = np.column_stack([tolerance, angular])
    reach = np.where(wanted, np.minimum(reach, _longest(tangent, bend, rate, allowed, reach)), 0.0)
    # the result at one place does not depend on the size of the whole path, which a stream does not know
    reach[reach <= LEAST * (np.abs(left[:, 0, :linear]).max(axis=1, initial=0.0) + lengths[:-1] + lengths[1:])] = 0.0
    return _made(path, reach, curved & (reach > 0.0), allowed)


def _norms(vectors: Array, linear: int) -> Array:
    """Lengths over linear and over rotary axes (n, 2)."""
    return np.column_stack([np.linalg.norm(vectors[:, :linear], axis=1), np.linalg.norm(vectors[:, linear:], axis=1)])


def _rates(path: Path, joint: IntArray, reach: Array) -> Array:
    """Largest |r'''| (n, 2) over linear and rotary axes at PLACES on either side within `reach` (n,) of the joints."""
    at = path.curve_starts[joint + 1]
    largest = np.zeros((len(joint), 2))
    for side in (-1.0, 1.0):
        steps = side * reach[:, None] * (np.arange(PLACES) + 0.5) / PLACES
        curve, u = path.locate((at[:, None] + steps).ravel())
        third = path.by_length(curve, u)[:, 3]
        largest = np.maximum(largest, _norms(third, path.linear).reshape(len(joint), PLACES, 2).max(axis=1))
    return largest


def _longest(tangent: Array, bend: Array, rate: Array, allowed: Array, most: Array) -> Array:
    """Greatest d (joints,) up to `most` that keeps the bound of `transitions` within allowed (joints, 2)."""
    a, b, c = TANGENT * tangent, BEND * bend, RATE * rate
    with np.errstate(divide="ignore", invalid="ignore"):
        d = np.minimum(most[:, None], np.where(a > 0.0, allowed / a, np.inf))
        for _ in range(NEWTON_STEPS):  # what grows and bends upwards is reached from above
            over = np.maximum(((c * d + b) * d + a) * d - allowed, 0.0)
            d -= np.where(over > 0.0, over / ((3.0 * c * d + 2.0 * b) * d + a), 0.0)
    return np.asarray(d.min(axis=1))


def _made(path: Path, reach: Array, curved: BoolArray, allowed: Array) -> Transitions:
    """The quintics; those at curves are compared with what they replace, and shortened until they are near enough."""
    at = path.curve_starts[1:-1]
    count = len(at)
    before, behind = path.flat.domains[:-1, 1].copy(), path.flat.domains[1:, 0].copy()
    points = np.zeros((count, 6, len(path.axes)))
    open_ = np.flatnonzero(reach > 0.0)
    for _ in range(MOST_HALVINGS):
        if not len(open_):
            break
        d = reach[open_]
        # by the joint's own curves, not whichever lies there by a rounding
        before[open_] = _parameters(path, open_, at[open_] - d)
        behind[open_] = _parameters(path, open_ + 1, at[open_] + d)
        start = path.by_length(open_, before[open_], side="left")
        end = path.by_length(open_ + 1, behind[open_])
        points[open_] = hermite(start, end, 2.0 * d)
        open_ = open_[curved[open_]]
        off = _apart(path, points[open_], at[open_], reach[open_])
        open_ = open_[np.any(off > allowed[open_], axis=1)]
        reach[open_] *= 0.5
    reach[open_] = 0.0
    points.setflags(write=False)
    return Transitions(reach, before, behind, points)


def _parameters(path: Path, curve: IntArray, s: Array) -> Array:
    """Parameters (n,) of given curves (n,) at arc lengths s (n,) that lie on them but for rounding."""
    found, u = path.locate(np.clip(s, 0.0, path.length))
    domains = path.flat.domains[curve]
    return np.where(found < curve, domains[:, 0], np.where(found > curve, domains[:, 1], u))


def hermite(start: Array, end: Array, length: Array) -> Array:
    """Bezier points (n, 6, axes) of the quintics with given r, r', r'' (n, 3 or more, axes) at both ends.

    P1 = P0 + r' h / 5, P2 = P0 + 2 r' h / 5 + r'' h^2 / 20, and so backwards from P5; h = length (n,).
    """
    h = length[:, None]
    p0, p5 = start[:, 0], end[:, 0]
    return np.stack(
        [
            p0, p0 + 0.2 * h * start[:, 1], p0 + 0.4 * h * start[:, 1] + 0.05 * h * h * start[:, 2],
            p5 - 0.4 * h * end[:, 1] + 0.05 * h * h * end[:, 2], p5 - 0.2 * h * end[:, 1], p5,
        ],
        axis=1,
    )  # fmt: skip


def _apart(path: Path, points: Array, at: Array, d: Array) -> Array:
    """Largest distance (n, 2) over linear and rotary axes between quintics and path at equal shares of their length."""
    u = np.linspace(0.0, 1.0, 2 * PLACES + 1)
    v = 1.0 - u
    basis = np.stack([v**5, 5 * u * v**4, 10 * u**2 * v**3, 10 * u**3 * v**2, 5 * u**4 * v, u**5])
    s = np.clip(at[:, None] + (2.0 * u - 1.0) * d[:, None], 0.0, path.length)
    apart = np.tensordot(basis, points, axes=(0, 1)) - path(s.T)
    off: Array = _norms(apart.reshape(-1, len(path.axes)), path.linear).reshape(len(u), len(points), 2).max(axis=0)
    return off
