"""Polar forms of B-splines: the same spline over more knots, or of a higher degree, all control points at once."""

from __future__ import annotations

import numpy as np

from splinefeed.records import Array, IntArray


def blossom(knots: Array, points: Array, degree: int, span: IntArray, arguments: Array) -> Array:
    """Polar forms F(a_1, ..., a_p) (n, columns) of the polynomials on [knots[span], knots[span + 1]], span (n,).

    d_i^r = (1 - alpha) d_{i-1}^{r-1} + alpha d_i^{r-1},  alpha = (a_r - t_i) / (t_{i+p+1-r} - t_i)

    points (m, columns), arguments (p, n). Source: Ramshaw, "Blossoms are polar forms", Computer Aided Geometric Design
    6(4), 1989, doi 10.1016/0167-8396(89)90032-0; with equal arguments it is de Boor's algorithm (The NURBS Book, 2nd
    ed., p. 176).
    """
    work = points[span - degree + np.arange(degree + 1)[:, None]]
    near = knots[span - degree + np.arange(1, 2 * degree + 1)[:, None]]  # t_{span-p+1} ... t_{span+p}
    for r in range(1, degree + 1):
        left, right = near[r - 1 : degree], near[degree : 2 * degree + 1 - r]
        # both from their own end: weights of very different size keep their digits, and end points stay as given
        alpha, beta = (arguments[r - 1] - left) / (right - left), (right - arguments[r - 1]) / (right - left)
        work = beta[..., None] * work[:-1] + alpha[..., None] * work[1:]
    out: Array = work[0]
    return out


def refined(knots: Array, points: Array, degree: int, new_knots: Array) -> Array:
    """Control points of the same spline over a finer knot vector: Q_i = F(tau_{i+1}, ..., tau_{i+p}).

    Inside the domain new_knots contains `knots`; before the first and behind the last of new_knots there are p more
    `knots`. On the span of tau_i, with the last argument first, all that counts is a mean with positive weights, so
    that no digits are lost. Source: Cohen, Lyche, Riesenfeld, "Discrete B-splines and subdivision techniques", CGIP
    14(2), 1980, doi 10.1016/0146-664X(80)90040-4.
    """
    first = np.arange(len(new_knots) - degree - 1)
    span = np.searchsorted(knots, new_knots[first], side="right") - 1
    return blossom(knots, points, degree, span, new_knots[first + np.arange(degree, 0, -1)[:, None]])


def elevated(knots: Array, points: Array, degree: int, new_knots: Array) -> Array:
    """Control points of the same spline at one degree more; new_knots is `knots` with one more of each distinct knot.

    Q_i = 1/(p+1) sum_j F(tau_{i+1}, ..., without tau_{i+j}, ..., tau_{i+p+1})

    The symmetric multi-affine form of degree p + 1 that agrees with F on the diagonal is unique: Ramshaw 1989, see
    `blossom`. Span and order of the arguments as in `refined`.
    """
    first = np.arange(len(new_knots) - degree - 2)
    span = np.searchsorted(knots, new_knots[first], side="right") - 1
    arguments = new_knots[first + np.arange(degree + 1, 0, -1)[:, None]]
    out = np.zeros((len(first), points.shape[1]))
    for j in range(degree, -1, -1):
        out += blossom(knots, points, degree, span, np.delete(arguments, j, axis=0)) / (degree + 1)
    return out
