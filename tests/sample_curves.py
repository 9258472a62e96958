"""Curves that the geometry tests share: random ones of every kind, and known ones that are hard."""

from __future__ import annotations

import json
from importlib import resources

import numpy as np

from splinefeed.curves.curve import MAX_DEGREE, NurbsCurve

KINDS = ("clamped", "unclamped", "periodic")
ROOT_HALF = np.sqrt(0.5)


def random_curve(seed: int, *, axes: int | None = None, far: bool = False) -> NurbsCurve:
    """A random curve: 36 seeds in a row go through all degrees and kinds of knots.

    Spans of equal widths or over two decades, inner knots up to multiplicity p, weights over two decades or none,
    control points of three sizes; parameters from 0 or from 1000; `far`: about 1e6 mm away from the origin.
    """
    random = np.random.default_rng(seed)
    degree = seed % MAX_DEGREE + 1
    kind = KINDS[seed // MAX_DEGREE % 3]
    axes = int(random.integers(1, 7)) if axes is None else axes
    spans = int(random.integers(degree + 1, degree + 5)) if kind == "periodic" else int(random.integers(1, 7))
    widths = 10.0 ** random.uniform(-2.0, 0.0, spans) if random.random() < 0.5 else np.ones(spans)
    breaks = np.concatenate([[0.0], np.cumsum(widths)]) + 1000.0 * (random.random() < 0.2)
    if kind == "periodic":
        period = breaks[-1] - breaks[0]
        ring = np.concatenate([breaks[:-1] - period, breaks[:-1], breaks[:-1] + period, breaks[:1] + 2.0 * period])
        knots = ring[spans - degree : 2 * spans + degree + 1]
        count = spans + degree
        around = np.arange(count) % spans
    else:
        times = random.integers(1, degree + 1, spans - 1) if random.random() < 0.5 else np.ones(spans - 1, dtype=int)
        inner = np.repeat(breaks[1:-1], times)
        before, after = np.full(degree, breaks[0]), np.full(degree, breaks[-1])
        if kind == "unclamped":
            before = np.sort(before - random.uniform(0.05, 1.0, degree))
            after = np.sort(after + random.uniform(0.05, 1.0, degree))
        knots = np.concatenate([before, breaks[:1], inner, breaks[-1:], after])
        count = len(knots) - degree - 1
        around = np.arange(count)
    points = random.normal(size=(count, axes)) * random.choice([0.01, 1.0, 50.0])
    weights = 10.0 ** random.uniform(-1.0, 1.0, count) if random.random() < 0.5 else None
    if far:
        points = points + random.normal(size=axes) * 1e6
    return NurbsCurve(degree, knots, points[around], None if weights is None else weights[around])


def butterfly() -> NurbsCurve:
    """The butterfly of the interpolation literature."""
    data = json.loads((resources.files("splinefeed") / "data" / "butterfly.json").read_text(encoding="utf-8"))
    return NurbsCurve(data["degree"], data["knots"], data["control_points"], data["weights"])


def ellipse(a: float, b: float) -> NurbsCurve:
    """A whole ellipse about the origin from (a, 0), counter-clockwise: four rational quadratic arcs."""
    corners = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]) * [a, b]
    weights = [1.0, ROOT_HALF, 1.0, ROOT_HALF, 1.0, ROOT_HALF, 1.0, ROOT_HALF, 1.0]
    return NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], corners, weights)


def with_cusp(at: float, degree: int = 4, axes: int = 2, seed: int = 0) -> NurbsCurve:
    """A Bezier curve on [0, 1] with C' = (u - at) G(u), G random: a cusp at `at`."""
    random = np.random.default_rng(seed)
    columns = []
    for _ in range(axes):
        speed = np.polynomial.Polynomial([-at, 1.0]) * np.polynomial.Polynomial(random.normal(size=degree - 1))
        columns.append(bernstein(speed.integ().coef, degree))
    return NurbsCurve.bezier(np.column_stack(columns))


def with_loop(at: float, width: float) -> NurbsCurve:
    """A Bezier curve on [0, 1] with x' + i y' = (u - at + i width)^2: within `width` of `at` it turns by 2 pi.

    Its speed is a polynomial, and its tangent is as good as the same on both sides of the loop: both hide it.
    """
    around = np.polynomial.Polynomial([-at + 1j * width, 1.0]) ** 2
    place = around.integ().coef
    return NurbsCurve.bezier(np.column_stack([bernstein(place.real, 3), bernstein(place.imag, 3)]))


def bent(radius: float, size: float = 10.0) -> NurbsCurve:
    """size (v^2, v^3 + e v), v from -1 to 1 over [0, 1]: a tip of this radius, mm, at v = 0, a cusp for 0."""
    v = np.polynomial.Polynomial([-1.0, 2.0])
    e = np.sqrt(2.0 * radius / size)
    return NurbsCurve.bezier(
        size * np.column_stack([bernstein(np.pad(c.coef, (0, 4))[:4], 3) for c in (v**2, v**3 + e * v)])
    )


def bernstein(power: np.ndarray, degree: int) -> np.ndarray:
    """Bezier coefficients (degree + 1,) on [0, 1] of sum_k power_k u^k."""
    out = np.zeros(degree + 1)
    for i in range(degree + 1):
        ratio = 1.0
        for k in range(min(i, len(power) - 1) + 1):
            out[i] += ratio * power[k]
            ratio *= (i - k) / (degree - k) if k < degree else 0.0
    return out


def along_a_wave(degree: int, knots) -> NurbsCurve:
    """Control points (g, sin 2 g) over the means g of p knots in a row: |C'| stays near 1 whatever the knots."""
    means = np.convolve(knots[1:-1], np.full(degree, 1.0 / degree), mode="valid")
    return NurbsCurve(degree, knots, np.column_stack([means, np.sin(2.0 * means)]))


#: Spans of 1e-6 beside spans of 1.
UNEQUAL = [0.0, 0, 0, 0, 1, 1 + 1e-6, 2, 3, 3 + 1e-6, 3 + 2e-6, 3 + 2e-6, 3 + 2e-6, 3 + 2e-6]

#: Curves whose C' vanishes, or nearly: at an end (twice, and three times the same point), inside, and not quite.
STILL = {
    "two equal points at the start": NurbsCurve.bezier([[0, 0], [0, 0], [1, 2], [3, 1]]),
    "three equal points at the start": NurbsCurve.bezier([[0, 0], [0, 0], [0, 0], [3, 1]]),
    "two equal points at both ends": NurbsCurve.bezier([[0, 0], [0, 0], [1, 2], [3, 1], [3, 1]]),
    "cusp in the middle": NurbsCurve.bezier([[0, 0], [1, 1], [0, 1], [1, 0]]),
    "cusp at a third": with_cusp(1.0 / 3.0),
    "cusp just after the start": with_cusp(1e-3),
    "cusp just before the end": with_cusp(0.9985, degree=6, axes=3),
    "near cusp, 1e-4": NurbsCurve.bezier([[0, 0], [1, 1], [1e-4, 1], [1, 0]]),
    "near cusp, 1e-9": NurbsCurve.bezier([[0, 0], [1, 1], [1e-9, 1], [1, 0]]),
    "there and back": NurbsCurve.bezier([[0, 0], [3, 4], [0, 0.5]]),
}

#: Others that a table or a search may stumble over.
KNOWN = {
    "line": NurbsCurve.bezier([[1, 2], [4, 6]]),
    "line of many points": NurbsCurve(3, [0, 0, 0, 0, 1, 1, 1, 1], [[0, 0], [1, 1], [2, 2], [3, 3]]),
    "circle": ellipse(5.0, 5.0),
    "ellipse": ellipse(50.0, 1.0),
    "polyline": NurbsCurve(1, [0, 0, 1, 2, 3, 4, 5, 5], [[0, 0], [1, 0], [1, 0], [1, 1], [0, 1], [0, 0]]),
    "figure eight": NurbsCurve(
        3,
        [0, 0, 0, 0, 0.25, 0.5, 0.5, 0.75, 1, 1, 1, 1],
        [[0, 0], [2, 2], [4, 0], [2, -2], [-2, 2], [-4, 0], [-2, -2], [0, 0]],
    ),
    "unequal spans": along_a_wave(3, UNEQUAL),
    "unequal spans and speeds": NurbsCurve(
        3, UNEQUAL, [[0, 0], [1, 2], [2, -1], [3, 3], [4, 0], [5, 1], [6, 0], [6, 1], [7, 0]]
    ),
    "far parameters": NurbsCurve(3, [1000] * 4 + [1000.5] + [1001] * 4, [[0, 0], [1, 2], [3, -1], [4, 2], [6, 0]]),
}

#: Knots of three cubic Beziers in one curve.
KNOTS_OF_BEZIERS = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3]

#: Curves with something on them that is smaller than 1 nm, or rests.
TIPS = {
    "cusp": bent(0.0),
    **{f"radius {r:g} mm": bent(r) for r in (1e-8, 1e-7, 5e-7)},
    "rational cusp": NurbsCurve.bezier([[0, 0], [0, 0], [1, 2], [3, 1]], [1, 2, 0.5, 1]),
    "cusp of degree 7 in space": with_cusp(0.3, 7, 3, 5).transformed(40.0),
    "loop": with_loop(0.4, 1e-3).transformed(20.0),
    "two equal points": NurbsCurve.bezier([[0, 0], [0, 0], [1, 2], [3, 1]]),
    "three equal points at a knot": NurbsCurve(
        3, [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4], [[0, 0], [1, 0], [3, 1], [3, 1], [3, 1], [5, 3], [6, 0]]
    ),
    "a span without length": NurbsCurve(
        3, KNOTS_OF_BEZIERS, [[0, 0], [1, 0], [2, 1], [3, 1], [3, 1], [3, 1], [3, 1], [4, 1], [5, 3], [6, 0]]
    ),
    "a span of 0.1 nm": NurbsCurve(
        3,
        KNOTS_OF_BEZIERS,
        [[0, 0], [1, 0], [2, 1], [3, 1], [3, 1 + 1e-7], [3 + 1e-7, 1 + 1e-7], [3 + 1e-7, 1], [4, 1], [5, 3], [6, 0]],
    ),
    "straight there and back": NurbsCurve.bezier([[0, 0], [3, 4], [0, 0]]),
    "straight from rest to rest": NurbsCurve.bezier([[0, 0], [0, 0], [2, 2], [2, 2]]),
}  # fmt: skip
