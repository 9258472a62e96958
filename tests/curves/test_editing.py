"""The same curve said otherwise is the same curve, and its ends stay where they were to the last bit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sample_curves import KNOWN, STILL, butterfly, ellipse, random_curve
from splinefeed.curves.curve import MAX_DEGREE, NurbsCurve
from splinefeed.errors import CurveError, InputError

#: Relative to the curve's size.
SAME = 1e-13
#: All degrees and kinds of knots; see `random_curve`.
SEEDS = range(36)
EPSILON = np.finfo(float).eps


def parameters(curve: NurbsCurve, seed: int = 0) -> np.ndarray:
    """Random parameters and the knots, increasing."""
    return np.unique(np.concatenate([curve.breaks, np.random.default_rng(seed).uniform(*curve.domain, 60)]))


def moved(curve: NurbsCurve, other: NurbsCurve, u: np.ndarray, at: np.ndarray | None = None) -> float:
    """Greatest distance of other(at) from curve(u), per coordinate, relative to the curve's size."""
    return float(np.abs(other(u if at is None else at) - curve(u)).max() / curve.size)


def inner_parameters(curve: NurbsCurve, seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed + 1).uniform(*curve.domain, count)


@pytest.mark.parametrize("seed", SEEDS)
def test_clamped_ends(seed):
    curve = random_curve(seed)
    other = curve.with_clamped_ends()
    p = curve.degree
    assert other.clamped and other.domain == curve.domain
    assert np.all(other.knots[: p + 1] == curve.domain[0]) and np.all(other.knots[-p - 1 :] == curve.domain[1])
    assert moved(curve, other, parameters(curve, seed)) <= SAME
    assert other.with_clamped_ends() is other
    assert (other is curve) == (curve.knots[0] == curve.domain[0])


@pytest.mark.parametrize("seed", SEEDS)
def test_knot_insertion(seed):
    curve = random_curve(seed)
    added = inner_parameters(curve, seed, 4)
    if curve.degree > 1:
        added = np.append(added, added[0])
    other = curve.with_knots(*added)
    assert np.array_equal(other.knots, np.sort(np.concatenate([curve.knots, added])))
    assert moved(curve, other, parameters(curve, seed)) <= SAME
    if curve.clamped:
        assert np.array_equal(other.control_points[[0, -1]], curve.control_points[[0, -1]])


@pytest.mark.parametrize("seed", SEEDS)
def test_degree_elevation(seed):
    curve = random_curve(seed)
    for times in {1, 3, MAX_DEGREE - curve.degree}:
        if curve.degree + times <= MAX_DEGREE:
            other = curve.elevated(times)
            assert other.degree == curve.degree + times and other.domain == curve.domain
            assert moved(curve, other, parameters(curve, seed)) <= SAME
            if curve.clamped:
                assert np.array_equal(other.control_points[[0, -1]], curve.control_points[[0, -1]])


@pytest.mark.parametrize("seed", SEEDS)
def test_split(seed):
    curve = random_curve(seed)
    cuts = np.unique(np.concatenate([inner_parameters(curve, seed, 3), curve.breaks[1:-1][:2]]))
    pieces = curve.split(*cuts[::-1])
    bounds = np.concatenate([curve.domain[:1], cuts, curve.domain[1:]])
    assert [piece.domain for piece in pieces] == list(itertools.pairwise(bounds))
    for piece in pieces:
        assert piece.clamped and piece.degree == curve.degree
        u = np.linspace(*piece.domain, 25)
        assert np.abs(piece(u[1:-1]) - curve(u[1:-1])).max() <= SAME * curve.size
        assert np.abs(piece(u[[0, -1]]) - curve(u[[0, -1]])).max() <= SAME * curve.size
    for before, after in itertools.pairwise(pieces):
        assert np.array_equal(before.control_points[-1], after.control_points[0])
    if curve.clamped:
        assert np.array_equal(pieces[0].control_points[0], curve.control_points[0])
        assert np.array_equal(pieces[-1].control_points[-1], curve.control_points[-1])


@pytest.mark.parametrize("seed", SEEDS)
def test_reverse(seed):
    curve = random_curve(seed)
    other = curve.reversed()
    start, end = curve.domain
    assert other.domain == curve.domain
    assert np.array_equal(other.control_points, curve.control_points[::-1])
    u = parameters(curve, seed)
    # a parameter near 1000 is rounded to 1e-13: times the speed, that much the mirrored point is away
    speed = np.abs(curve.derivatives(u, 1)[:, 1]).max()
    slack = 4.0 * EPSILON * max(abs(start), abs(end)) * speed / curve.size
    assert moved(curve, other, u[1:-1], start + end - u[1:-1]) <= SAME + slack
    assert np.abs(other([start, end]) - curve([end, start])).max() <= SAME * curve.size
    twice = other.reversed()
    assert np.array_equal(twice.control_points, curve.control_points)
    assert np.abs(twice.knots - curve.knots).max() <= 4.0 * EPSILON * np.abs(curve.knots).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_affine_image(seed):
    curve = random_curve(seed)
    random = np.random.default_rng(seed)
    matrix, offset = random.normal(size=(3, curve.axes)), random.normal(size=3)
    other = curve.transformed(matrix, offset)
    u = parameters(curve, seed)
    assert other.axes == 3 and np.array_equal(other.knots, curve.knots)
    wanted = curve(u) @ matrix.T + offset
    allowed = SAME * np.abs(matrix).sum() * curve.size + 4.0 * EPSILON
    assert np.abs(other(u) - wanted).max() <= allowed


@pytest.mark.nojit
@pytest.mark.parametrize("name", [*KNOWN, *STILL])
def test_known_curves_through_everything(name):
    curve = {**KNOWN, **STILL}[name]
    u = parameters(curve)
    middle = 0.37 * curve.domain[0] + 0.63 * curve.domain[1]
    assert moved(curve, curve.elevated(2), u) <= SAME
    assert moved(curve, curve.with_knots(middle), u) <= SAME
    first, second = curve.split(middle)
    assert moved(curve, first, u[u <= middle]) <= SAME and moved(curve, second, u[u >= middle]) <= SAME
    assert abs(first.length + second.length - curve.length) <= 1e-12 * curve.length
    assert abs(curve.reversed().length - curve.length) <= 1e-12 * curve.length


def test_far_from_the_origin():
    for seed in range(1, 72, 5):
        curve = random_curve(seed, axes=2, far=True)
        u = parameters(curve, seed)
        allowed = SAME + 4.0 * EPSILON * np.abs(curve.control_points).max() / curve.size
        for other in (
            curve.elevated(1) if curve.degree < 12 else curve,
            curve.with_knots(*inner_parameters(curve, 1, 3)),
        ):
            assert moved(curve, other, u) <= allowed
        if curve.clamped:
            piece = curve.split(*inner_parameters(curve, 2, 2))[0]
            assert np.array_equal(piece.control_points[0], curve.control_points[0])


@pytest.mark.nojit
def test_knots_very_unequal():
    curve = KNOWN["unequal spans"]
    u = parameters(curve)
    around = np.array([1 - 1e-7, 1 + 3e-7, 1 + 2e-6, 3 + 1.5e-6])
    assert moved(curve, curve.with_knots(*around), u) <= SAME
    assert moved(curve, curve.elevated(4), u) <= SAME


@pytest.mark.nojit
def test_known_images():
    circle = ellipse(1.0, 1.0)
    u = np.linspace(0.0, 4.0, 33)
    assert circle.transformed(1.0) == circle
    assert np.array_equal(circle.transformed(2.0).control_points, 2.0 * circle.control_points)
    quarter = circle.transformed([[0.0, -1.0], [1.0, 0.0]], [3.0, 0.0])
    assert np.abs(np.hypot(*(quarter(u) - [3.0, 0.0]).T) - 1.0).max() <= 1e-15
    flat = circle.transformed([[1.0, 0.0]])
    assert flat.axes == 1 and np.array_equal(flat.bounding_box(), [[-1.0], [1.0]])
    up = circle.transformed([[1, 0], [0, 1], [0, 0]], [0, 0, 7])
    assert np.array_equal(up(u), np.column_stack([circle(u), np.full(33, 7.0)]))


@pytest.mark.nojit
def test_text_book_values():
    # x^2 by two Bezier points more; a cubic of one span cut at its middle (de Casteljau)
    parabola = NurbsCurve.bezier([[0.0], [0.0], [1.0]])
    assert np.allclose(parabola.elevated().control_points.ravel(), [0.0, 0.0, 1 / 3, 1.0], rtol=1e-15, atol=1e-16)
    left, right = NurbsCurve.bezier([[0, 0], [0, 4], [4, 4], [4, 0]]).split(0.5)
    assert np.array_equal(left.control_points, [[0, 0], [0, 2], [1, 3], [2, 3]])
    assert np.array_equal(right.control_points, [[2, 3], [3, 3], [4, 2], [4, 0]])
    inserted = NurbsCurve(1, [0, 0, 1, 1], [[0.0], [8.0]]).with_knots(0.25)
    assert np.array_equal(inserted.control_points.ravel(), [0.0, 2.0, 8.0])


@pytest.mark.nojit
def test_split_without_parameters_and_elevation_by_nothing():
    curve = butterfly()
    assert curve.split() == [curve]
    assert curve.elevated(0) == curve
    assert curve.with_knots() == curve


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda c: c.split(0.0), "a curve can be split only strictly inside its domain (0, 1)"),
        (lambda c: c.split(0.5, 1.0), "a curve can be split only strictly inside its domain (0, 1)"),
        (lambda c: c.split(2.0), "parameter 2 is outside the curve's domain [0, 1]"),
        (lambda c: c.split(np.nan), "parameter nan is outside the curve's domain [0, 1]"),
        (lambda c: c.with_knots(1.0), "knots can be inserted only strictly inside the domain (0, 1)"),
        (lambda c: c.with_knots(-1.0), "parameter -1 is outside the curve's domain [0, 1]"),
        (lambda c: c.elevated(10), "degree 3 raised 10 times; degrees up to 12 are possible"),
        (lambda c: c.elevated(-1), "degree 3 raised -1 times; degrees up to 12 are possible"),
        (lambda c: c.elevated(1.5), "degree 3 raised 1.5 times; degrees up to 12 are possible"),
        (lambda c: c.transformed([[1, 0, 0]]), "matrix has shape (1, 3); (1 to 16, 2) is needed"),
        (lambda c: c.transformed(np.ones((17, 2))), "matrix has shape (17, 2); (1 to 16, 2) is needed"),
        (lambda c: c.transformed([1, 0]), "matrix: expected 2 dimension(s), got shape (2,)"),
        (lambda c: c.transformed(np.nan), "matrix[0, 0] is nan; every value must be finite"),
        (lambda c: c.transformed([[1, 0], [0, np.inf]]), "matrix[1, 1] is inf; every value must be finite"),
        (lambda c: c.transformed(1.0, [1]), "offset has shape (1,); expected (2,)"),
        (lambda c: c.transformed(1.0, [1, np.nan]), "offset[1] is nan; every value must be finite"),
        (lambda c: c.transformed(1e40), "control_points[1, 1] is 2e+40; values up to 1e+30 are possible"),
    ],
)
def test_refused_with_these_words(ask, said):
    with pytest.raises(InputError) as caught:
        ask(NurbsCurve.bezier([[0, 0], [0, 2], [1, 3], [2, 3]]))
    assert str(caught.value) == said


@pytest.mark.nojit
def test_too_many_equal_knots_are_refused():
    curve = NurbsCurve.bezier([[0, 0], [1, 2], [2, 0]])
    with pytest.raises(CurveError) as caught:
        curve.with_knots(0.5, 0.5, 0.5)
    assert str(caught.value) == "knot 0.5 would appear 3 times; at most 2 (the degree) are possible"
    with pytest.raises(CurveError, match="all 3 control points are the same: the curve has no length"):
        curve.transformed(0.0)
    with pytest.raises(InputError, match="matrix: expected numbers in 2 dimension"):
        curve.transformed("left")
    with pytest.raises(InputError, match="matrix: expected numbers in 2 dimension"):
        curve.transformed([[1, 0], [1]])
