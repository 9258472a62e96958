"""One window of a path from state to state: grid, optimum, audit, and again where the audit found it over a limit."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.audit import worst_shares
from splinefeed.planner.bound import lower_bound
from splinefeed.planner.conditions import BESIDE, INSIDE, Conditions
from splinefeed.planner.constants import ALMOST, KEPT, ROUNDS, SAME
from splinefeed.planner.grid import FASTER, SLOW, Samples, graded, lay, sample
from splinefeed.planner.law import MotionPieces, pieces_of
from splinefeed.planner.rows import FREE, TINY, Rows
from splinefeed.planner.solve import End, Problem, Solution, solve
from splinefeed.planner.spline import DEGREE, Spline
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records import State as State
from splinefeed.records.modelled import ModelRows

#: A ramp at rest is this share of the way over which jerk builds up the acceleration, of the way to the next knot, and
#: of the stretch: nothing bends within it, and a cell fits in behind it.
RAMP = 0.01
#: ... and the path turns by no more than this on it, rad.
TURN = 0.05
#: The first guess of q, as a share of what limits of velocity and acceleration allow or of another solution.
GUESS = 0.6
#: Share of every limit, as a factor on q, that motion leaves which is planned again: cells then lie elsewhere, and a
#: motion from a state on it at its very limits might not keep them.
YIELDING = 3e-3
#: What the audit may not see of a peak between its places, as a factor on q: 3e-6 was found.
UNSEEN = 1e-5
#: How much of the time of a window the feed counts that is sought at an end, first and then: much leads past no motion
#: that is slower on the way, and with little a slower one may end sooner.
COUNTS = 0.25, 4.0
#: What of a state may be missing, as a factor on q, where it is thought to be in reach: more is not from rounding.
REACHED = 1e-3
#: Places at which a piece of another motion is looked at.
LOOKED = 9
#: Cells on either side of one that is held lower that change with it, if these are no more than this share of all.
NEAR, MANY = 12, 0.6


@dataclass(frozen=True)
class SolverSettings:
    """How closely a motion is planned.

    Parameters
    ----------
    cell : float
        Over which the path turns, rad, and time over it, in units of sqrt(v / J), at most; see `grid.density`.
    tolerance : float
        Share of the time by which a solution may miss the optimum on its cells, and share of a limit, as a factor on q,
        by which the audit may find a motion over it.
    cells : int
        In a window, about.
    open : float
        Share of these, the last ones, that do not become final where a window goes on: the end at rest is near.
    yielding : bool, optional
        Whether these leave YIELDING of every limit.
    bounded : bool, optional
        Whether a lower bound of the time is wanted.
    spare : float, optional
        Share of every limit, as a factor on q, that a motion with an end in motion leaves.
    fine : float, optional
        Length of cells near ends in motion, as a share of what they would be else. Where that is below 1 what bends
        within a step of a place is left to the setpoints, see `Conditions.rows`.
    """

    cell: float
    tolerance: float
    cells: int
    open: float
    yielding: bool = False
    bounded: bool = False
    spare: float = 0.0
    fine: float = 1.0


@dataclass(frozen=True, eq=False)
class Plan:
    """Motion over a window.

    Parameters
    ----------
    pieces : MotionPieces
        The motion.
    bound : float
        A lower bound of its time, s.
    over : float
        The largest share of a limit in it, as a factor on q; infinite where its states are not those given.
    share : float, optional
        The largest share of the states at its ends, as a factor on q, between which its cells allow a motion: where it
        is below 1, that motion.
    """

    pieces: MotionPieces
    bound: float
    over: float
    share: float = 1.0

    def q(self, samples: Samples) -> Array:
        """Its q at samples (n,), mm^2/s^2, and not almost 0."""
        t = np.linspace(0.0, 1.0, LOOKED)
        s, v, _, _ = self.pieces.at(np.broadcast_to(t[:, None], (LOOKED, len(self.pieces))))
        found = np.interp(samples.s, s.T.ravel(), np.square(v.T.ravel()))
        return np.maximum(found, SAME * samples.q)

    @property
    def seconds(self) -> float:
        """How long it takes when it is slowed down until every limit holds."""
        return self.pieces.duration * float(np.sqrt(max(self.over, 1.0)))


class Horizon:
    """The cells of a window and their problem.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    samples : Samples
        Of the stretch.
    known : (n,) array or None
        q at the samples in another motion between these ends, mm^2/s^2: it decides where cells lie, else `samples.q`.
    ends : (End, End)
        How the motion is at both ends.
    low, high : float
        The ends, mm.
    mode : SolverSettings
        How closely to plan.
    laid : tuple, optional
        Nodes (n + 1,) and at which of them the path jumps, if they are known.
    """

    def __init__(
        self,
        conditions: Conditions,
        samples: Samples,
        known: Array | None,
        ends: tuple[End, End],
        low: float,
        high: float,
        mode: SolverSettings,
        laid: tuple[Array, BoolArray] | None = None,
    ) -> None:
        self.conditions, self.samples, self.ends, self.low, self.high = conditions, samples, ends, low, high
        q = samples.q if known is None else known
        self.known = known is not None
        self.q, self.alone = q, mode.fine < 1.0
        nodes, jumps = laid or lay(conditions, samples, q, low, high, ends, mode.cell, mode.fine)
        self.nodes, self.jumps = nodes, jumps
        self.spline = Spline.on(nodes, jumps, conditions.slope_jumps_at(nodes, jumps))
        cell, part, weight, shift = _with_breaks(conditions, nodes, *_simpson(nodes, jumps))
        h = np.diff(nodes)
        x = nodes[cell] + part * h[cell]
        self.at = nodes[cell] + np.clip(part, INSIDE, 1.0 - INSIDE) * h[cell] + shift
        self.fast = FASTER * np.sqrt(np.interp(x, samples.s, q))
        self.cell = cell
        self.beside = np.clip(cell + np.where(part == 1.0, 1, np.where(part == 0.0, -1, 0)), 0, len(h) - 1)
        self.own = jumps[cell + (part == 1.0)] & ((part == 0.0) | (part == 1.0))  # of two places at one node
        self.x, self.weight = x, weight
        self.free = self.rows(None)
        self.between(ends, COUNTS[0])

    def __len__(self) -> int:
        return len(self.nodes) - 1

    def again(self, c: Array, mode: SolverSettings, cut: BoolArray | None = None) -> tuple[Horizon, IntArray]:
        """The window laid again by a solution c, or with cells of `cut` (n,) halved; which cell each new one was."""
        laid = None
        if cut is not None:
            nodes = graded(self.nodes, cut)
            laid = nodes, np.isin(nodes, self.nodes[self.jumps])
        found: Array = self.spline.at(c, np.clip(self.samples.s, self.nodes[0], self.nodes[-1]))[0]
        q = np.maximum(found, SAME * self.samples.q)  # less is not a motion but rows that contradict each other
        new = Horizon(self.conditions, self.samples, q, self.ends, self.low, self.high, mode, laid=laid)
        return new, np.clip(np.searchsorted(self.nodes, new.nodes[:-1], side="right") - 1, 0, len(self) - 1)

    def between(self, ends: tuple[End, End], counts: float = 0.0) -> None:
        """Make the problem between these ends; a feed that is sought counts as so much of the time of the window."""
        weight = self.weight.copy()
        time = np.sum(weight / np.sqrt(np.interp(self.x, self.samples.s, self.q)))
        for end, place in zip(ends, (0, -1), strict=True):
            if end.at_most:
                weight[place] += counts * time * end.q**0.5
        self.problem = Problem(self.spline, self.cell, self.x, weight, self.free, ends)
        self.hold(np.ones((3, len(self))))

    def arrived(self, c: Array, factor: Array, tolerance: float) -> Solution:
        """The solution between the states at the ends, or as near to them as cells allow: see `share`."""
        start, stop = (dataclasses.replace(end, at_most=False) for end in self.ends)
        z: Array | None = None
        for counts in COUNTS:
            self.between(self.ends, counts)
            self.hold(factor)
            found = solve(self.problem, c, tolerance, z)
            c, z = found.c, found.z
            if self.share(c) > 1.0 - REACHED:
                self.between((start, stop))
                self.hold(factor)
                return solve(self.problem, c, tolerance, z)
        return found

    def hold(self, factor: Array) -> None:
        """Have q lower by factors on cells (3, n), see `Rows.tightened`; a node counts for both of its cells."""
        rows = self.free.tightened(np.minimum(factor[:, self.cell], factor[:, self.beside]))
        for end, place in zip(self.problem.ends, (0, -1), strict=True):
            if end.at_most:
                rows.top[place] = end.q
        self.problem.hold(rows)

    def share(self, c: Array) -> float:
        """The share of the states at the ends that a solution c has, as a factor on q: the smaller one."""
        return min(float(c[place] / end.q) for end, place in zip(self.ends, (0, -1), strict=True) if not end.rest)

    def rise(self, way: float, cells: BoolArray, least: float) -> None:
        """Have the tip speed up (`way` 1) or slow down (-1) over these cells (n,), by `least`, mm/s^2, or more.

        There the limit of jerk is the one for that, but at nodes that the cells share with others.
        """
        both, any_of = cells[self.cell] & cells[self.beside], cells[self.cell] | cells[self.beside]
        both, any_of = (np.where(self.own, cells[self.cell], each) for each in (both, any_of))
        for end, place in zip(self.ends, (0, -1), strict=True):
            if not end.rest:
                any_of[place] = False  # the state there is given
        rows = self.rows(np.where(both, way, 0.0))
        low = np.where(any_of, 1.0, -FREE)[None]
        signed = np.stack(self.tip)[None] * (way * any_of / least)
        rise = ModelRows(linear=signed, low=low, high=np.full(low.shape, FREE))
        self.free = rows.joined(rise, smooth=False)

    def solved_near(self, near: BoolArray, c: Array, tolerance: float, z: Array) -> Solution | None:
        """The solution if only cells of `near` (n,) may change; None if limits ask for more, or these are all."""
        if np.all(near):
            return None
        part, used, at = self.problem.part(near, c)
        found = solve(part, c[used], tolerance, z[:, at])
        if not found.kept:
            return None
        c, z = c.copy(), z.copy()
        c[used], z[:, at] = found.c, found.z
        return dataclasses.replace(found, c=self.problem.complete(c), z=z)

    def guess(self) -> Array:
        """Guess coefficients to begin with.

        Returns
        -------
        (m,) array
            A share of the least q that is thought to be where each acts, or towards a state another motion's q, less
            next to rest, and so little that every row holds: a solution from there hangs less on rounding.
        """
        at, size = self.spline.greville(), self.spline.size
        thought = np.interp(self.spline.t, self.samples.s, self.q)
        c: Array = GUESS * np.min([thought[k : k + size] for k in range(DEGREE + 2)], axis=0)
        if self.known and any(end.at_most for end in self.ends):
            c = np.interp(at, self.samples.s, self.q)
        for end, away, place in ((self.ends[0], at - self.low, 0), (self.ends[1], self.high - at, -1)):
            if end.rest:
                ramp = (np.maximum(away, end.ramp) / end.ramp) ** (4.0 / 3.0)
                c = np.minimum(c, 0.9 * self.problem.rows.top[place] * ramp)
        q, slope, bend = self.problem.look(self.problem.complete(c))[0]
        v = np.sqrt(np.maximum(q, TINY))
        c /= max(1.0, float(np.max(self.problem.rows.shares(v, 0.5 * slope, 0.5 * v * bend))))
        return c

    def of_cells(self, shares: Array) -> Array:
        """Shares of pieces (3, m) as those of cells (3, n): any on a ramp counts for q in the cell beside it."""
        inner = shares[:, int(self.ends[0].rest) : shares.shape[1] - int(self.ends[1].rest)].copy()
        for end, place in zip(self.ends, (0, -1), strict=True):
            if end.rest:
                inner[:, place] = np.maximum(inner[:, place], np.max(shares[:, place]))
        return inner

    def rows(self, rising: Array | None) -> Rows:
        """All limits at the places; rising (n,) of the tip, see `Conditions.rows`.

        Those of jerk on ramps are bounds of q at their inner ends: q = (9/2 ramp^2 j)^(2/3). Where a state is given, q
        and q' are as given.
        """
        d, x = self.conditions.along(self.at)
        signs = 0.0 if rising is None else rising
        rows = self.conditions.rows(self.at, (d, x), v=self.fast, rising=signs, alone=self.alone)
        self.tip = x[1, -1], 0.5 * x[0, -1]  # times q and q': the acceleration of the tip
        top = rows.top.copy()
        for end, place, way, at in ((self.ends[0], self.low, 1.0, 0), (self.ends[1], self.high, -1.0, -1)):
            if end.rest:
                unit = _ramp_unit(self.conditions, place, way * end.ramp)
                if unit > 0.0:
                    top[at] = min(top[at], (4.5 * end.ramp**2 / unit) ** (2.0 / 3.0))
            else:
                top[at], rows.low[:, at], rows.high[:, at] = FREE**2, -FREE, FREE
        return dataclasses.replace(rows, top=top)


def plan_window(
    conditions: Conditions,
    low: float,
    high: float,
    start: State,
    stop: State,
    mode: SolverSettings,
    exact: bool = False,
    known: Samples | None = None,
    like: Plan | None = None,
) -> Plan:
    """Plan the motion over a window between two states.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    low, high : float
        The ends, mm.
    start, stop : State
        How the motion is there.
    mode : SolverSettings
        How closely to plan.
    exact : bool, optional
        Whether the audit holds it to 1, not to 1 + `mode.tolerance`: for motion that is not slowed down afterwards, as
        one with an end in motion never is.
    known : Samples, optional
        From `low` to `high` or further.
    like : Plan, optional
        Another motion from `low` to `high`, which shows where cells lie and what to begin with.

    Returns
    -------
    Plan
        The motion.
    """
    if not high - low > SAME * conditions.track.length:
        raise PlanError(f"{conditions.between(low, high)} a limit leaves almost no feed")
    exact |= max(start.feed, stop.feed) > 0.0
    samples = sample(conditions, low, high, start.feed**2, stop.feed**2, known)
    if samples.push == np.inf:
        raise PlanError(f"{conditions.between(low, high)} nothing limits the acceleration or jerk")
    if start.feed**2 >= np.max(samples.top) and State(start.feed) == stop == start:  # nothing to choose
        steady = MotionPieces(np.array([(high - low) / start.feed]), np.array([[low, start.feed, 0.0, 0.0, 0.0, 0.0]]))
        most = float(np.max(worst_shares(conditions, steady, high)[0]))
        return Plan(steady, steady.duration, most if most > 1.0 + SAME else 0.0)
    ends = _ends(conditions, samples, low, high, start, stop)
    window = Horizon(conditions, samples, None if like is None else like.q(samples), ends, low, high, mode)
    if len(conditions.jumps_worth_cells(low, high, samples.s, samples.q)[0]):
        # cells beside a jump end where its reach does, which is a matter of the feed there
        rough = solve(window.problem, window.guess(), FASTER - 1.0)
        window, _ = window.again(rough.c, mode)
    c = window.guess()
    if conditions.two_jerks:
        window, c = _turned(conditions, window, c, mode)
    factor = np.full((3, len(window)), 1.0 - mode.spare)
    if mode.yielding:
        factor[:, len(window) - int(mode.open * len(window)) :] *= 1.0 - YIELDING
    goal = (1.0 - UNSEEN) * factor if exact else np.full_like(factor, 1.0 + mode.tolerance)
    often, near, almost = np.zeros_like(factor), np.ones(len(window), dtype=bool), 1.0 - 0.5 * mode.tolerance
    z: Array | None = None
    bound, before = 0.0, None
    found: list[Plan] = []
    for k in range(2 * ROUNDS + 1):
        window.hold(factor)
        solution = None
        if before is not None and z is not None:  # what was over a limit is solved again near itself only
            solution = window.solved_near(near, c, mode.tolerance, z)
        if any(end.at_most for end in window.problem.ends):
            solution = window.arrived(c, factor, mode.tolerance)
            share = window.share(solution.c)
            if share < 1.0:
                return Plan(pieces_of(window.spline, solution.c, ends), 0.0, np.inf, share)
        elif solution is None:
            solution = solve(window.problem, c, mode.tolerance, z)
        c, z = solution.c, solution.z
        if k == 0 and mode.bounded:
            bound = lower_bound(conditions, window.problem, solution, low, high, mode.tolerance)
        pieces = pieces_of(window.spline, c, ends)
        shares, below = worst_shares(conditions, pieces, high, before)
        broken = ~np.isfinite(np.max(window.of_cells(shares), axis=0))
        most = float(np.max(shares))
        gained = most < min((plan.over for plan in found), default=np.inf)  # what cannot be tightened gains nothing
        lost = exact and not solution.kept and (k == 0 or bool(np.any(broken)) or not gained)
        if np.any(broken) and k < 2 * ROUNDS and not lost:  # q falls to nothing between places
            window, was = window.again(c, mode, broken)
            factor, goal, often = factor[:, was], goal[:, was], often[:, was]
            c, z, before = window.guess(), None, None
            continue
        before = pieces, shares, below
        found.append(Plan(pieces, bound, most))
        over = window.of_cells(shares) / goal
        if lost or np.max(over) <= 1.0 or (k >= ROUNDS and found[-1].over <= 1.0 + KEPT):
            break
        worst = np.any(over > (1.0 if exact else almost), axis=0)  # as a whole a motion is slowed by its worst cell
        near = np.convolve(worst, np.ones(2 * NEAR + 1), mode="same")[: len(window)] > 0.5
        near |= np.mean(near) > MANY
        lower = near & (over > almost)
        often += lower  # a cell that stays over what it was tightened for is so between its places: tighten it more
        factor = np.where(lower, factor / (over * (1.0 + 0.5 * mode.tolerance)) ** often, factor)
    best = min(found, key=lambda plan: (exact and plan.over > 1.0 + KEPT, plan.seconds))
    unseen = 1.0 if exact else 1.0 + UNSEEN
    return dataclasses.replace(best, bound=bound, over=best.over * unseen)


def _turned(conditions: Conditions, window: Horizon, c: Array, mode: SolverSettings) -> tuple[Horizon, Array]:
    """Find a window where speeding up and slowing down have two limits of jerk.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    window : Horizon
        To begin with.
    c : (m,) array
        Its coefficients.
    mode : SolverSettings
        How closely to plan.

    Returns
    -------
    window : Horizon
        The window.
    c : (m,) array
        What to begin with.

    Notes
    -----
    Which limit holds depends on the sign of the tip's acceleration. Where it may be either the lower one does; over
    cells that clearly have the sign of the higher one, that, and the sign is held.
    """
    limits = conditions.limits
    way = 1.0 if limits.deceleration_jerk is None or limits.jerk > limits.deceleration_jerk else -1.0
    level = SLOW * window.samples.push
    for left in range(ROUNDS, 0, -1):
        found = solve(window.problem, c, mode.tolerance)
        if not found.kept:
            found = solve(window.problem, window.guess(), mode.tolerance)
        c = found.c
        y = window.problem.look(window.problem.complete(c))[0]
        slope = way * (window.tip[0] * y[0] + window.tip[1] * y[1])
        clear = np.ones(len(window), dtype=bool)
        np.logical_and.at(clear, window.cell, slope > level)
        np.logical_and.at(clear, window.beside, (slope > level) | window.own)
        if left > 1:
            beside = np.zeros(len(window), dtype=bool)
            beside[1:] |= clear[:-1]
            beside[:-1] |= clear[1:]
            before = window.spline
            window, was = window.again(c, mode, beside & ~clear)
            clear, c = clear[was], window.spline.of(before, c)
            if not len(window.problem.look(window.problem.complete(c))[2]):  # between places q fell to nothing
                c = window.guess()
        window.rise(way, clear, 0.5 * level)
        window.hold(np.ones((3, len(window))))
    return window, c


def _ends(
    conditions: Conditions, samples: Samples, low: float, high: float, start: State, stop: State
) -> tuple[End, End]:
    """What the optimiser knows of both ends."""
    way = min(samples.push**3 / (6.0 * samples.twist**2), high - low)
    inner = conditions.inside(low, high)
    ends = []
    for state, place in ((start, low), (stop, high)):
        away = np.abs(inner - place)
        beside = float(np.min(away[away > ALMOST * conditions.track.length], initial=way))
        moving = state.feed > 0.0
        turn = float(np.max(samples.turn, initial=0.0, where=np.abs(samples.s - place) <= RAMP * beside))
        ramp = max(min(RAMP * beside, TURN / max(turn, TINY)), ALMOST * (high - low))  # arc length must resolve it
        known = End(q=state.feed**2, slope=2.0 * state.acceleration, at_most=True)
        ends.append(known if moving else End(ramp=ramp))
    return ends[0], ends[1]


def _ramp_unit(conditions: Conditions, place: float, ramp: float) -> float:
    """Largest share of a limit of jerk along a ramp of jerk 1: |2 c2 + 6 c1 x + 9/2 c0 x^2|, x mm from rest.

    With s = j t^3 / 6: feed * acceleration = 3 j s and feed^3 = 9/2 j s^2. Backwards q' has the other sign.
    """
    way, away = float(np.sign(ramp)), abs(ramp) * np.array([1e-3, 0.2, 0.5, 0.8, 1.0 - INSIDE])
    places = place + way * away
    order = np.argsort(places)
    jerk, away = conditions.rows(places[order], rising=way).jerk, away[order]
    found = np.abs(2.0 * jerk[:, 2] + way * 6.0 * jerk[:, 1] * away + 4.5 * jerk[:, 0] * away**2)
    return float(np.max(found, initial=0.0))


def _simpson(nodes: Array, jumps: BoolArray) -> tuple[IntArray, Array, Array]:
    """Cell, place in it (0 to 1) and Simpson's weight of all places, in order.

    A node is a place of the cell behind it, and one more of that before it where the path jumps and at the end. Between
    them lies 1/2, or, where q'' may jump at both ends of a cell, 1/3 and 2/3 (Simpson's 3/8 rule): there the cubic that
    is 0 at 0, 1/2 and 1 would be free of every row and of the time.
    """
    h = np.diff(nodes)
    n = len(h)
    alone = jumps[:-1] & jumps[1:]
    closing = np.flatnonzero(np.append(jumps[1:-1], True))
    single, pair = np.flatnonzero(~alone), np.flatnonzero(alone)
    share = np.where(alone, h / 8.0, h / 6.0)  # of a node
    opening, shared = share.copy(), share.copy()
    shared[closing] = 0.0
    opening[1:] += shared[:-1]
    cell = np.concatenate([np.arange(n), single, pair, pair, closing])
    part = np.repeat([0.0, 1 / 2, 1 / 3, 2 / 3, 1.0], [n, len(single), len(pair), len(pair), len(closing)])
    weight = np.concatenate([opening, h[single] / 1.5, h[pair] * 0.375, h[pair] * 0.375, share[closing]])
    order = np.lexsort((part, cell))
    return cell[order], part[order], weight[order]


def _with_breaks(
    conditions: Conditions, nodes: Array, cell: IntArray, part: Array, weight: Array
) -> tuple[IntArray, Array, Array, Array]:
    """Cell, place in it, weight, and shift, mm, of places and, on both sides, of the breaks at which no cell ends.

    Those count for the rows only.
    """
    inside = conditions.inside(float(nodes[0]), float(nodes[-1]))
    inside = inside[~np.isin(inside, nodes)]
    owner = np.searchsorted(nodes, inside, side="right") - 1
    share = (inside - nodes[owner]) / np.diff(nodes)[owner]
    away, more = BESIDE * conditions.track.length, len(inside)
    shift = np.repeat([0.0, -away, away], [len(cell), more, more])
    cell, part = np.concatenate([cell, owner, owner]), np.concatenate([part, share, share])
    weight = np.concatenate([weight, np.zeros(2 * more)])
    order = np.lexsort((shift, part, cell))
    return cell[order], part[order], weight[order], shift[order]
