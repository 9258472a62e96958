"""Figures of a path: coloured by feed, curvature or what else is known, by the limit that binds, by contour error."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.analysis.binding import BINDS, LimitUse
from splinefeed.analysis.thinning import cells
from splinefeed.errors import InputError
from splinefeed.geometry.differential import curvatures
from splinefeed.geometry.path import Path
from splinefeed.pipeline.deviation import Deviation
from splinefeed.pipeline.run import Run
from splinefeed.records import Array, BoolArray, IntArray, Response, Setpoints, unit_along
from splinefeed.report import theme
from splinefeed.report.figure import SAME_PLACE, Axis, Coloured, Dots, Figure, Heat, Line, Mark, Panel, Shades
from splinefeed.report.motion_figures import HEADROOM, TIME, thin

#: Points of a path, of the true path in the picture of its errors, and columns of a heat map, at most.
POINTS, PATH_POINTS, STRIP = 4000, 3000, 800
#: More stops than this are not marked one by one.
MOST_STOPS = 60
#: Share of the picture that the largest contour error is enlarged to; errors below this, mm, are in micrometres.
ENLARGED_TO, MICROMETRES_BELOW = 0.12, 1.0
#: Colour of each kind of limit; one for all axes.
KINDS = {
    "feed": theme.BLUE,
    "acceleration": "#56B4E9",
    "deceleration": "#56B4E9",
    "jerk": theme.INK,
    "centripetal": "#B8A800",
    "chord_error": "#E69F00",
    "orientation_error": "#8C6D31",
    "axis_velocity": theme.GREEN,
    "axis_acceleration": theme.VERMILION,
    "axis_jerk": theme.PURPLE,
}
NONE = "#c4c4c4"


def path_figure(run: Run, response: Response | None = None, colour: str | None = None) -> Figure:
    """Where the tool goes, coloured by feed or by one of much else: over the linear axes, or time if there is one.

    response  what the axes of a machine did; colour  the only one wanted, where there is one of that name
    """
    path, setpoints = run.path, run.kept
    unit = unit_along(path.axes)
    place, thread = _place(run), run.thread
    if path.linear <= 1:
        thread = place
    space = place.shape[1] == 3
    values = _quantities(run, response)
    kept = _kept(place, [each.values for each in values.values()])
    if colour in values:
        values = {colour: values[colour]}
    shades = {name: Shades(each.values[kept], each.label, each.low, each.high) for name, each in values.items()}
    hover = np.column_stack([setpoints.t, setpoints.s, setpoints.u, setpoints.feed])[kept]
    names = ("t (s)", f"s ({unit})", "u", f"feed ({unit}/s)")
    thread = thread[:, : place.shape[1]] if path.linear > 1 else place[kept]
    marks: list[Mark] = [Coloured(place[kept], shades, hover, names, thread, run.whole)]
    if not space:
        marks += [*_ends(place), *(_stops(path) if path.linear > 1 else ())]
    title = f"{theme.words(path.name)}: {theme.short(path.length)} {unit} in {theme.short(run.law.duration)} s, "
    title += f"top feed {theme.short(float(np.max(setpoints.feed)))} {unit}/s"
    x, y, z = _labels(path, setpoints, space)
    return Figure(title, (Panel(Axis(x), Axis(y), tuple(marks), height=300, equal=path.linear > 1, z=z),))


def still_figure(path: Path) -> Figure:
    """A path that is not planned yet, coloured by its curvature; InputError for fewer than two linear axes."""
    if path.linear < 2:
        raise InputError(f"plot.path: {path.name} has fewer than two linear axes; plot a run of it, over time")
    s = np.linspace(0.0, path.length, POINTS)
    curve, u = path.locate(s)
    found = path.evaluate(curve, u, 2)
    place = found[:, 0, : min(path.linear, 3)]
    if place.shape[1] == 3 and np.ptp(place[:, 2]) <= 0.0:
        place = place[:, :2]
    shades = {"curvature": _curvature(path, found, path.turning(curve, u))}
    x, y, *up = (f"{theme.words(axis, 12)} (mm)" for axis in path.axes[: place.shape[1]])
    marks: list[Mark] = [Coloured(place, shades, np.column_stack([s, u]), ("s (mm)", "u"), place)]
    if not up:
        marks += [*_ends(place), *_stops(path)]
    title = f"{theme.words(path.name)}: {theme.short(path.length)} mm"
    return Figure(title, (Panel(Axis(x), Axis(y), tuple(marks), height=300, equal=True, z="".join(up)),))


def _curvature(path: Path, found: Array, turning: BoolArray) -> Shades:
    """Curvature at places whose derivatives by u are `found`, (n, 3, axes), clipped at its quantile of 99.5 %."""
    kappa = np.where(turning, 0.0, curvatures(found, path.linear))
    return _shades(np.minimum(kappa, np.quantile(kappa[np.isfinite(kappa)], 0.995)), "curvature (1/mm)")


def _place(run: Run) -> Array:
    """Points of the picture, (n, 2 or 3): over the linear axes, the first one over time where there is one or none."""
    setpoints, linear = run.kept, run.path.linear
    place = run.place
    if linear <= 1:
        factor = 1.0 if linear else 180.0 / np.pi
        return np.column_stack([setpoints.t, factor * setpoints.position[:, 0]])
    flat = place.shape[1] < 3 or (run.joints is None and np.ptp(place[:, 2]) <= 0.0)
    return place[:, :2] if flat else place


def _labels(path: Path, setpoints: Setpoints, space: bool) -> tuple[str, str, str]:
    names = [theme.words(axis, 12) for axis in path.axes]
    if path.linear <= 1:
        return TIME.label, f"{names[0]} ({'mm' if path.linear else 'deg'})", ""
    return f"{names[0]} (mm)", f"{names[1]} (mm)", f"{names[2]} (mm)" if space else ""


def _quantities(run: Run, response: Response | None) -> dict[str, Shades]:
    """What the path may be coloured by, at each tick."""
    setpoints, path, use = run.kept, run.path, run.use
    along = unit_along(path.axes)
    out = {"feed": _shades(setpoints.feed, f"feed ({along}/s)")}
    if path.linear:
        found = path.evaluate(setpoints.curve, setpoints.u, 2)
        out["curvature"] = _curvature(path, found, path.turning(setpoints.curve, setpoints.u))
    if response is not None and response.contour_error is not None:
        error = np.full(len(setpoints), np.nan)
        error[: len(response)] = 1e3 * response.contour_error
        out["contour error"] = _shades(error, "contour error (µm)")
    most = 100.0 * use.share.max(axis=1, initial=0.0)
    out["nearest limit"] = Shades(most, "largest share (%)", 0.0, 100.0)
    for k, name in enumerate(use.names):
        words = theme.limit_words(name)
        out[f"share of {words}"] = Shades(100.0 * use.share[:, k], f"{words} (%)", 0.0, 100.0)
    return out


def _shades(values: Array, label: str) -> Shades:
    """The scale from the least value or zero to the largest."""
    finite = values[np.isfinite(values)]
    return Shades(
        values, label, min(0.0, float(np.min(finite, initial=0.0))), float(np.max(finite, initial=0.0)) or 1.0
    )


def _kept(place: Array, values: list[Array]) -> IntArray:
    """Ticks that the picture of the path shows: those that are a pixel apart, and the peaks of what colours it."""
    span = np.ptp(place, axis=0)
    kept = cells(place / max(float(np.max(span)), 1e-300))
    kept = kept[:: -(-len(kept) // POINTS)]
    peaks = [int(np.nanargmax(each)) for each in values if np.isfinite(each).any()]
    return np.unique(np.concatenate([kept, peaks, [0, len(place) - 1]])).astype(np.int64)


def _ends(place: Array) -> list[Dots]:
    """Start and end with a word each, or with one word if they are one place."""
    first, last = place[:1], place[-1:]
    size = float(np.max(np.ptp(place, axis=0)))
    if float(np.linalg.norm(last - first)) <= SAME_PLACE * size:
        return [Dots(first[:, 0], first[:, 1], words=("start and end",), colour=theme.INK, size=8.0)]
    start = Dots(first[:, 0], first[:, 1], words=("start",), colour=theme.INK, size=8.0)
    return [start, Dots(last[:, 0], last[:, 1], words=("end",), colour=theme.INK, size=8.0, hollow=True)]


def _stops(path: Path) -> list[Dots]:
    if not 0 < len(path.stops) <= MOST_STOPS:
        return []
    at = path(np.array(path.stops))
    return [Dots(at[:, 0], at[:, 1], "exact stop at a corner", named=True)]


def limits_figure(use: LimitUse, setpoints: Setpoints, name: str) -> Figure:
    """Feed and maximum-velocity curve over time, and below them the share of each limit that is used."""
    high = HEADROOM * float(np.max(setpoints.feed))
    lines = (
        thin(use.t, np.minimum(use.top, high), "maximum velocity", theme.PALE, width=1.0, named=True),
        thin(setpoints.t, setpoints.feed, "feed", named=True),
    )
    feed = Panel(TIME, Axis(f"feed ({unit_along(setpoints.axes)}/s)", low=0.0), lines, height=190)
    return Figure(
        f"{theme.words(name)}: which limit binds\nof the time: {_sentence(use)}",
        (feed, Panel(TIME, Axis("limit"), (_shares(use),), height=26 * max(len(use.names), 1))),
    )


def _shares(use: LimitUse) -> Heat:
    """The greatest share of each limit in each column of pixels, over time."""
    count = len(use.t)
    size = -(-count // min(count, STRIP))
    peaks = np.pad(use.share, ((0, -count % size), (0, 0)), mode="edge").reshape(-1, size, len(use.names)).max(axis=1)
    at = use.t[0] + (np.arange(len(peaks)) + 0.5) * size * float(use.t[-1] - use.t[0]) / max(count, 1)
    return Heat(at, tuple(theme.limit_words(name) for name in use.names), peaks.T, "share of limit")


def binding_figure(run: Run) -> Figure:
    """The path over its first two linear axes, or over time, in the colour of the limit that binds."""
    use, path = run.use, run.path
    place = _place(run)[:, :2]
    kinds = [name.partition(".")[0] for name in use.names]
    at = np.array([list(KINDS).index(kind) for kind in kinds] + [len(KINDS)], dtype=np.int64)[use.binding]
    colours = {theme.limit_words(kind): colour for kind, colour in KINDS.items()} | {"none": NONE}
    known = [*(theme.limit_words(kind) for kind in KINDS), "none"]
    kept = cells(place / np.where(np.ptp(place, axis=0) > 0.0, np.ptp(place, axis=0), 1.0))
    kept = np.unique(np.concatenate([kept, 1 + np.flatnonzero(np.diff(at))])).astype(np.int64)
    marks: list[Mark] = []
    for kind, part in _parts(use):
        on = np.isin(at[kept], [k for k, name in enumerate(known) if name == kind])
        joined = on | np.append(False, on[:-1])  # up to the first point of what comes next
        x, y = (np.where(joined, place[kept, k], np.nan) for k in (0, 1))
        if run.whole:
            marks.append(Line(x, y, f"{kind} {part:.0%}", colours[kind], 3.0, named=True))
        else:
            marks.append(Dots(x, y, f"{kind} {part:.0%}", colour=colours[kind], size=2.4, named=True))
    across, up, _ = _labels(path, run.kept, space=False)
    title = f"{theme.words(path.name)}: which limit binds ({BINDS:.0%} of it used), and in how much of the time"
    return Figure(title, (Panel(Axis(across), Axis(up), tuple(marks), height=300, equal=path.linear > 1),))


def _parts(use: LimitUse) -> list[tuple[str, float]]:
    """Kinds of limits and the part of the time in which they bind, the longest first, "none" last."""
    kinds: dict[str, float] = {}
    for name, part in use.time_bound_by().items():
        kind = theme.limit_words(name.partition(".")[0])
        kinds[kind] = kinds.get(kind, 0.0) + part
    none = kinds.pop("none", 0.0)
    return [*sorted(kinds.items(), key=lambda each: -each[1]), ("none", none)]


def _sentence(use: LimitUse) -> str:
    return ", ".join(f"{kind} {part:.0%}" for kind, part in _parts(use) if part >= 0.005)


def contour_figure(deviation: Deviation, name: str, machine: str) -> Figure:
    """Where the machine was beside the true path, its distance from the path enlarged and as colour."""
    path, error = deviation.path, deviation.error
    true = path(np.linspace(0.0, path.length, PATH_POINTS))[:, :2]
    largest = float(np.max(error, initial=0.0))
    enlarged = _enlargement(float(np.max(np.ptp(true, axis=0))), largest)
    unit, factor = ("µm", 1e3) if largest < MICROMETRES_BELOW else ("mm", 1.0)
    drawn = deviation.foot + enlarged * deviation.offset
    kept = cells(drawn)
    label = f"contour error ({unit})"
    shades = Shades(factor * error[kept], label, 0.0, factor * largest if largest > 0.0 else 1.0)
    at = int(np.argmax(error)) if len(error) else 0
    marks: tuple[Mark, ...] = (
        Line(true[:, 0], true[:, 1], "path", theme.FAINT, 1.0),
        Coloured(drawn[kept], {"contour error": shades}, factor * error[kept, None], (label,), true),
        Dots(drawn[at : at + 1, 0], drawn[at : at + 1, 1], words=(f"{theme.short(factor * largest)} {unit}",)),
    )
    title = (
        f"{theme.words(name)} on {theme.words(machine)}: contour error at most {theme.short(factor * largest)} {unit}\n"
        f"the distance from the path is drawn {enlarged:g} times as large"
    )
    x, y = (Axis(f"{theme.words(axis, 12)} (mm)") for axis in path.axes[:2])
    return Figure(title, (Panel(x, y, marks, height=300, equal=True),))


def _enlargement(size: float, largest: float) -> float:
    """A round number that makes the largest error some ENLARGED_TO of the picture, at least 1."""
    if largest <= 0.0:
        return 1.0
    wanted = ENLARGED_TO * size / largest
    power = 10.0 ** math.floor(math.log10(max(wanted, 1.0)))
    return max(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= max(wanted, 1.0)), 1.0)
