"""Ticks of whole motions: the shared loop in Numba against the same arithmetic in C, and in plain Python for scale."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

import splinefeed as sf
from benchmarks import cases, child
from benchmarks.tables import Cell, Column, Headline, Report, Table
from benchmarks.timing import Times, interleaved
from splinefeed.interpolation.interpolator import Interpolator

SOURCE = Path(__file__).with_name("ticks.c")
METHODS = ("milne-simpson", "milne-simpson-anchored", "arc-length")
#: Those whose ratio to C was promised.
PROMISED = METHODS[:2]
#: Square roots need no errno, and no product is fused into a sum: the first changes no bit, the second keeps them.
FLAGS = ("-O3", "-fno-math-errno", "-ffp-contract=off", "-fPIC", "-shared")
BUILDS = {"C -O3": (), "C -O3 -march=native": ("-march=native",)}
YARDSTICK = "C -O3"
TICKS = 1_000_000
PYTHON_TICKS = 3_000
#: Numba may take this many times as long as C.
TARGET = 1.3

Room = tuple[np.ndarray, ...]


class _Motion(ctypes.Structure):
    """The fields of `struct motion` in ticks.c."""

    _fields_ = (
        ("breaks", ctypes.c_void_p),
        ("coefficients", ctypes.c_void_p),
        ("pieces", ctypes.c_int64),
        ("table", ctypes.c_void_p),
        ("curve_rows", ctypes.c_void_p),
        ("curves", ctypes.c_int64),
        ("length", ctypes.c_double),
        ("period", ctypes.c_double),
        ("corrections", ctypes.c_int64),
        ("tolerance", ctypes.c_double),
    )


def compile_kernel(folder: str, flags: Iterable[str] = ()) -> ctypes.CDLL | None:
    """Make ticks.c a library in `folder`, by gcc with FLAGS and `flags`; None without gcc, or if it refuses."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return None
    target = Path(tempfile.mkdtemp(dir=folder)) / "ticks.so"
    command = [compiler, *FLAGS, *flags, "-o", str(target), str(SOURCE), "-lm"]
    made = subprocess.run(command, check=False, capture_output=True)
    return ctypes.CDLL(str(target)) if made.returncode == 0 else None


class _Result(ctypes.Structure):
    """The fields of `struct result` in ticks.c."""

    _fields_ = (("replaced", ctypes.c_int64), ("overrun", ctypes.c_double), ("acceleration", ctypes.c_double))


class Lap:
    """One motion over a path, from rest to rest, run by either kernel into arrays of the same kind."""

    def __init__(self, path: sf.Path, method: str) -> None:
        self.path = path
        self.method = method
        self.law = sf.plan(path, cases.FAST, period=cases.PERIOD)
        self.source = Interpolator(path, self.law, method=method, compiled=True)
        self.ticks = self.source.ticks

    def room(self) -> Room:
        """Arrays for curve, u, s, feed and position, in memory already."""
        u, s, feed = np.zeros((3, self.ticks))
        return np.zeros(self.ticks, dtype=np.int64), u, s, feed, np.zeros((self.ticks, len(self.path.axes)))

    def by_numba(self, room: Room) -> None:
        """Fill `room` by what `Interpolator` runs: its loop, or the arrays of a method that has none."""
        source = Interpolator(self.path, self.law, method=self.method, compiled=True)
        for out, found in zip(room, source._filled(self.ticks), strict=True):
            out[:] = found

    def by_c(self, library: ctypes.CDLL, room: Room) -> None:
        """Fill `room` by the kernel of ticks.c."""
        if self.path.shape != (3, 2, 2, 1):
            raise ValueError(f"ticks.c is for planar rational cubics, not for a path of shape {self.path.shape}")
        breaks, coefficients = self.law.breaks, self.law.coefficients
        table, curve_rows = self.path.table, self.path.curve_rows
        motion = _Motion(
            breaks=breaks.ctypes.data,
            coefficients=coefficients.ctypes.data,
            pieces=len(coefficients),
            table=table.ctypes.data,
            curve_rows=curve_rows.ctypes.data,
            curves=len(curve_rows),
            length=self.path.length,
            period=self.source.period,
            corrections=self.source.settings["corrections"],
            tolerance=self.source.settings["tolerance"],
        )
        result = _Result()
        places = [ctypes.c_void_p(array.ctypes.data) for array in room]
        function = getattr(library, self.method.replace("-", "_") + "_ticks")
        function.restype = None
        function(ctypes.byref(motion), ctypes.c_int64(self.ticks), ctypes.byref(result), *places)

    def by_user(self) -> None:
        """The same as a user gets it, arrays and record made anew."""
        Interpolator(self.path, self.law, method=self.method, compiled=True).block()


def largest_difference(one: Room, other: Room) -> float:
    """Largest |difference| of any output, relative to the largest value of that output."""
    pairs = zip(one, other, strict=True)
    return max(float(np.max(np.abs(a - b))) / max(float(np.max(np.abs(a))), 1e-300) for a, b in pairs)


def plain_python(method: str) -> float:
    """Nanoseconds a tick on the butterfly; with NUMBA_DISABLE_JIT=1 in the environment those of plain Python."""
    source = Interpolator(cases.butterfly(), cases.law(), method=method)
    start = time.perf_counter()
    source.block(PYTHON_TICKS)
    return 1e9 * (time.perf_counter() - start) / PYTHON_TICKS


def measure() -> Report:
    """Nanoseconds a tick on the butterfly and on a smooth cubic, and what they are to C."""
    rows: list[tuple[Cell, ...]] = []
    headlines = []
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        libraries = {name: compile_kernel(folder, flags) for name, flags in BUILDS.items()}
        for path in (cases.butterfly(), cases.smooth()):
            for method in METHODS:
                lap = Lap(path, method)
                times, difference = _race(lap, {name: lib for name, lib in libraries.items() if lib is not None})
                each = {name: 1e9 * taken.least / lap.ticks for name, taken in times.items()}
                ratio = each["Numba"] / each[YARDSTICK] if YARDSTICK in each else None
                builds = (each.get(name) for name in BUILDS)
                apart = "none" if difference == 0.0 else difference
                rows.append((path.name, method, each["Numba"], *builds, ratio, apart, each["user"]))
                if method in PROMISED and path is cases.butterfly():
                    headlines.append(_headline(method, each["Numba"], ratio))
    columns = (
        Column("path"),
        Column("method"),
        Column("Numba, ns", ".1f"),
        *(Column(f"{name}, ns", ".1f") for name in BUILDS),
        Column("Numba to C", ".2f"),
        Column("difference", ".0e"),
        Column("as the user gets it, ns", ".1f"),
    )
    plain = child.outcome("ticks", "plain_python", METHODS[1], NUMBA_DISABLE_JIT="1")
    notes = (
        f"{TICKS:,} ticks as laps from rest to rest at {cases.FAST.feed:g} mm/s, one each {1e3 * cases.PERIOD:g} ms; "
        "point, u, s and feed stored; the kernels take turns lap by lap, and the fastest lap counts. Both do the same "
        "arithmetic in the same order; for C, degree, axes and method are fixed when it is compiled. Difference: "
        f"largest between the two, relative. {METHODS[1]} in plain Python: {plain:,.0f} ns a tick.",
        *(["gcc was not found, or refused: nothing to compare with."] if libraries[YARDSTICK] is None else []),
    )
    table = Table("One tick of the loop that all methods share, against C.", columns, tuple(rows), notes)
    return Report((table,), tuple(headlines))


def _race(lap: Lap, libraries: dict[str, ctypes.CDLL]) -> tuple[dict[str, Times], float | None]:
    """Times of a lap by each kernel, and how far Numba and C are apart."""
    rooms = {name: lap.room() for name in ("Numba", *libraries)}
    calls: dict[str, Callable[[], None]] = {"Numba": partial(lap.by_numba, rooms["Numba"]), "user": lap.by_user}
    calls |= {name: partial(lap.by_c, library, rooms[name]) for name, library in libraries.items()}
    times = interleaved(calls, rounds=-(-TICKS // lap.ticks))
    difference = largest_difference(rooms[YARDSTICK], rooms["Numba"]) if YARDSTICK in rooms else None
    return times, difference


def _headline(method: str, nanoseconds: float, ratio: float | None) -> Headline:
    what = f"one tick of `{method}`, point included, on the butterfly"
    if ratio is None:
        return Headline(what, f"{nanoseconds:.0f} ns; no gcc to compare with")
    target = f"at most {TARGET:g} times C"
    return Headline(what, f"{nanoseconds:.0f} ns, {ratio:.2f} times the same in C (gcc -O3)", target, ratio <= TARGET)
