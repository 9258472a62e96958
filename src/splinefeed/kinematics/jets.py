"""Truncated Taylor arithmetic: values that carry their derivatives by one parameter, over arrays.

A jet is an array (order + 1, ...) of Taylor coefficients c_k = f^(k) / k!. Sums, products and quotients of jets, and
functions of them, follow from the recurrences of A. Griewank and A. Walther, Evaluating Derivatives, 2nd ed. (SIAM
2008, doi 10.1137/1.9780898717761), chapter 13: exact to rounding, nothing is differenced.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from splinefeed.records import Array


class Jet:
    """Taylor coefficients of a function of one parameter: c_k = f^(k) / k!.

    Parameters
    ----------
    c : (order + 1, ...) array
        Coefficients. Sums, products and quotients of jets, and of jets with arrays and numbers, are jets.
    """

    __slots__ = ("c",)
    __array_ufunc__ = None  # an array on the left leaves its operators to the jet

    def __init__(self, c: Array) -> None:
        self.c = c

    @classmethod
    def of_derivatives(cls, d: Array) -> Jet:
        """Make a jet of derivatives: c_k = d_k / k!.

        Parameters
        ----------
        d : (order + 1, ...) array
            The function and its derivatives.

        Returns
        -------
        Jet
            Its coefficients.
        """
        return cls(d / _first([math.factorial(k) for k in range(len(d))], d))

    @property
    def derivatives(self) -> Array:
        """Derivatives (order + 1, ...): d_k = k! c_k."""
        return self.c * _first([math.factorial(k) for k in range(len(self.c))], self.c)

    @property
    def value(self) -> Array:
        """The function itself, (...)."""
        found: Array = self.c[0]
        return found

    def __add__(self, other: Jet | Array | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.c + other.c)
        c = self.c.copy()
        c[0] += other
        return Jet(c)

    def __neg__(self) -> Jet:
        return Jet(-self.c)

    def __sub__(self, other: Jet | Array | float) -> Jet:
        return self + (-other)

    def __mul__(self, other: Jet | Array | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.c * other)
        a, b = self.c, other.c
        return Jet(np.array([sum(a[j] * b[k - j] for j in range(k + 1)) for k in range(len(a))]))

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Array | float) -> Jet:
        return -self + other

    def __truediv__(self, other: Jet) -> Jet:
        """c_k = (a_k - sum_(j<k) c_j b_(k-j)) / b_0."""
        a, b = self.c, other.c
        c = np.empty(np.broadcast_shapes(a.shape, b.shape))
        for k in range(len(c)):
            c[k] = (a[k] - sum(c[j] * b[k - j] for j in range(k))) / b[0]
        return Jet(c)

    def slope(self) -> Jet:
        """Return the derivative, one order less."""
        return Jet(self.c[1:] * _first(range(1, len(self.c)), self.c))

    def cut(self) -> Jet:
        """Return the same function, one order less."""
        return Jet(self.c[:-1])

    def integral(self, start: Array) -> Jet:
        """Return the function that has this derivative and the value `start` (...), one order more."""
        further = self.c / _first(range(1, len(self.c) + 1), self.c)
        return Jet(np.concatenate([np.broadcast_to(start, self.c.shape[1:])[None], further]))


Number = Jet | Array | float
"""What formulas of kinematics take: a jet, an array, or a number."""


def as_jet(value: Number, like: Jet) -> Jet:
    """Return a value as a jet: one that is none as a constant of the order and shape of `like`."""
    return value if isinstance(value, Jet) else like * 0.0 + np.asarray(value)


def _first(values: Sequence[int], like: Array) -> Array:
    """Values along the first axis of an array."""
    return np.array(values, dtype=np.float64).reshape(-1, *(1,) * (like.ndim - 1))


def sin_cos(x: Number) -> tuple[Number, Number]:
    """Return sine and cosine.

    Parameters
    ----------
    x : Jet, array or float
        An angle, rad.

    Returns
    -------
    tuple of 2
        Of the kind and shape of x.

    Notes
    -----
    k s_k = sum j x_j c_(k-j), k c_k = -sum j x_j s_(k-j), j = 1 ... k.
    """
    if not isinstance(x, Jet):
        return np.sin(x), np.cos(x)
    s, c = np.empty_like(x.c), np.empty_like(x.c)
    s[0], c[0] = np.sin(x.c[0]), np.cos(x.c[0])
    for k in range(1, len(x.c)):
        s[k] = sum(j * x.c[j] * c[k - j] for j in range(1, k + 1)) / k
        c[k] = -sum(j * x.c[j] * s[k - j] for j in range(1, k + 1)) / k
    return Jet(s), Jet(c)


def root(x: Jet) -> Jet:
    """Return the square root: r_k = (x_k - sum_(0<j<k) r_j r_(k-j)) / (2 r_0)."""
    r = np.empty_like(x.c)
    r[0] = np.sqrt(x.c[0])
    for k in range(1, len(r)):
        r[k] = (x.c[k] - sum(r[j] * r[k - j] for j in range(1, k))) / (2.0 * r[0])
    return Jet(r)


def angle(y: Jet, x: Jet) -> Jet:
    """Return atan2(y, x), rad: its derivative is (x y' - y x') / (x^2 + y^2)."""
    if len(x.c) == 1:
        return Jet(np.arctan2(y.c, x.c))
    rate = (x.cut() * y.slope() - y.cut() * x.slope()) / (x * x + y * y).cut()
    return rate.integral(np.arctan2(y.c[0], x.c[0]))
