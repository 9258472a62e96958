"""Pieces of a drawing to paths: ends that meet within a tolerance are joined; ambiguous cases are findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.records import Array, BoolArray, IntArray

#: Ends farther apart than the tolerance, but not more than this many times, are worth a finding.
NEAR_MISS = 100.0
#: How many places a finding names.
NAMED = 3
#: Neighbours within the tolerance that are examined for each end; more than one other than its own is a branch.
_NEIGHBOURS = 5


@dataclass(frozen=True)
class Chain:
    """Pieces in the order of the path: their indices, and which of them are traversed backwards."""

    pieces: tuple[int, ...]
    backwards: tuple[bool, ...]


@dataclass(frozen=True)
class Chains:
    """All chains, in the order of their first piece in the file, and findings."""

    chains: tuple[Chain, ...]
    findings: tuple[str, ...]


def chain(ends: Array, tolerance: float, pools: IntArray | None = None) -> Chains:
    """Chains of pieces whose first and last points are `ends` (n, 2, axes), mm; both lists deterministic.

    Two ends within `tolerance`, mm, of each other and of no third are joined. Where three or more meet, all paths end:
    the continuation is not guessed. A path keeps the direction of its first piece in the order given; a closed
    one begins with it. Pieces of different `pools` (n,) never meet; this keeps copies of a curve apart.
    """
    count = len(ends)
    if count == 0:
        return Chains((), ())
    pool = np.zeros(count, dtype=np.int64) if pools is None else pools
    flat = np.ascontiguousarray(ends, dtype=np.float64).reshape(2 * count, -1)
    node, places = _nodes(flat, np.repeat(pool, 2), tolerance)
    first, last = node[0::2], node[1::2]
    loop = first == last
    degree = np.bincount(node[np.repeat(~loop, 2)], minlength=len(places))
    findings = _branches(degree, places, flat) + _near_misses(degree, places, flat, np.repeat(pool, 2), tolerance)
    return Chains(tuple(_walk(first, last, loop, degree, flat, tolerance)), tuple(findings))


def _nodes(points: Array, pool: IntArray, tolerance: float) -> tuple[IntArray, IntArray]:
    """For each end the number of the node that it lies in, and for each node one of its ends."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    # Pools are moved apart, farther than any tolerance, along an axis of their own. Equal points are taken together
    # first: thousands of them at one place would make the tree compare each with each.
    keyed = np.column_stack([points, pool * (NEAR_MISS * 4.0 * max(tolerance, 1e-300))]) + 0.0
    distinct, one_of, inverse = np.unique(keyed, axis=0, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    if len(distinct) == 1 or tolerance <= 0.0:
        return inverse.astype(np.int64), one_of.astype(np.int64)
    near = min(_NEIGHBOURS, len(distinct))
    distance, other = cKDTree(distinct).query(distinct, k=near, distance_upper_bound=np.nextafter(tolerance, np.inf))
    rows = np.repeat(np.arange(len(distinct)), near)
    valid = np.isfinite(distance).ravel()
    pairs = rows[valid], other.ravel()[valid]
    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(len(distinct), len(distinct)))
    groups, label = connected_components(graph, directed=False)
    sample = np.full(groups, len(points), dtype=np.int64)
    np.minimum.at(sample, label, one_of)
    return label[inverse].astype(np.int64), sample


def _walk(
    first: IntArray, last: IntArray, loop: BoolArray, degree: IntArray, points: Array, tolerance: float
) -> list[Chain]:
    count = len(first)
    # the two ends at each node where exactly two pieces meet; end 2 i is the start of piece i, 2 i + 1 its end
    node = np.column_stack([first, last]).ravel()
    open_ends = np.flatnonzero(np.repeat(~loop, 2))
    by_node = open_ends[np.argsort(node[open_ends], kind="stable")]
    starts = np.searchsorted(node[by_node], np.arange(len(degree)))
    joint = np.flatnonzero(degree == 2)
    one, two = by_node[starts[joint]], by_node[starts[joint] + 1]
    near = np.linalg.norm(points[one] - points[two], axis=1) <= tolerance if len(joint) else np.empty(0, dtype=bool)
    partner_array = np.full(2 * count, -1, dtype=np.int64)
    partner_array[one[near]] = two[near]
    partner_array[two[near]] = one[near]
    partner = partner_array.tolist()
    seen = [False] * count
    chains = []
    for start in range(count):
        if seen[start]:
            continue
        seen[start] = True
        ahead = _follow(2 * start + 1, partner, seen)
        behind = _follow(2 * start, partner, seen)
        # entered at its start, a piece runs forwards; what lies behind the first piece is found from its far side
        run = [(end ^ 1) for end in reversed(behind)] + [2 * start] + ahead
        chains.append(Chain(tuple(end >> 1 for end in run), tuple(bool(end & 1) for end in run)))
    return chains


def _follow(end: int, partner: list[int], seen: list[bool]) -> list[int]:
    """The ends through which the pieces beyond `end` are entered, in order."""
    entered: list[int] = []
    while True:
        end = partner[end]
        if end < 0 or seen[end >> 1]:
            return entered
        seen[end >> 1] = True
        entered.append(end)
        end ^= 1


def _branches(degree: IntArray, places: IntArray, points: Array) -> list[str]:
    busy = np.flatnonzero(degree > 2)
    if not busy.size:
        return []
    named = ", ".join(f"{degree[i]} at {_place(points[places[i]])}" for i in busy[:NAMED])
    more = f" and {busy.size - NAMED} more places" if busy.size > NAMED else ""
    return [f"ends of more than two curves meet, and paths end there: {named}{more}"]


def _near_misses(degree: IntArray, places: IntArray, points: Array, pool: IntArray, tolerance: float) -> list[str]:
    """Open ends that lie just beyond the tolerance from another one."""
    from scipy.spatial import cKDTree

    lonely = np.flatnonzero(degree == 1)
    if lonely.size < 2 or tolerance <= 0.0:
        return []
    at = points[places[lonely]]
    keyed = np.column_stack([at, pool[places[lonely]] * (NEAR_MISS * 4.0 * tolerance)])
    distance, other = cKDTree(keyed).query(keyed, k=2, distance_upper_bound=NEAR_MISS * tolerance)
    gap = distance[:, 1]
    found = np.flatnonzero(np.isfinite(gap))
    found = found[(other[found, 1] > found) | (other[other[found, 1], 1] != found)]  # a pair counts once
    if not found.size:
        return []
    named = ", ".join(f"{gap[i]:.3g} mm at {_place(at[i])}" for i in found[:NAMED])
    more = f" and {found.size - NAMED} more" if found.size > NAMED else ""
    widest = float(gap[found].max())
    digits = 10.0 ** (np.floor(np.log10(widest)) - 1.0)
    wanted = float(np.ceil(widest / digits + 1e-9) * digits)
    return [
        f"open ends lie close together but not within {tolerance:g} mm: {named}{more}; "
        f"a tolerance of {wanted:.2g} mm would join them"
    ]


def _place(point: Array) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point.tolist()) + ")"


def copies(keys: Sequence[bytes]) -> IntArray:
    """(n,) how many earlier pieces have the same key: 0 for the first of its kind."""
    counts: dict[bytes, int] = {}
    out = np.empty(len(keys), dtype=np.int64)
    for i, key in enumerate(keys):
        out[i] = counts.get(key, 0)
        counts[key] = int(out[i]) + 1
    return out
