"""Points with two derivatives, many at once: splinefeed against other libraries."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import Any

import numba
import numpy as np

import splinefeed as sf
from benchmarks import cases
from benchmarks.tables import Cell, Column, Headline, Report, Table
from benchmarks.timing import interleaved

COUNT = 100_000
#: Libraries that take microseconds a point are given fewer of them.
SLOW_COUNT = 1_000
SLOW = ("splipy", "nurbspy", "OCCT", "geomdl")
ROUNDS = 7

Evaluate = Callable[[np.ndarray], np.ndarray]


def splinefeed(curve: sf.NurbsCurve) -> Evaluate:
    return lambda u: curve.derivatives(u, 2)


def scipy_bspline(curve: sf.NurbsCurve) -> Evaluate:
    spline = import_module("scipy.interpolate").BSpline(curve.knots, _homogeneous(curve), curve.degree)
    return partial(_quotients, [spline, spline.derivative(1), spline.derivative(2)])


def scipy_ppoly(curve: sf.NurbsCurve) -> Evaluate:
    interpolate = import_module("scipy.interpolate")
    columns = [
        interpolate.PPoly.from_spline(interpolate.BSpline(curve.knots, column, curve.degree))
        for column in _homogeneous(curve).T
    ]
    wide = np.diff(columns[0].x) > 0.0
    pieces = interpolate.PPoly(np.stack([column.c[:, wide] for column in columns], axis=2), np.unique(columns[0].x))
    return partial(_quotients, [pieces, pieces.derivative(1), pieces.derivative(2)])


def splipy(curve: sf.NurbsCurve) -> Evaluate:
    library = import_module("splipy")
    basis = library.BSplineBasis(curve.degree + 1, curve.knots)
    other = library.Curve(basis, _homogeneous(curve), rational=True, raw=True)
    return lambda u: np.stack([other(u), other.derivative(u, 1), other.derivative(u, 2)], axis=1)


def nurbspy(curve: sf.NurbsCurve) -> Evaluate:
    library = import_module("nurbspy")
    other = library.NurbsCurve(
        control_points=curve.control_points.T.copy(),
        weights=_weights(curve),
        degree=curve.degree,
        knots=np.array(curve.knots),
    )
    return lambda u: np.stack([other.get_derivative(u, order).T for order in range(3)], axis=1)


def geomdl(curve: sf.NurbsCurve) -> Evaluate:
    other = import_module("geomdl.NURBS").Curve()
    other.degree = curve.degree
    other.ctrlpts = curve.control_points.tolist()
    other.weights = _weights(curve).tolist()
    other.knotvector = list(curve.knots)
    return lambda u: np.array([other.derivatives(value, 2) for value in u.tolist()])


def occt(curve: sf.NurbsCurve) -> Evaluate:
    """One D2 a point through the Python binding, as OCCT has no call for many; its own C++ users wait less."""
    gp = import_module("OCP.gp")
    arrays = import_module("OCP.collections")
    count = len(curve.control_points)
    poles, weights = arrays.Array1_gp_Pnt(1, count), arrays.Array1_double(1, count)
    for i, (point, weight) in enumerate(zip(curve.control_points.tolist(), _weights(curve).tolist(), strict=True), 1):
        poles.SetValue(i, gp.gp_Pnt(*point, *[0.0] * (3 - len(point))))
        weights.SetValue(i, weight)
    distinct, times = np.unique(curve.knots, return_counts=True)
    knots = arrays.Array1_double(1, len(distinct))
    multiplicities = arrays.Array1_int(1, len(distinct))
    for i, (knot, multiplicity) in enumerate(zip(distinct.tolist(), times.tolist(), strict=True), 1):
        knots.SetValue(i, knot)
        multiplicities.SetValue(i, multiplicity)
    other = import_module("OCP.Geom").Geom_BSplineCurve(poles, weights, knots, multiplicities, curve.degree)
    point, first, second = gp.gp_Pnt(), gp.gp_Vec(), gp.gp_Vec()

    def evaluate(u: np.ndarray) -> np.ndarray:
        out = np.empty((len(u), 3, curve.axes))
        for i, value in enumerate(u.tolist()):
            other.D2(value, point, first, second)
            for order, vector in enumerate((point, first, second)):
                out[i, order] = (vector.X(), vector.Y(), vector.Z())[: curve.axes]
        return out

    return evaluate


LIBRARIES: dict[str, Callable[[sf.NurbsCurve], Evaluate]] = {
    "splinefeed": splinefeed,
    "SciPy PPoly": scipy_ppoly,
    "SciPy BSpline": scipy_bspline,
    "nurbspy": nurbspy,
    "splipy": splipy,
    "OCCT": occt,
    "geomdl": geomdl,
}


def _weights(curve: sf.NurbsCurve) -> np.ndarray:
    return np.ones(len(curve.control_points)) if curve.weights is None else np.array(curve.weights)


def _homogeneous(curve: sf.NurbsCurve) -> np.ndarray:
    """Control points times weight, and the weight: (n, axes + 1)."""
    weights = _weights(curve)[:, None]
    return np.hstack([curve.control_points * weights, weights])


def _quotients(orders: list[Any], u: np.ndarray) -> np.ndarray:
    """(n, 3, axes) from three homogeneous splines, by the quotient rule (The NURBS Book, 2nd ed., eq. 4.8)."""
    a0, a1, a2 = (order(u) for order in orders)
    w0, w1, w2 = a0[:, -1:], a1[:, -1:], a2[:, -1:]
    out = np.empty((len(u), 3, a0.shape[1] - 1))
    out[:, 0] = a0[:, :-1] / w0
    out[:, 1] = (a1[:, :-1] - w1 * out[:, 0]) / w0
    out[:, 2] = (a2[:, :-1] - 2.0 * w1 * out[:, 1] - w2 * out[:, 0]) / w0
    return out


@contextmanager
def fresh_cache() -> Iterator[None]:
    """A cache folder of Numba's that nobody filled before.

    nurbspy keeps a compiled function there that calls itself; read back by another process, it crashes it.
    """
    before = numba.config.CACHE_DIR
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        numba.config.CACHE_DIR = folder
        try:
            yield
        finally:
            numba.config.CACHE_DIR = before


def measure() -> Report:
    """Nanoseconds a point with two derivatives on the butterfly, and how far the libraries are apart."""
    curve = cases.butterfly().curves[0]
    random = np.random.default_rng(1)
    ordered = np.sort(random.uniform(*curve.domain, COUNT))
    few = ordered[:: COUNT // SLOW_COUNT]
    with fresh_cache():
        found, missing = _libraries(curve, few)
        given = {name: few if name in SLOW else ordered for name in found}
        in_order = interleaved({name: partial(call, given[name]) for name, call in found.items()}, ROUNDS)
        given = {name: random.permutation(u) for name, u in given.items()}
        shuffled = interleaved({name: partial(call, given[name]) for name, call in found.items()}, ROUNDS)
        values = {name: call(few) for name, call in found.items()}
    reference = values["splinefeed"]
    scale = np.max(np.abs(reference), axis=(0, 2))
    rows: list[tuple[Cell, ...]] = []
    for name in LIBRARIES:
        if name in missing:
            rows.append((name, missing[name], None, None, None, None, None))
            continue
        each = [1e9 * times[name].least / len(given[name]) for times in (in_order, shuffled)]
        ratio = in_order[name].least / len(given[name]) / (in_order["splinefeed"].least / COUNT)
        apart = (float(value) for value in np.max(np.abs(values[name] - reference), axis=(0, 2)) / scale)
        rows.append((name, *each, ratio, *((None,) * 3 if name == "splinefeed" else apart)))
    columns = (
        Column("library"),
        Column("in order, ns", ",.0f"),
        Column("shuffled, ns", ",.0f"),
        Column("to splinefeed", ",.1f"),
        Column("C differs", ".0e"),
        Column("C' differs", ".0e"),
        Column("C'' differs", ".0e"),
    )
    caption = "One point with its first and second derivative on the butterfly, a rational cubic of 48 spans."
    notes = (
        f"Calls with {COUNT:,} parameters ({SLOW_COUNT:,} for {', '.join(SLOW)}, which suits them better), increasing "
        f"and in random order; fastest of {ROUNDS} interleaved rounds. SciPy: homogeneous coordinates and the quotient "
        "rule in NumPy. Differences: largest from splinefeed, relative to the largest value on the curve.",
    )
    return Report((Table(caption, columns, tuple(rows), notes),), (_headline(rows),))


def _headline(rows: list[tuple[Cell, ...]]) -> Headline:
    """Our time beside that of the fastest other library."""
    what = "a point with two derivatives on the butterfly"
    others = [(float(row[1]), str(row[0])) for row in rows[1:] if isinstance(row[1], float)]
    own = float(rows[0][1] or 0.0)
    least, name = min(others, default=(0.0, "none"))
    return Headline(what, f"{own:.0f} ns; {name}: {least:.0f} ns", "the fastest in the table", own < least)


def _libraries(curve: sf.NurbsCurve, u: np.ndarray) -> tuple[dict[str, Evaluate], dict[str, str]]:
    """What can do the task here, and for the others a word on why not."""
    found: dict[str, Evaluate] = {}
    missing: dict[str, str] = {}
    for name, make in LIBRARIES.items():
        try:
            found[name] = make(curve)
            found[name](u)
        except ImportError:
            missing[name] = "not installed"
        except Exception as error:  # another version of a library may want other arguments: the others still count
            found.pop(name, None)
            missing[name] = f"failed with {type(error).__name__}"
    return found, missing
