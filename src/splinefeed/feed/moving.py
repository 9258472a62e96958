"""Stretches with ends in motion: no stretch in time goes, so their top feed falls until they last whole periods."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.audit import LAST_CHECKED, excess, tick_excess
from splinefeed.feed.bounds import deceleration_jerk
from splinefeed.feed.law_pieces import Nodes, Pieces, to_pieces
from splinefeed.feed.square import Setting, SquareProblem
from splinefeed.feed.window import EAGER, GAP, Solution, fitting, nearby, nodes_of, signs_of
from splinefeed.geometry.path import Path
from splinefeed.records import Array

#: Rounds in which limits are tightened where the law is still over them.
ROUNDS = 12
#: The top feed is lowered by this share at first, and twice as much each time; then bisections narrow it down until
#: the motions on both sides last the same but for a share.
LOWER, NARROWER, ALIKE = 1e-3, 6, 2e-3
#: Bisections of the mixture of two motions that lasts whole periods.
MIXTURES = 60
#: A top feed this much above those at the ends is the lowest.
ABOVE_ENDS = 1e-3
#: What may be over a limit is rounding.
OVER = 1e-10


def finished(path: Path, found: Solution, setting: Setting) -> tuple[Pieces, bool]:
    """The motion with every limit kept, and whether it lasts whole periods; without a period it does not.

    Raises PlanError where limits cannot be kept with these feeds at the ends.
    """
    problem, c = found.problem, found.coefficients
    scale = np.ones(problem.cells.count) if problem.scale is None else problem.scale
    rising = np.zeros(problem.cells.count) if problem.rising is None else problem.rising
    uneven_jerk = setting.limits.jerk != deceleration_jerk(setting.limits)
    for round_ in range(ROUNDS):
        c, whole = _in_periods(problem, c, found.nodes, setting.period)
        nodes = nodes_of(problem, c, found.nodes.low, found.nodes.high)
        pieces = to_pieces(nodes)
        over = np.maximum(excess(nodes, pieces, setting, LAST_CHECKED), np.where(pieces.coarse, 4.0, 0.0))
        seen = tick_excess(path, pieces, setting, 0.0, (nodes.ends[0].rest, nodes.ends[1].rest))
        over = np.maximum(over, seen[pieces.offset : pieces.offset + len(over)])
        if np.max(over) <= 1.0 + OVER:
            return pieces, whole
        # under a lower top feed other cells speed up: they get both limits of jerk, and no tighter ones at first
        turned = nearby((signs_of(problem, c) != rising) & (rising != 0.0), 2**round_ - 1) & (rising != 0.0)
        rising = np.where(turned, 0.0, rising)
        scale = np.where(turned & uneven_jerk, scale, scale / np.maximum(over, 1.0) ** EAGER)
        problem = SquareProblem(problem.cells, problem.ends, setting, scale, rising, cap=problem.cap)
        c, _, _ = problem.solve(fitting(problem, c), tolerance=GAP)
    low, high = found.nodes.low, found.nodes.high
    feeds = " and ".join(f"{end.feed:g}" for end in found.nodes.ends if end.feed is not None)
    raise PlanError(
        f"no motion was found that keeps every limit between s = {low:.6g} and {high:.6g} mm with {feeds} mm/s at its "
        "moving end(s); ask for slower ones"
    )


def _in_periods(problem: SquareProblem, c: Array, nodes: Nodes, period: float | None) -> tuple[Array, bool]:
    """Coefficients of the motion slowed down at the top until it lasts whole periods, and whether that went."""

    def duration(coefficients: Array) -> float:
        return to_pieces(nodes_of(problem, coefficients, nodes.low, nodes.high)).duration

    if period is None:
        return c, False
    fast = duration(c)
    target = max(math.ceil(fast / period * (1.0 - 1e-12) - 1e-9), 1) * period
    if target - fast <= 1e-12 * fast:
        return c, True
    top = math.sqrt(float(np.max(c)))
    lowest = max(end.feed or 0.0 for end in problem.ends) * (1.0 + ABOVE_ENDS)

    def capped(cap: float) -> Array:
        slower = SquareProblem(
            problem.cells, problem.ends, problem.setting, problem.scale, problem.rising, cap=min(cap, problem.cap)
        )
        return slower.solve(fitting(slower, np.minimum(c, 0.999 * cap * cap)), tolerance=GAP)[0]

    quick, lower = c, LOWER
    cap_quick = top
    while True:
        cap = max(top * (1.0 - lower), lowest)
        if not cap < top:
            return c, False
        slow = capped(cap)
        if duration(slow) >= target:
            break
        if cap == lowest:
            return c, False
        quick, cap_quick, lower = slow, cap, 2.0 * lower
    for _ in range(NARROWER):
        if duration(slow) - duration(quick) < ALIKE * fast:
            break
        middle = 0.5 * (cap + cap_quick)
        between = capped(middle)
        if duration(between) >= target:
            slow, cap = between, middle
        else:
            quick, cap_quick = between, middle
    # both keep the limits, and a mixture does too, but for a hair of jerk, which is looked at afterwards
    share, step = 0.0, 0.5
    for _ in range(MIXTURES):
        if duration((1.0 - share - step) * quick + (share + step) * slow) <= target:
            share += step
        step *= 0.5
    return (1.0 - share) * quick + share * slow, True
