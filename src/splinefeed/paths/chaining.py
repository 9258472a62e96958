"""Pieces of a drawing to paths: ends that meet within a tolerance are joined; ambiguous cases are findings."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from splinefeed.records import Array, IntArray

#: Ends farther apart than the tolerance, but not more than this many times, are worth a finding.
NEAR_MISS = 100.0
#: Places that a finding names.
NAMED = 3
#: Neighbours within the tolerance that are examined for each end; more than one other than its own is a branch.
_NEIGHBOURS = 5

#: Pieces in the order of the path: the index of each, and whether it is traversed backwards.
Chain = list[tuple[int, bool]]


def chain(ends: Array, tolerance: float, pools: IntArray, close: float = 0.0) -> tuple[list[Chain], list[str]]:
    """Chain pieces whose ends meet.

    Parameters
    ----------
    ends : (n, 2, axes) array
        First and last point of each piece, mm.
    tolerance : float
        Two ends within it, mm, of each other and of no third are joined.
    pools : (n,) array of int
        Pieces of different ones never meet; this keeps copies of a curve apart.
    close : float, optional
        How far apart open ends are named, mm, where that is more than NEAR_MISS times the tolerance.

    Returns
    -------
    chains : list of Chain
        In the order given.
    findings : list of str
        One sentence each.

    Notes
    -----
    Where three or more ends meet, all paths end: the continuation is not guessed. A path keeps the direction of its
    first piece in the order given; a closed one begins with it.
    """
    count = len(ends)
    points = np.ascontiguousarray(ends, dtype=np.float64).reshape(2 * count, -1)
    # pools are moved apart, farther than any tolerance, along an axis of their own
    apart = np.repeat(pools, 2) * (4.0 * max(NEAR_MISS * tolerance, close, 1e-300))
    keyed = np.column_stack([points, apart]) + 0.0
    node = _nodes(keyed, tolerance)
    is_open = np.repeat(node[0::2] != node[1::2], 2)  # a piece that ends where it begins takes no part
    degree = np.bincount(node[is_open], minlength=node.max() + 1)
    # end 2 i is the start of piece i, 2 i + 1 its end; those of one node follow each other in `met`
    met = np.flatnonzero(is_open)[np.argsort(node[is_open], kind="stable")]
    first_of = np.cumsum(degree) - degree
    joint = first_of[degree == 2]
    one, two = met[joint], met[joint + 1]
    near = np.linalg.norm(points[one] - points[two], axis=1) <= tolerance
    partner = np.full(2 * count, -1, dtype=np.int64)
    partner[one[near]], partner[two[near]] = two[near], one[near]
    busy = first_of[degree > 2]
    branches = [f"{degree[node[met[i]]]} at {_place(points[met[i]])}" for i in busy[:NAMED]]
    findings = [f"ends of more than two curves meet, and paths end there: {_listed(branches, len(busy))}"] * bool(
        branches
    )
    lonely = met[first_of[degree == 1]]
    return _walks(partner.tolist()), findings + _near_misses(keyed[lonely], points[lonely], tolerance, close)


def _nodes(keyed: Array, tolerance: float) -> IntArray:
    """For each end the number of the node that it lies in."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    # equal points are taken together first: thousands at one place would make the tree compare each with each
    distinct, inverse = np.unique(keyed, axis=0, return_inverse=True)
    nodes: IntArray = inverse.ravel().astype(np.int64)
    if len(distinct) == 1 or tolerance <= 0.0:
        return nodes
    near = min(_NEIGHBOURS, len(distinct))
    distance, other = cKDTree(distinct).query(distinct, k=near, distance_upper_bound=np.nextafter(tolerance, np.inf))
    valid = np.isfinite(distance)
    pairs = np.nonzero(valid)[0], other[valid]
    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(len(distinct), len(distinct)))
    return np.asarray(connected_components(graph, directed=False)[1][nodes], dtype=np.int64)


def _walks(partner: list[int]) -> list[Chain]:
    """The chains, given for each end the one that it is joined to, or -1."""
    seen = [False] * (len(partner) // 2)
    chains = []
    for start in range(len(seen)):
        if seen[start]:
            continue
        seen[start] = True
        run = deque([2 * start])  # the end through which each piece is entered
        while (end := partner[run[-1] ^ 1]) >= 0 and not seen[end >> 1]:
            seen[end >> 1] = True
            run.append(end)
        while (end := partner[run[0]]) >= 0 and not seen[end >> 1]:
            seen[end >> 1] = True
            run.appendleft(end ^ 1)
        chains.append([(end >> 1, bool(end & 1)) for end in run])
    return chains


def _near_misses(keyed: Array, points: Array, tolerance: float, close: float) -> list[str]:
    """Open ends that lie just beyond the tolerance from another one."""
    from scipy.spatial import cKDTree

    if len(points) < 2 or tolerance <= 0.0:
        return []
    distance, other = cKDTree(keyed).query(keyed, k=2, distance_upper_bound=max(NEAR_MISS * tolerance, close))
    gap, next_to = distance[:, 1], np.append(other[:, 1], -1)
    found = np.flatnonzero(np.isfinite(gap))
    found = found[(next_to[found] > found) | (next_to[next_to[found]] != found)]  # a pair counts once
    if not found.size:
        return []
    places = [f"{gap[i]:.3g} mm at {_place(points[i])}" for i in found[:NAMED]]
    return [
        f"open ends lie close together but not within {tolerance:g} mm: {_listed(places, len(found))}; "
        f"a tolerance of {1.06 * gap[found].max():.2g} mm would join them"
    ]


def _listed(places: Sequence[str], count: int) -> str:
    return ", ".join(places) + (f" and {count - len(places)} more" if count > len(places) else "")


def _place(point: Array) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point.tolist()) + ")"
