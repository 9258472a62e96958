"""Independent references with 40 digits: B-splines by the definition, in mpmath."""

from __future__ import annotations

import mpmath
import numpy as np

mpmath.mp.dps = 40


def _basis(i, p, knots, u, span):
    """N_{i,p}(u) by Cox and de Boor, with the span that holds u given."""
    if p == 0:
        return mpmath.mpf(1 if i == span else 0)
    total = mpmath.mpf(0)
    if knots[i + p] != knots[i]:
        total += (u - knots[i]) / (knots[i + p] - knots[i]) * _basis(i, p - 1, knots, u, span)
    if knots[i + p + 1] != knots[i + 1]:
        total += (knots[i + p + 1] - u) / (knots[i + p + 1] - knots[i + 1]) * _basis(i + 1, p - 1, knots, u, span)
    return total


def _spline_derivative(points, p, knots, u, span, order):
    """The order-th derivative by differences of control points (The NURBS Book, eq. 3.8), then de Boor's triangle."""
    points = {i: points[i] for i in range(span - p, span + 1)}
    degree = p
    low = span - p
    for _ in range(order):
        if degree == 0:
            return mpmath.mpf(0)
        points = {
            i: degree * (points[i + 1] - points[i]) / (knots[i + degree + 1] - knots[i + 1]) for i in range(low, span)
        }
        # control point i of the derivative sits one to the right in the shortened knot vector
        points = {i + 1: value for i, value in points.items()}
        low += 1
        degree -= 1
    d = [points[i] for i in range(span - degree, span + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            left = knots[span - degree + j]
            alpha = (u - left) / (knots[span + j + 1 - r] - left)
            d[j] = (1 - alpha) * d[j - 1] + alpha * d[j]
    return d[degree]


def derivatives(curve, u, order=3):
    """Point and derivatives to `order` at one u, from the right, rounded to float, (order + 1, axes)."""
    p = curve.degree
    knots = [mpmath.mpf(float(k)) for k in curve.knots]
    n = len(curve.control_points)
    weights = [mpmath.mpf(1)] * n if curve.weights is None else [mpmath.mpf(float(w)) for w in curve.weights]
    u = mpmath.mpf(float(u))
    span = max(i for i in range(p, n) if knots[i] <= u and knots[i] < knots[i + 1])
    w = [_spline_derivative(weights, p, knots, u, span, k) for k in range(order + 1)]
    out = np.empty((order + 1, curve.axes))
    for axis in range(curve.axes):
        column = [weights[i] * mpmath.mpf(float(curve.control_points[i, axis])) for i in range(n)]
        c = []
        for k in range(order + 1):
            value = _spline_derivative(column, p, knots, u, span, k)
            for i in range(1, k + 1):
                value -= mpmath.binomial(k, i) * w[i] * c[k - i]
            c.append(value / w[0])
        out[:, axis] = [float(value) for value in c]
    return out
