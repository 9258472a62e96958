"""Where the cells lie: by how much the path turns and how long the motion lasts over each, gently graded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.conditions import INSIDE, Conditions
from splinefeed.planner.constants import ALMOST, HALVINGS
from splinefeed.planner.rows import FREE
from splinefeed.planner.solve import End
from splinefeed.records import Array, BoolArray

#: Most change from one sample to the next: turn of the tangent, rad, and q as a share of itself; q below this share of
#: the greatest is slow.
CHANGE, SLOW = 0.2, 1e-3
#: q is above this, mm^2/s^2, so that it can be divided by.
LEAST = 1e-60
#: Where nothing limits the jerk, acceleration builds up in the inverse of this share of the time to the top feed.
ABRUPT = 100.0
#: Length of cells next to rest, as a share of their distance from it.
GROWTH = 0.35
#: Cells near an end in motion are those within so many times the way on which the motion surely comes to rest.
AHEAD = 2.0
#: Cells in a window along which nothing changes.
STEADY = 30.0
#: The feed changes where the acceleration along the path is above the inverse of this share of what is possible.
CHANGING = 3.0
#: Of two breaks nearer than this share of the way of a period one ends a cell; times `fine`, see `lay`.
SLIVER = 0.03
#: Samples towards both ends, each at half the distance of the one before, down to INSIDE.
TOWARDS = 0.5 ** np.arange(1.0, -np.log2(INSIDE))
#: The rounding of a piece's time t, eps t v, looks like a jerk of 60 eps v / t^2: at this share of sqrt(v / J) like a
#: thousandth of J. What turns within less is seen by the audit alone.
FINEST = (6e4 * np.finfo(float).eps) ** 0.5
#: No window has more cells, nor more samples.
MOST_CELLS = 200_000
#: Cells are counted first over so many breaks, as a share of the cells sought; then over so many times the breaks that
#: seem to be enough.
FEW, MORE = 1 / 16, 1.2
#: The motion may pass a jump this much faster than is thought when cells are laid.
FASTER = 1.03
#: A cell is no more than this many times as long as its neighbour.
RATIO = 2.2


@dataclass(frozen=True, eq=False)
class Samples:
    """Places along a stretch, dense where it turns and where the feed changes.

    Parameters
    ----------
    s : (n,) array
        Places, mm.
    top : (n,) array
        mm^2/s^2, about what limits of velocity and acceleration allow q to be.
    q : (n,) array
        What the acceleration along the path can follow of it.
    turn : (n,) array
        1/mm.
    directions : (n, k) array
        Of the path.
    push, twist : float
        Acceleration, mm/s^2, and jerk, mm/s^3, along the path that are possible where it is straight.
    """

    s: Array
    top: Array
    q: Array
    turn: Array
    directions: Array
    push: float
    twist: float


def sample(
    conditions: Conditions, low: float, high: float, q_low: float, q_high: float, known: Samples | None = None
) -> Samples:
    """Find places between two ends, parted until tangent and feed change little from one to the next.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    low, high : float
        The ends, mm.
    q_low, q_high : float
        q there, mm^2/s^2.
    known : Samples, optional
        From `low` to `high` or further, to go on from.

    Returns
    -------
    Samples
        Where nothing limits the jerk or the acceleration, they are what the top feed can do with: see ABRUPT.
    """
    edges = np.concatenate([[low], conditions.inside(low, high), [high]])
    if known is None or not known.s[0] < high:
        share = np.array([INSIDE, 0.5, 1.0 - INSIDE])
        s = (edges[:-1, None] + np.diff(edges)[:, None] * share).ravel()
        s = np.sort(np.concatenate([s, low + (edges[1] - low) * TOWARDS, high - (high - edges[-2]) * TOWARDS]))
        looked, push, twist = _look(conditions, s)
    else:
        looked, push, twist = [known.top, known.turn, known.directions], known.push, known.twist
        s = known.s
        if high < s[-1]:
            inside = int(np.searchsorted(s, high))
            ending = high - (high - max(edges[-2], s[inside - 1])) * TOWARDS
            s = np.append(s[:inside], ending)
            looked = [
                np.append(a[:inside], b, axis=0) for a, b in zip(looked, _look(conditions, ending)[0], strict=True)
            ]
    for _ in range(HALVINGS):
        top, turn, directions = looked
        q = profile(s, top, push, twist, low, high, q_low, q_high)
        gap, piece = np.diff(s), np.searchsorted(edges, s)
        bend = np.linalg.norm(np.diff(directions, axis=0), axis=1)
        bend = np.maximum(bend, gap * np.minimum(turn[1:], turn[:-1]))
        change = np.abs(np.diff(q)) / (np.maximum(q[1:], q[:-1]) + SLOW * np.max(q))
        parts = np.clip(np.maximum(bend, change), CHANGE, 1.0) / CHANGE
        parts[(gap <= ALMOST * (high - low)) | (piece[1:] != piece[:-1])] = 1.0
        more = np.ceil(parts - ALMOST).astype(int) - 1
        at = np.repeat(np.arange(len(gap)), more)
        if not len(at):
            break
        share = (np.arange(len(at)) - np.repeat(np.cumsum(more) - more, more) + 1.0) / (more[at] + 1.0)
        new = s[at] + share * gap[at]
        s = np.insert(s, at + 1, new)
        looked = [np.insert(a, at + 1, b, axis=0) for a, b in zip(looked, _look(conditions, new)[0], strict=True)]
        if len(s) > MOST_CELLS:
            raise _too_sharp(conditions, low, high, len(s))
    q = profile(s, looked[0], push, twist, low, high, q_low, q_high)
    return Samples(s, looked[0], q, looked[1], looked[2], push, twist)


@np.errstate(divide="ignore", over="ignore", invalid="ignore")
def _look(conditions: Conditions, s: Array) -> tuple[list[Array], float, float]:
    """At places: what velocity and acceleration allow q to be, how fast the path turns, directions; push and twist."""
    seen = conditions.along(s)
    rows = conditions.rows(s, seen)
    directions, turn = conditions.directions(*seen)
    linear = rows.linear[:, 0]
    a = np.max(np.abs(linear) / np.where(linear > 0.0, rows.high, -rows.low), axis=0, initial=0.0)
    j = np.max(np.abs(rows.jerk[:, 0]), axis=0, initial=0.0)
    top = np.maximum(np.minimum(rows.top, np.minimum(1.0 / a, j ** (-2.0 / 3.0))), LEAST)
    push = float(np.min(0.25 * (rows.high - rows.low) / np.abs(rows.linear[:, 1]), initial=np.inf))
    twist = float(np.float64(0.5) / np.max(np.abs(rows.jerk[:, 2]), initial=0.0))
    v = float(np.max(top)) ** 0.5
    push = min(push, (v * twist) ** 0.5)
    return [top, turn, directions], push, min(twist, ABRUPT * push**2 / v)


def profile(
    s: Array, top: Array, push: float, twist: float, low: float, high: float, q_low: float, q_high: float
) -> Array:
    """The part of q (n,) at places s that a motion can follow from and to the ends, mm^2/s^2.

    By its acceleration |dq/ds| <= 2 push, and out of a dip by its jerk |d(q^(3/4))/ds| <= sqrt(9/2 twist): what
    s = v0 t + J t^3/6 and v = v0 + J t^2/2 give, 3/2 J t / sqrt(v), at most.
    """
    q = top
    for rate, power in ((2.0 * push, 1.0), ((4.5 * twist) ** 0.5, 0.75)):
        if rate < np.inf:
            w = np.minimum.reduce([q**power, q_low**power + rate * (s - low), q_high**power + rate * (high - s)])
            rise = rate * (s - low)
            w = np.minimum.accumulate(w - rise) + rise
            w = np.minimum.accumulate((w + rise)[::-1])[::-1] - rise
            q = np.maximum(w, LEAST**power) ** (1.0 / power)
    return np.maximum(q, LEAST)


def density(samples: Samples, q: Array, size: float) -> Array:
    """Cells a mm at samples: where the path turns and where the feed changes.

    One for each `size` rad of the path, and one for each `size` sqrt(v / J) of time, s, at the feed v = sqrt(q), mm/s,
    under the jerk J along the path; none shorter than FINEST of that time.
    """
    slope = np.abs(np.diff(q)) / np.maximum(np.diff(samples.s), 1e-300) / (2.0 * samples.push)
    slope = np.minimum(CHANGING * slope, 1.0)
    change = np.maximum(np.append(slope[:1], slope), np.append(slope, slope[-1:]))
    ramp = samples.twist**0.5 / q**0.75
    found: Array = np.minimum((samples.turn + change * ramp) / size, ramp / FINEST)
    return found


def lay(
    conditions: Conditions,
    samples: Samples,
    q: Array,
    low: float,
    high: float,
    ends: tuple[End, End],
    size: float,
    fine: float,
) -> tuple[Array, BoolArray]:
    """Lay nodes between the ramps at both ends.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    samples : Samples
        Of the stretch.
    q : (n,) array
        What is thought of q at the samples, mm^2/s^2.
    low, high : float
        The ends, mm.
    ends : (End, End)
        How the motion is there.
    size : float
        Of cells, see `density`.
    fine : float
        Length of cells near ends in motion, as a share of what they would be else.

    Returns
    -------
    nodes : (n + 1,) array
        mm.
    jumps : (n + 1,) array of bool
        At which of them the path jumps.
    """
    ramps = ends[0].ramp, ends[1].ramp
    begin, end = low + ramps[0], high - ramps[1]
    edges = np.concatenate([[begin], conditions.inside(begin + ramps[0], end - ramps[1]), [end]])
    edges = _worth_a_cell(conditions, samples.s, q, _with_reach(conditions, samples.s, q, edges, fine), fine)
    wanted = density(samples, np.maximum(q, 2.0 * samples.push * max(ramps)), size) + STEADY / (high - low)
    for state, far in zip(ends, (samples.s - low, high - samples.s), strict=True):
        braking = 0.5 * state.q / samples.push + state.q**0.5 * samples.push / samples.twist
        wanted[far <= AHEAD * braking] /= fine
    growth = GROWTH * fine
    total = _total(samples.s, wanted)
    at = np.interp(edges, samples.s, total)
    counts = np.maximum(np.ceil(np.diff(at) - ALMOST), 1.0)
    if not np.sum(counts) < MOST_CELLS:
        raise _too_sharp(conditions, low, high, float(np.sum(counts)))
    owner = np.repeat(np.arange(len(counts)), counts.astype(int))
    share = (np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]) / counts[owner]
    nodes = np.interp(at[owner] + share * np.diff(at)[owner], total, samples.s)
    nodes[share == 0.0] = edges[:-1]
    nodes = np.unique(np.append(nodes, end))
    cells, apart = np.diff(nodes), np.diff(edges)
    first, last = (
        1.5 * growth * end.ramp if end.rest else min(cells[at], fine * min(apart[at], end.way(side)))
        for end, at, side in zip(ends, (0, -1), (1.0, -1.0), strict=True)
    )
    for _ in range(HALVINGS):  # geometric from both ends
        away = np.maximum(growth * (nodes[1:] - low), first), np.maximum(growth * (high - nodes[:-1]), last)
        cut = np.diff(nodes) > np.minimum(*away) * (1.0 + ALMOST)
        if not cut.any():
            break
        nodes = _halved(nodes, cut)
    nodes = graded(nodes, np.zeros(len(nodes) - 1, dtype=bool))
    return nodes, np.isin(nodes, edges[1:-1])


def _halved(nodes: Array, cut: BoolArray) -> Array:
    """Nodes with the cells of `cut` (n,) halved, but for those that are too short for that."""
    return np.unique(np.concatenate([nodes, (0.5 * (nodes[1:] + nodes[:-1]))[cut]]))


def _with_reach(conditions: Conditions, s: Array, q: Array, edges: Array, fine: float) -> Array:
    """Edges (k,) and, on both sides of each jump that matters, those where its reach of one period ends."""
    real, there = conditions.jumps_worth_cells(float(edges[0]), float(edges[-1]), s, q)
    if not len(real):
        return edges
    reach = FASTER * float(conditions.period or 0.0) * np.sqrt(there)
    more, apart = np.concatenate([real - reach, real + reach]), 0.25 * fine * np.concatenate([reach, reach])
    beside = np.clip(np.searchsorted(edges, more), 1, len(edges) - 1)
    clear = (more - edges[beside - 1] > apart) & (edges[beside] - more > apart)
    return np.unique(np.concatenate([edges, more[clear]]))


def _worth_a_cell(conditions: Conditions, s: Array, q: Array, edges: Array, fine: float) -> Array:
    """Edges (k,) without those that follow another one within a share of the way of a period.

    Next to a wide cell a sliver makes only work: it is graded up to it, and tells no setpoint anything. Corners passed,
    and where the slope of q jumps, are kept.
    """
    if conditions.period is None:
        return edges
    least = SLIVER * fine * conditions.period * np.sqrt(np.interp(edges, s, q))
    held = np.isin(edges, np.concatenate([conditions.passed[0], conditions.breaks[conditions.slope_jumps != 0.0]]))
    held[[0, -1]] = True
    keep = np.ones(len(edges), dtype=bool)
    for k in (np.flatnonzero(np.diff(edges) < least[1:]) + 1).tolist():
        last = k - 1
        while not keep[last]:
            last -= 1
        if edges[k] - edges[last] < least[k]:
            drop = k if not held[k] else last
            keep[drop] = held[drop]
    return edges[keep]


def _total(s: Array, wanted: Array) -> Array:
    """Cells from the first place to each, (n,), of so many a mm."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (wanted[1:] + wanted[:-1]) * np.diff(s))])


def _too_sharp(conditions: Conditions, low: float, high: float, cells: float) -> PlanError:
    return PlanError(
        f"{conditions.between(low, high)} the path bends too sharply for its limits: {cells:.3g} cells would be "
        "needed; smooth it there"
    )


def counted(
    conditions: Conditions, low: float, high: float, size: float, cells: int, joins: float
) -> tuple[float, float, Samples]:
    """How far about so many cells reach from `low`, mm: `high`, where the path ends, if only `joins` times as many do.

    With it what share of so many cells there is up to `high`, and the samples.
    What lies behind does not matter, so that a path which comes in parts is cut as one that is known whole.
    """
    inner = conditions.inside(low, high)
    count = int(joins * cells * FEW)
    while True:
        far = float(inner[count]) if len(inner) > count else high
        samples = sample(conditions, low, far, FREE, FREE)
        wanted = density(samples, np.maximum(samples.top, SLOW * np.maximum.accumulate(samples.top)), size)
        total = _total(samples.s, wanted)
        edges = np.concatenate([[low], inner[:count], [far]])
        at = np.interp(edges, samples.s, total)
        so_far = np.concatenate([[0.0], np.cumsum(np.maximum(np.ceil(np.diff(at)), 1.0))])
        share = float(so_far[-1]) / (joins * cells)
        if far == high or share > 1.0:
            break
        count = int(count * MORE / share) + 1
    near = high if far == high and share <= 1.0 else float(np.interp(np.interp(cells, so_far, at), total, samples.s))
    return near, share, samples


def graded(nodes: Array, cut: BoolArray) -> Array:
    """Nodes with the cells of `cut` (n,) halved, and others until none is more than RATIO times its neighbour."""
    for _ in range(HALVINGS):
        h = np.diff(nodes)
        while True:
            size = np.where(cut, 0.5, 1.0) * h
            more = np.zeros(len(h), dtype=bool)
            more[1:] |= size[1:] > RATIO * size[:-1]
            more[:-1] |= size[:-1] > RATIO * size[1:]
            if not np.any(more & ~cut):
                break
            cut = cut | more
        if not cut.any():
            break
        nodes = _halved(nodes, cut)
        cut = np.zeros(len(nodes) - 1, dtype=bool)
    return nodes
