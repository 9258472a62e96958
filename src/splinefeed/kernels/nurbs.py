"""Polar forms of B-splines: knot refinement, degree elevation and local power forms of one span."""

from __future__ import annotations

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array


@kernel
def blossom(knots: Array, points: Array, degree: int, span: int, arguments: Array, work: Array) -> None:
    """Polar form F(a_1, ..., a_p) of the polynomial piece on [knots[span], knots[span + 1]], left in work[degree].

    d_i^r = (1 - alpha) d_{i-1}^{r-1} + alpha d_i^{r-1},  alpha = (a_r - t_i) / (t_{i+p+1-r} - t_i)

    points (n, columns), arguments (p,), work (p + 1, columns). Source: Ramshaw, "Blossoms are polar forms",
    Computer Aided Geometric Design 6(4), 1989, doi 10.1016/0167-8396(89)90032-0; with equal arguments it is
    de Boor's algorithm (The NURBS Book, 2nd ed., p. 176).
    """
    columns = points.shape[1]
    for i in range(degree + 1):
        for c in range(columns):
            work[i, c] = points[span - degree + i, c]
    for r in range(1, degree + 1):
        for i in range(degree, r - 1, -1):
            left = knots[span - degree + i]
            right = knots[span + i + 1 - r]
            # both from their own end: weights of very different size keep their digits, and end points stay as given
            alpha = (arguments[r - 1] - left) / (right - left)
            beta = (right - arguments[r - 1]) / (right - left)
            for c in range(columns):
                work[i, c] = beta * work[i - 1, c] + alpha * work[i, c]


@kernel
def power_form(knots: Array, points: Array, degree: int, middle: float, half: float, out: Array) -> None:
    """Coefficients of t^k, t = (u - middle) / half, of one span's polynomial: out[k] = half^k C^(k)(middle) / k!.

    knots (2 p + 2,) and points (p + 1, columns) are those of the span; points are overwritten; out (p + 1, columns).
    The derivatives come from differences of control points over their own knots (The NURBS Book, 2nd ed., eq. 3.8)
    and de Boor's recursion on them: a narrow span beside wide ones loses no digits, as a Bezier form of it would.
    """
    columns = points.shape[1]
    work = np.empty((degree + 1, columns))
    factor = 1.0
    for k in range(degree + 1):
        # points[k ... degree] are the control points of the k-th derivative, a spline of degree p - k
        for i in range(k, degree + 1):
            for c in range(columns):
                work[i, c] = points[i, c]
        for r in range(1, degree - k + 1):
            for i in range(degree, k + r - 1, -1):
                left = knots[i]
                right = knots[i + degree - k + 1 - r]
                alpha = (middle - left) / (right - left)
                beta = (right - middle) / (right - left)
                for c in range(columns):
                    work[i, c] = beta * work[i - 1, c] + alpha * work[i, c]
        for c in range(columns):
            out[k, c] = factor * work[degree, c]
        factor *= half / (k + 1)
        for i in range(degree, k, -1):
            width = knots[i + degree - k] - knots[i]
            for c in range(columns):
                points[i, c] = (degree - k) * (points[i, c] - points[i - 1, c]) / width


@kernel
def descending(knots: Array, first: int, without: int, arguments: Array) -> None:
    """Fill arguments (p,) with knots[first], knots[first + 1], ... but knots[without], the last of them first."""
    k = first
    for i in range(arguments.shape[0] - 1, -1, -1):
        if k == without:
            k += 1
        arguments[i] = knots[k]
        k += 1


@kernel
def refine(knots: Array, points: Array, degree: int, new_knots: Array, out: Array) -> None:
    """Control points of the same spline over a finer knot vector: Q_i = F(tau_{i+1}, ..., tau_{i+p}).

    Inside the domain new_knots contains `knots`; before the first and behind the last of new_knots there are p more
    `knots`; out (len(new_knots) - p - 1, columns). On the span of tau_i, with the last argument first, all that counts
    is a mean with positive weights, so that no digits are lost. Source: Cohen, Lyche, Riesenfeld, "Discrete B-splines
    and subdivision techniques", CGIP 14(2), 1980, doi 10.1016/0146-664X(80)90040-4.
    """
    work = np.empty((degree + 1, points.shape[1]))
    arguments = np.empty(degree)
    for i in range(out.shape[0]):
        span = int(np.searchsorted(knots, new_knots[i], side="right")) - 1
        descending(new_knots, i + 1, -1, arguments)
        blossom(knots, points, degree, span, arguments, work)
        out[i] = work[degree]


@kernel
def elevate(knots: Array, points: Array, degree: int, new_knots: Array, out: Array) -> None:
    """Control points of the same spline at one degree more.

    Q_i = 1/(p+1) sum_j F(tau_{i+1}, ..., without tau_{i+j}, ..., tau_{i+p+1})

    new_knots is `knots` with one more of each distinct knot; out (len(new_knots) - p - 2, columns). The symmetric
    multi-affine form of degree p + 1 that agrees with F on the diagonal is unique: Ramshaw 1989, see `blossom`. Span
    and order of the arguments as in `refine`.
    """
    work = np.empty((degree + 1, points.shape[1]))
    arguments = np.empty(degree)
    for i in range(out.shape[0]):
        span = int(np.searchsorted(knots, new_knots[i], side="right")) - 1
        out[i] = 0.0
        for j in range(degree + 1):
            descending(new_knots, i + 1, i + 1 + j, arguments)
            blossom(knots, points, degree, span, arguments, work)
            out[i] += work[degree] / (degree + 1)
