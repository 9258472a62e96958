"""The least time over one stretch, or one window of it: grid, relaxation, refinements, and repairs of the law."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.audit import CHECKED, LAST_CHECKED, excess, tick_excess
from splinefeed.feed.bounds import deceleration_jerk
from splinefeed.feed.cells import Cells
from splinefeed.feed.grid import first_cells
from splinefeed.feed.law_pieces import Nodes, Pieces, to_pieces
from splinefeed.feed.square import End, Setting, SquareProblem
from splinefeed.feed.stretches import check_duration
from splinefeed.geometry.path import Path
from splinefeed.records import Array, BoolArray, IntArray

#: Refinements of the grid, and the share of cells that each cuts in two.
REFINEMENTS, REFINED_SHARE = 3, 0.3
#: Refinements more where cells are too coarse for the motion, and the largest ratio of q within a cell.
MORE_REFINEMENTS, STEEPEST = 12, 2.5
#: No cell below this share of the stretch is cut for being coarse.
SHORTEST = 1e-10
#: Cells may become this many times as many as there were at first, and a few.
MOST_TIMES, AND_A_FEW = 8, 4000
#: Duality gap relative to the time at which the optimiser ends; loose on grids that will be refined.
GAP, COARSE_GAP, BOUND_GAP = 1e-5, 1e-3, 1e-5
#: Rounds in which limits are tightened where the law goes over them between the places the optimiser looks at.
REPAIRS = 8
#: What is over a limit by no more than this is left to the last stretch of the whole law, which it makes half as much
#: longer; cells over by more than MUCH are cut in two besides, in the first repairs.
HAIR, MUCH, CUTTING_REPAIRS = 1e-4, 1.02, 4
#: A repair asks for this power of what is over.
EAGER = 1.02
#: A slope of q below this share of the greatest has no sign.
LEVEL = 1e-6
#: Phases of the ticks, in periods, at which the law is looked at.
PHASES = (0.0, 0.25, 0.5, 0.75)
#: A motion of more periods than this is looked at in one phase only.
MOST_LOOKS = 20_000
#: One of more periods than this that also lasts more than MOST_BOUNDS times its lower bound is given up: looking at its
#: ticks, again after each repair, would take minutes.
GIVEN_UP, MOST_BOUNDS = 1e6, 100.0
#: An end in motion may fall short of its feed by this share of q; it is then put right.
SHORT = 1e-4
#: Limits are tightened by this where the last hair cannot be a stretch in time: at moving ends, from nothing there to
#: all of it at this share of the stretch away from them.
MARGIN, MARGIN_REACH = 2e-4, 0.05


@dataclass(frozen=True, eq=False)
class Solution:
    """The nodes and pieces of a stretch; `over` (n,): what its cells are over; lower bound of its time, s."""

    nodes: Nodes
    pieces: Pieces
    over: Array
    lower_bound: float
    problem: SquareProblem
    coefficients: Array


def lower_bound(
    path: Path, low: float, high: float, feeds: tuple[float | None, float | None], setting: Setting
) -> float:
    """Least time of the relaxation without jerk between two places, s; feeds as in `first_cells`."""
    cells, ends = first_cells(path, low, high, feeds, setting)
    _, time, gap = _relaxed(SquareProblem(cells, ends, setting, relaxed=True), low, high)
    return time - gap


def solve(
    path: Path,
    low: float,
    high: float,
    feeds: tuple[float | None, float | None],
    setting: Setting,
    given: Cells | None = None,
    places: Array = LAST_CHECKED,
) -> Solution:
    """Least time over a stretch; feeds at its ends, mm/s, 0 for rest, None for any.

    given: cells from `low` on, fine enough already, whose nodes stay nodes; places: of every piece of the law, where it
    is held to the limits once it keeps them at CHECKED; `finished` looks closer at one with moving ends.
    Raises PlanError where the limits allow no motion, or where the path is too short for the feeds at its ends.
    """
    moving = any(feed is not None and feed > 0.0 for feed in feeds)
    uneven_jerk = setting.limits.jerk != deceleration_jerk(setting.limits)
    cells, ends = first_cells(path, low if given is None else float(given.s[-1]), high, feeds, setting)
    fine = -math.inf
    if given is not None:
        fine = float(given.s[-1])
        cells = given.followed_by(cells)
    bare = SquareProblem(cells, ends, setting, relaxed=True)
    c, relaxed_time, gap = _relaxed(bare, low, high)
    rising = np.zeros(cells.count)
    most = MOST_TIMES * cells.count + AND_A_FEW
    scale = _margins(cells, ends)
    problem = SquareProblem(cells, ends, setting, scale, rising)
    c, _, _ = problem.solve(fitting(problem, c), tolerance=COARSE_GAP)
    for refinement in range(REFINEMENTS + MORE_REFINEMENTS):
        regular = refinement < REFINEMENTS
        coarse = _coarse(problem, c)
        if not regular and (not np.any(coarse) or cells.count > most):
            break
        marked = coarse | (_uneven(problem, c) & (cells.s[1:] > fine)) if regular else coarse
        signs = signs_of(problem, c)
        rising = np.where(signs == rising, rising, 0.0) if refinement else signs
        cells, c, owner = _halved(problem, c, marked)
        scale, rising = scale[owner], rising[owner]
        problem = SquareProblem(cells, ends, setting, scale, rising)
        last = refinement >= REFINEMENTS - 1
        c, _, _ = problem.solve(fitting(problem, c), tolerance=GAP if last else COARSE_GAP)
    rest = (ends[0].rest, ends[1].rest)
    bound = relaxed_time - gap if math.isfinite(relaxed_time - gap) else 0.0
    longest = math.inf if setting.period is None else max(GIVEN_UP * setting.period, MOST_BOUNDS * bound)
    hair = 1.0 if moving else 1.0 + HAIR
    for repair in range(REPAIRS):
        nodes = nodes_of(problem, c, low, high)
        pieces = to_pieces(nodes)
        check_duration(pieces.duration, low, high, longest)
        over = np.maximum(excess(nodes, pieces, setting), np.where(pieces.coarse, 4.0, 0.0))
        if setting.period is not None:
            for phase in PHASES if pieces.duration < MOST_LOOKS * setting.period else PHASES[:1]:
                seen = tick_excess(path, pieces, setting, phase * setting.period, rest)
                over = np.maximum(over, seen[pieces.offset : pieces.offset + cells.count])
        if np.max(over) <= hair and not moving and places is not CHECKED:
            over = np.maximum(over, excess(nodes, pieces, setting, places))
        if np.max(over) <= hair or repair == REPAIRS - 1:
            break
        # a cell in which the feed does not grow, or fall, as was thought gets both limits of jerk, no tighter ones; so
        # do more and more of those around it, as the place where the feed turns moves on into them
        turned = nearby((signs_of(problem, c) != rising) & (rising != 0.0), 2**repair - 1) & (rising != 0.0)
        rising = np.where(turned, 0.0, rising)
        spared = turned if uneven_jerk else np.zeros(cells.count, dtype=bool)
        scale = np.where(spared, scale, scale / np.maximum(over, 1.0) ** EAGER)
        much = over > MUCH
        if repair < CUTTING_REPAIRS and np.any(much) and cells.count < most:
            cells, c, owner = _halved(problem, c, much)
            scale, rising = scale[owner], rising[owner]
        problem = SquareProblem(cells, ends, setting, scale, rising)
        c, _, _ = problem.solve(fitting(problem, c), tolerance=GAP)
    return Solution(nodes, pieces, over, bound, problem, c)


def _margins(cells: Cells, ends: tuple[End, End]) -> Array:
    """How much of the limits a stretch with moving ends may use at first, (n,)."""
    scale = np.ones(cells.count)
    if any(end.feed is not None for end in ends):
        s = cells.s
        share = np.ones(cells.count)
        for which, away in ((0, s[:-1] - s[min(2, cells.count)]), (1, s[max(cells.count - 2, 0)] - s[1:])):
            if ends[which].feed is not None:
                share = np.minimum(share, np.clip(away / (MARGIN_REACH * (s[-1] - s[0])), 0.0, 1.0))
        scale -= MARGIN * share
    return scale


def _relaxed(bare: SquareProblem, low: float, high: float) -> tuple[Array, float, float]:
    """Coefficients, time and gap of the relaxation, s."""
    slow = np.full(bare.cells.count + 2, 1e-3 * bare.least_bound)
    for _ in range(200):
        if bare.room(slow) > 0.0:
            return bare.solve(slow, tolerance=BOUND_GAP)
        slow *= 0.1
    raise PlanError(f"the limits allow no motion between s = {low:.6g} and {high:.6g} mm")


def fitting(problem: SquareProblem, c: Array) -> Array:
    """c slowed down as little as it takes to have room to every limit."""
    c = problem.raised(c)
    for _ in range(400):
        if problem.room(c) > 0.0:
            return c
        c = c * 0.85
    s = problem.cells.s
    raise PlanError(f"no feed was found that keeps the limits between s = {s[0]:.6g} and {s[-1]:.6g} mm")


def nodes_of(problem: SquareProblem, c: Array, low: float, high: float) -> Nodes:
    """The solution at the nodes; a moving end that falls short by a hair is put right."""
    s = problem.cells.s
    slope = np.append(problem.at(c, 0.0)[1], problem.at(c, 1.0)[1][-1])
    q = problem.nodes(c)
    for which, end in enumerate(problem.ends):
        if end.feed is not None:
            wanted = end.feed**2
            if q[-which] < wanted * (1.0 - SHORT):
                name = ("start_feed", "end_feed")[which]
                raise PlanError(
                    f"{name} is {end.feed:g} mm/s; the path and its limits allow at most "
                    f"{math.floor(1e4 * math.sqrt(q[-which])) / 1e4:g} mm/s there"
                )
            # all of q near it by the same share, which fades out smoothly: a cubic, whose slope is 0 at both its ends
            reach = MARGIN_REACH * (s[-1] - s[0])
            x = np.clip(np.abs(s - s[-which]) / reach, 0.0, 1.0)
            lift = wanted / q[-which] - 1.0
            fade = 1.0 + lift * (1.0 - x) ** 2 * (1.0 + 2.0 * x)
            fall = (6.0 if which else -6.0) * lift * x * (1.0 - x) / reach
            slope, q = slope * fade + q * fall, q * fade
            q[-which], slope[-which] = wanted, 0.0
    return Nodes(problem.cells, np.maximum(q, np.finfo(float).tiny), slope, problem.ends, low, high)


def _coarse(problem: SquareProblem, c: Array) -> BoolArray:
    """Cells in which q changes too much to be told by one piece, (n,)."""
    q = np.stack([problem.at(c, f)[0] for f in (0.0, 0.5, 1.0)])
    length = problem.cells.length
    coarse: BoolArray = np.max(q, axis=0) > STEEPEST * np.min(q, axis=0)
    coarse &= length > SHORTEST * np.sum(length)
    return coarse


def _uneven(problem: SquareProblem, c: Array) -> BoolArray:
    """The cells between which the tangential jerk changes most, (n,)."""
    cells = problem.cells
    q, _, second = problem.at(c, 0.5)
    feed = np.sqrt(np.maximum(q, 0.0))
    change = np.abs(np.diff(0.5 * feed * second))
    weight = np.zeros(cells.count)
    weight[:-1] += change
    weight[1:] += change
    weight *= cells.length / np.maximum(feed, np.finfo(float).tiny)
    marked: BoolArray = weight >= np.quantile(weight, 1.0 - REFINED_SHARE)
    return marked


def nearby(marked: BoolArray, reach: int) -> BoolArray:
    """The marked cells (n,) and so many on both sides of each."""
    sums = np.concatenate([[0], np.cumsum(marked)])
    cell = np.arange(len(marked))
    found: BoolArray = sums[np.minimum(cell + reach + 1, len(marked))] > sums[np.maximum(cell - reach, 0)]
    return found


def _halved(problem: SquareProblem, c: Array, marked: BoolArray) -> tuple[Cells, Array, IntArray]:
    """The cells with the marked ones halved, c carried over, and which old cell each of them was part of."""
    cells = problem.cells
    finer = cells.halved(marked)
    s = finer.s
    middles = 0.5 * (np.concatenate([s[:1], s]) + np.concatenate([s, s[-1:]]))
    owner = np.clip(np.searchsorted(cells.s, 0.5 * (s[1:] + s[:-1]), side="right") - 1, 0, cells.count - 1)
    return finer, np.interp(middles, cells.s, problem.nodes(c)), owner.astype(np.int64)


def signs_of(problem: SquareProblem, c: Array) -> Array:
    """1 where the feed grows in a cell and its neighbours, -1 where it falls, else 0, (n,)."""
    slope = problem.at(c, 0.5)[1]
    sign = np.where(np.abs(slope) > LEVEL * np.max(np.abs(slope)), np.sign(slope), 0.0)
    wide = np.stack([np.append(sign[:1], sign[:-1]), sign, np.append(sign[1:], sign[-1:])])
    found: Array = np.where(np.all(wide > 0, axis=0), 1.0, np.where(np.all(wide < 0, axis=0), -1.0, 0.0))
    return found
