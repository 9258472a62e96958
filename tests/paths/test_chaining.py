"""Pieces to chains: against a plain search on small drawings, on large ones by count, and findings."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from splinefeed.paths.chaining import chain


def chained(ends, tolerance=1e-6):
    ends = np.array(ends, dtype=float)
    return chain(ends, tolerance, np.zeros(len(ends), dtype=np.int64))


def runs(ends):
    return chained(ends)[0]


def by_hand(ends: np.ndarray, tolerance: float) -> set[frozenset[int]]:
    """Which pieces belong together: joined where exactly two ends of different pieces lie within the tolerance."""
    flat = ends.reshape(-1, ends.shape[2])
    close = np.linalg.norm(flat[:, None] - flat[None], axis=2) <= tolerance
    groups = [{i} for i in range(len(ends))]
    for a in range(len(flat)):
        near = np.flatnonzero(close[a])
        if len(near) == 2 and near[0] // 2 != near[1] // 2:
            one, two = (next(g for g in groups if e // 2 in g) for e in near)
            if one is not two:
                one |= two
                groups.remove(two)
    return {frozenset(group) for group in groups}


@pytest.mark.parametrize("seed", range(20))
def test_chains_are_those_of_a_plain_search(seed):
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, 12, size=(40, 2)) * 10.0
    a, b = rng.integers(0, 40, size=(2, 30))
    ends = np.stack([corners[a], corners[b]], axis=1)
    ends = ends[np.any(ends[:, 0] != ends[:, 1], axis=1)] + rng.normal(scale=1e-8, size=2)
    found = runs(ends + rng.uniform(-1e-7, 1e-7, ends.shape))
    assert {frozenset(i for i, _ in each) for each in found} == by_hand(ends, 1e-6)
    assert sorted(i for each in found for i, _ in each) == list(range(len(ends)))
    for each in found:
        walked = [ends[i][::-1] if back else ends[i] for i, back in each]
        for before, after in itertools.pairwise(walked):
            assert np.abs(before[1] - after[0]).max() < 1e-12
        assert not min(each)[1]  # the first piece of the file keeps its direction
    assert [min(each)[0] for each in found] == sorted(min(each)[0] for each in found)


def test_a_closed_chain_begins_with_its_first_piece_and_an_open_one_may_have_pieces_before_it():
    square = [[[0, 0], [1, 0]], [[1, 1], [1, 0]], [[1, 1], [0, 1]], [[0, 0], [0, 1]]]
    assert runs(square) == [[(0, False), (1, True), (2, False), (3, True)]]
    assert runs([[[1, 0], [2, 0]], [[0, 0], [1, 0]], [[2, 0], [3, 0]]]) == [[(1, False), (0, False), (2, False)]]


def test_where_three_ends_meet_all_paths_end_and_it_is_said():
    star = [[[0, 0], [1, 0]], [[0, 0], [0, 1]], [[0, 0], [-1, 0]], [[1, 0], [2, 0]]]
    chains, findings = chained(star)
    assert chains == [[(0, False), (3, False)], [(1, False)], [(2, False)]]
    assert findings == ["ends of more than two curves meet, and paths end there: 3 at (0, 0)"]


def test_a_loop_of_its_own_does_not_disturb_those_that_touch_it():
    pieces = [[[0, 0], [0, 0]], [[-1, 0], [0, 0]], [[0, 0], [1, 0]]]
    assert runs(pieces) == [[(0, False)], [(1, False), (2, False)]]


def test_near_misses_are_findings_with_the_tolerance_that_joins_them():
    pieces = np.array([[[0, 0], [1, 0]], [[1, 3e-5], [2, 0]], [[5, 0], [6, 0]]])
    chains, findings = chained(pieces)
    assert len(chains) == 3
    assert findings == [
        "open ends lie close together but not within 1e-06 mm: 3e-05 mm at (1, 0); "
        "a tolerance of 3.2e-05 mm would join them"
    ]
    assert chained(pieces, 3.2e-5)[0][0] == [(0, False), (1, False)]


def test_copies_in_pools_of_their_own_never_meet():
    line = [[0.0, 0.0], [1.0, 0.0]]
    chains, _ = chain(np.array([line, line, [[1.0, 0.0], [2.0, 0.0]]]), 1e-6, np.array([0, 1, 0]))
    assert chains == [[(0, False), (2, False)], [(1, False)]]


def test_a_hundred_thousand_pieces_in_any_order_make_their_chains():
    rng = np.random.default_rng(5)
    rows, steps = 50, 2000
    points = np.cumsum(rng.normal(size=(rows, steps + 1, 2)), axis=1) + np.arange(rows)[:, None, None] * 1e4
    ends = np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 2)
    order = rng.permutation(len(ends))
    turned = rng.random(len(ends)) < 0.5
    shuffled = ends[order]
    shuffled[turned] = shuffled[turned][:, ::-1]
    found = runs(shuffled)
    assert len(found) == rows
    assert {len(each) for each in found} == {steps}


def test_thousands_of_ends_at_one_point_take_no_longer_than_elsewhere():
    angle = np.linspace(0.0, 6.0, 50_000)
    ends = np.stack([np.zeros((50_000, 2)), np.column_stack([np.cos(angle), np.sin(angle)])], axis=1)
    chains, findings = chained(ends)
    assert len(chains) == 50_000
    assert findings[0].endswith("there: 50000 at (0, 0)")
