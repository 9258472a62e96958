"""Figures of a path: coloured by feed, curvature or what else is known, by the limit that binds, by contour error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.analysis.measures import BINDS, LimitUse
from splinefeed.analysis.thinning import cells, runs
from splinefeed.checks.law import times_at
from splinefeed.curves.differential import curvatures
from splinefeed.errors import InputError, expect
from splinefeed.limit_table import MODELS, PLACES
from splinefeed.paths.path import Path
from splinefeed.records import TABLE, Array, IntArray, Response, Setpoints, field_of, unit_along, unit_of_axis, words_of
from splinefeed.reports import theme
from splinefeed.reports.figure import Coloured, Dots, Figure, Heat, Line, Mark, Panel, PlotAxis, Shades
from splinefeed.reports.motion_figures import TIME, maximum_velocity, over_time
from splinefeed.runs.following import Deviation
from splinefeed.runs.result import Run
from splinefeed.simulation.curves import rounded_down

#: Points of a path, and of the true path in the picture of its errors, at most.
POINTS, PATH_POINTS = 4000, 3000
#: More of them where lines between would leave the path by more than this share of its size, at most so many in all.
OFF, MOST_POINTS = 1.0 / 1200.0, 16_000
#: Poses of an arm for a page that moves it, one every so many seconds, and at least and at most so many.
POSE_EVERY, POSES = 0.02, (60, 600)
#: Points of a row of rapid moves that are not straight.
RAPID_POINTS = 65
#: More stops than this are not marked one by one.
MOST_STOPS = 60
#: Ends of a path closer than this share of its picture get one word.
SAME_PLACE = 0.02
#: Share of the picture that the largest contour error is enlarged to.
ENLARGED_TO = 0.12
#: Colour of each kind of limit; one for all axes, and for whatever does the same.
COLOURS = {
    **{each.name: "#A0522D" for each in TABLE if each.bounds in (PLACES, MODELS)},
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
    "axis_velocity_step": "#F0E442",
    "combinations": "#7A3E9D",
    "none": "#c4c4c4",
}


def path_figure(run: Run, response: Response | None = None, colour: str | None = None) -> Figure:
    """Draw where the tool goes, coloured by feed or by one of much else.

    Parameters
    ----------
    run : Run
        To be drawn over the linear axes, or over time if there is one.
    response : Response, optional
        What the axes of a machine did.
    colour : str, optional
        The only one wanted, where there is one of that name; all by default, of which a page shows one.

    Returns
    -------
    Figure
        One panel.
    """
    path, (setpoints, share, joined) = run.path, _seen(run)
    unit = unit_along(path.axes)
    place, labels = _place(run, setpoints)
    values = _quantities(run, setpoints, share, response)
    cut = place
    if path.feeds is not None and np.isinf(path.feeds).any() and run.planned is not None:
        cut = np.where(np.isinf(path.feeds[setpoints.curve])[:, None], np.nan, place)  # rapid moves lead elsewhere
    kept = _kept(place, [*(each.values for each in values.values()), *cut.T, *-cut.T])
    shades = {name: replace(each, values=each.values[kept]) for name, each in values.items()}
    if colour in shades:
        shades = {colour: shades[colour]}
    factor, per = theme.of_feed(path, unit)
    hover = np.column_stack([setpoints.t, setpoints.s, setpoints.u, factor * setpoints.feed])[kept]
    names: tuple[str, ...] = ("t (s)", f"s ({unit})", "u", f"feed ({per})")
    if path.lines is not None:
        hover = np.column_stack([hover, path.lines[setpoints.curve[kept]]])
        names = (*names, "line")
    thread = run.thread[:, : place.shape[1]] if path.linear > 1 else place[kept]
    title = f"{theme.words(path.name)}: {theme.short(run.length)} {unit} in {theme.short(run.duration)} s, "
    title += f"top feed {theme.short(factor * float(np.max(run.kept.feed)))} {per}"
    arm = run.poses(int(np.clip(run.duration / POSE_EVERY, *POSES)))
    track = _track(path, setpoints, place)
    mark = Coloured(place[kept], shades, hover, names, thread, joined, track=track, arm=arm)
    # of a path that came in parts there is only a line through the ticks kept, which says no stops and no rapid moves
    return _picture(path, title, mark, labels, None if run.planned is None else setpoints.curve[kept])


def _seen(run: Run) -> tuple[Setpoints, Array, bool]:
    """Where the path is looked at, the share of each limit there, (n, k), and whether it runs straight between.

    At every tick; where ticks are left out as often as bands have edges, and at every joint of the path: so that no
    corner is cut. There a share is the greatest of its block, and positions are those that the path says.
    """
    path, kept = run.path, run.kept
    if run.whole or run.planned is None:
        return kept, run.use.share, run.whole
    law, edges = run.law, run.bands["share"].edges
    t = np.union1d(edges, times_at(law, path.curve_starts[1:-1]))
    sigma = law(t)
    curve, u = path.locate(sigma)
    s, feed, *_ = path.of_tip(sigma, law.feed(t), law.acceleration(t), law.jerk(t))
    block = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(edges) - 2)
    moved = path if run.joints is None else run.joints
    ticks = replace(kept, t=t, curve=curve, u=u, s=s, feed=feed, position=moved(sigma))
    return ticks, np.asarray(run.bands["share"].high[block], dtype=np.float64), True


def _track(path: Path, seen: Setpoints, place: Array) -> tuple[Array, Array, Array]:
    """Times, s, where the tool is then, and 1 where it came there by a rapid move."""
    rapid = np.zeros(len(path.curves)) if path.feeds is None else np.isinf(path.feeds).astype(np.float64)
    rapid = rapid if rapid.min(initial=1.0) == 0.0 else np.zeros(len(rapid))  # where all are, there is nothing else
    curve = np.minimum(seen.curve, len(rapid) - 1)
    return seen.t, place, np.minimum(rapid[curve], rapid[np.append(curve[:1], curve[:-1])])


def still_figure(path: Path) -> Figure:
    """A path that is not planned yet, coloured by its curvature; InputError for fewer than two linear axes."""
    if path.linear < 2:
        raise InputError(f"plot.path: {path.name} has fewer than two linear axes; plot a run of it, over time")
    s = np.linspace(0.0, path.length, POINTS)
    curve, u = path.locate(s)
    found = path.evaluate(curve, u, 2)
    place = _flat(found[:, 0, : min(path.linear, 3)])
    shades, unit = {"curvature": _curvature(path, found)}, unit_along(path.axes)
    mark = Coloured(place, shades, np.column_stack([s, u]), (f"s ({unit})", "u"), place)
    title = f"{theme.words(path.name)}: {theme.short(path.tip_end)} {unit}"
    labels = [f"{theme.words(axis, 12)} ({unit_of_axis(axis)})" for axis in path.axes]
    return _picture(path, title, mark, labels, curve)


def _picture(path: Path, title: str, mark: Coloured, labels: list[str], curve: IntArray | None) -> Figure:
    """curve: that of each point of the mark; None where the curves are not known."""
    space, many = mark.place.shape[1] == 3, path.linear > 1
    marks: list[Mark] = [_with_rapids(path, mark, curve) if many and curve is not None else mark, _ends(mark.place)]
    if curve is not None and many and not space and 0 < len(path.stops) <= MOST_STOPS:
        at = path(np.array(path.stops))
        marks.append(Dots(at[:, 0], at[:, 1], "exact stop at a corner", named=True))
    z = labels[2] if space else ""
    return Figure(title, (Panel(PlotAxis(labels[0]), PlotAxis(labels[1]), tuple(marks), height=300, equal=many, z=z),))


def _with_rapids(path: Path, mark: Coloured, curve: IntArray) -> Coloured:
    """The mark with rapid moves dashed, which have infinite feeds among others that are finite."""
    if path.feeds is None or np.isinf(path.feeds).all() or np.isfinite(path.feeds).all():
        return mark
    rapid = np.isinf(path.feeds)
    parts: list[Array] = []
    for first, last in (each for each in runs(rapid) if rapid[each[0]]):
        straight = all(path.joined[i].degree == 1 for i in range(first, last + 1))
        s = path.curve_starts[first : last + 2]
        place = path(s if straight else np.linspace(s[0], s[-1], RAPID_POINTS))[:, : mark.place.shape[1]]
        parts += [place, np.full((1, place.shape[1]), np.nan)]
    place = np.where(rapid[curve, None], np.nan, mark.place)
    return replace(mark, place=place, rapid=np.concatenate(parts), thread=mark.thread)


def _curvature(path: Path, found: Array) -> Shades:
    """Curvature at places whose derivatives by u are `found`, (n, 3, axes), clipped at its quantile of 99.5 %.

    0 where the linear axes stand still.
    """
    moves = np.any(found[:, 1:, : path.linear], axis=(1, 2))
    kappa = np.where(moves, curvatures(found, path.linear), 0.0)
    return _shades(
        np.minimum(kappa, np.quantile(kappa[np.isfinite(kappa)], 0.995)), f"curvature (1/{unit_along(path.axes)})"
    )


def _place(run: Run, setpoints: Setpoints) -> tuple[Array, list[str]]:
    """Points of the picture, (n, 2 or 3), and labels; over time where at most one is linear."""
    path, linear = run.path, run.path.linear
    labels = [f"{theme.words(axis, 12)} ({unit_of_axis(axis)})" for axis in path.axes]
    if linear <= 1:
        first = setpoints.position[:, 0] if linear else np.degrees(setpoints.position[:, 0])
        return np.column_stack([setpoints.t, first]), [TIME.label, labels[0]]
    if (arm := path.sticks(setpoints.position)) is not None:
        return arm[:, -1], ["x (mm)", "y (mm)", "z (mm)"]
    if run.joints is not None:
        return path.evaluate(setpoints.curve, setpoints.u, 0)[:, 0], labels
    return _flat(setpoints.position[:, : min(linear, 3)]), labels


def _flat(place: Array) -> Array:
    return place[:, :2] if place.shape[1] == 3 and np.ptp(place[:, 2]) <= 0.0 else place


def _quantities(run: Run, setpoints: Setpoints, share: Array, response: Response | None) -> dict[str, Shades]:
    """What the path may be coloured by where it is looked at, with the share (n, k) of each limit there."""
    path, use = run.path, run.use
    along = unit_along(path.axes)
    factor, per = theme.of_feed(path, along)
    feed = factor * setpoints.feed
    if path.feeds is not None and np.isfinite(path.feeds).any() and run.planned is not None:
        # rapid moves have no colour
        feed = np.where(np.isinf(path.feeds[setpoints.curve]), np.nan, feed)
    out = {"feed": _shades(feed, f"feed ({per})")}
    if path.lines is not None and path.feeds is not None:
        programmed = factor * path.feeds[setpoints.curve]
        out["programmed feed"] = _shades(np.where(np.isinf(programmed), np.nan, programmed), f"programmed feed ({per})")
    if path.linear and run.planned is not None:
        found = path.evaluate(setpoints.curve, setpoints.u, 2)
        out["curvature"] = _curvature(path, found)
    if response is not None and response.contour_error is not None:
        error = np.interp(setpoints.t, response.t, 1e3 * response.contour_error, right=np.nan)
        out["contour error"] = _shades(error, "contour error (µm)")
    most = 100.0 * share.max(axis=1, initial=0.0)
    out["nearest limit"] = Shades(most, "largest share (%)", 0.0, 100.0)
    for k, name in enumerate(use.names):
        words = words_of(name)
        out[f"share of {words}"] = Shades(100.0 * share[:, k], f"{words} (%)", 0.0, 100.0)
    return out


def _shades(values: Array, label: str) -> Shades:
    """The scale from the least value or zero to the largest."""
    finite = values[np.isfinite(values)]
    return Shades(values, label, float(np.min(finite, initial=0.0)), float(np.max(finite, initial=0.0)) or 1.0)


def _kept(place: Array, values: list[Array]) -> IntArray:
    """Ticks that the picture of the path shows: those that are a pixel apart, and peaks of values (n,) each."""
    span = np.ptp(place, axis=0)
    size = max(float(np.max(span)), 1e-300)
    fine = cells(place / size)
    kept = _near(place / size, fine, np.union1d(fine[:: -(-len(fine) // POINTS)], fine[-1:]))
    peaks = [int(np.nanargmax(each)) for each in values if np.isfinite(each).any()]
    return np.unique(np.concatenate([kept, peaks, [0, len(place) - 1]])).astype(np.int64)


def _near(place: Array, fine: IntArray, kept: IntArray) -> IntArray:
    """Some places (n, d) by their numbers, and more of `fine` until lines between them come near all of these."""
    while len(kept) < MOST_POINTS:
        owner = np.clip(np.searchsorted(kept, fine, side="right") - 1, 0, max(len(kept) - 2, 0))
        start, way = place[kept[owner]], place[kept[np.minimum(owner + 1, len(kept) - 1)]] - place[kept[owner]]
        behind = place[fine] - start
        along = np.sum(behind * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-300)
        off = np.linalg.norm(behind - np.clip(along, 0.0, 1.0)[:, None] * way, axis=1)
        order = np.lexsort((off, owner))
        worst = order[np.append(np.flatnonzero(np.diff(owner[order])), len(order) - 1)]  # of each line
        added = fine[worst[off[worst] > OFF]]
        if not len(added):
            break
        kept = np.union1d(kept, added)
    return kept


def _ends(place: Array) -> Dots:
    closed = np.linalg.norm(place[-1] - place[0]) <= SAME_PLACE * np.max(np.ptp(place, axis=0))
    words = ("start and end",) if closed else ("start", "end")
    x, y, *z = place[[0, -1][: len(words)]].T
    return Dots(x, y, words=words, colour=theme.INK, size=8.0, z=tuple(z))


def limits(run: Run) -> Figure:
    """Draw feed under the maximum-velocity curve [1]_ over time, and the share of each limit in use.

    Parameters
    ----------
    run : Run
        To be drawn; mm/s and s.

    Returns
    -------
    Figure
        Two panels.

    Raises
    ------
    InputError
        For anything but a Run.

    References
    ----------
    .. [1] J. E. Bobrow, S. Dubowsky and J. S. Gibson, Int. J. Robotics Research 4(3) (1985) 3-17,
           doi:10.1177/027836498500400301.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000))
    >>> len(sf.plot.limits(run).panels)
    2
    """
    expect("plot.limits(run)", (run, Run))
    use = run.use
    factor, unit = theme.of_feed(run.path, unit_along(run.axes))
    drawn = maximum_velocity(run), over_time(run, "feed", name="feed", named=True)
    lines = tuple(line.through(lambda y: factor * y) for line in drawn)
    parts = ", ".join(f"{kind} {part:.0%}" for kind, part in _parts(use) if part >= 0.005)
    y = PlotAxis(f"feed ({unit})", low=0.0)
    feed = Panel(TIME, y, lines, note=f"of the time: {parts}", height=190)
    band = run.bands.get("share")
    x, share = (use.t, use.share) if band is None else (band.edges, band.high)
    shares = Heat(x, tuple(_row_words(use.names, run.axes)), share, "share of limit")
    below = Panel(TIME, PlotAxis("limit"), (shares,), height=26 * max(len(use.names), 1))
    return Figure(f"{theme.words(run.path.name)}: which limit binds", (feed, below))


def _row_words(names: Sequence[str], axes: Sequence[str]) -> list[str]:
    """Names of limits in words, with those of axes as legends have them."""
    called = dict(zip(axes, theme.axis_words(axes), strict=True))
    parted = [name.partition(".") for name in names]
    return [words_of(kind + dot + called.get(axis, axis)) for kind, dot, axis in parted]


def binding(run: Run) -> Figure:
    """Draw the path in the colour of the limit that binds.

    Parameters
    ----------
    run : Run
        To be drawn, mm, over its first two linear axes, or over time.

    Returns
    -------
    Figure
        One panel; names of limits with their share of the time.

    Raises
    ------
    InputError
        For anything but a Run.

    References
    ----------
    .. [1] docs/start.md shows the report.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000))
    >>> sf.plot.binding(run).save("binding.svg")
    """
    expect("plot.binding(run)", (run, Run))
    use, path = run.use, run.path
    place, labels = _place(run, run.kept)
    place = place[:, :2]
    kinds = np.array([words_of(field_of(name)) for name in (*use.names, "none")])[use.binding]
    kept = cells(place / np.where(np.ptp(place, axis=0) > 0.0, np.ptp(place, axis=0), 1.0))
    kept = np.unique(np.concatenate([kept, 1 + np.flatnonzero(kinds[1:] != kinds[:-1])])).astype(np.int64)
    marks: list[Mark] = []
    colours = {words_of(name): colour for name, colour in COLOURS.items()}
    for kind, part in _parts(use):
        on = kinds[kept] == kind
        joined = on | np.append(False, on[:-1])  # up to the first point of what comes next
        x, y = np.where(joined, place[kept].T, np.nan)
        name, colour = f"{kind} {part:.0%}", colours.get(kind, theme.INK)
        mark = Line(x, y, name, colour, 3.0, named=True)
        marks.append(mark if run.whole else Dots(x, y, name, colour=colour, size=2.4, named=True))
    title = f"{theme.words(path.name)}: which limit binds ({BINDS:.0%} of it used), and in how much of the time"
    panel = Panel(PlotAxis(labels[0]), PlotAxis(labels[1]), tuple(marks), height=300, equal=path.linear > 1)
    return Figure(title, (panel,))


def _parts(use: LimitUse) -> list[tuple[str, float]]:
    """Kinds of limits and the part of the time in which they bind, the longest first, "none" last."""
    kinds: dict[str, float] = {}
    for name, part in use.time_bound_by().items():
        kind = words_of(field_of(name))
        kinds[kind] = kinds.get(kind, 0.0) + part
    none = kinds.pop("none", 0.0)
    return [*sorted(kinds.items(), key=lambda each: -each[1]), ("none", none)]


def contour_figure(deviation: Deviation, name: str, machine: str) -> Figure:
    """Draw where a machine was beside the true path, its distance from the path enlarged and as colour.

    Parameters
    ----------
    deviation : Deviation
        Over two linear axes, mm.
    name, machine : str
        Of path and machine, for the title.

    Returns
    -------
    Figure
        One panel; mm, the distance in µm.
    """
    path, error, label = deviation.path, 1e3 * deviation.error, "contour error (µm)"
    true = path(np.linspace(0.0, path.length, PATH_POINTS))[:, :2]
    largest, size = float(np.max(error, initial=0.0)), float(np.max(np.ptp(true, axis=0)))
    enlarged = max(rounded_down(ENLARGED_TO * 1e3 * size / largest), 1.0) if largest > 0.0 else 1.0
    drawn = deviation.foot + enlarged * deviation.offset
    kept, words = cells(drawn), f"{theme.short(largest)} µm"
    shades = {"contour error": _shades(error[kept], label)}
    at = drawn[[np.argmax(error)] if len(error) else []]
    marks: tuple[Mark, ...] = (
        Line(true[:, 0], true[:, 1], "path", theme.FAINT, 1.0),
        Coloured(drawn[kept], shades, error[kept, None], (label,), true),
        Dots(at[:, 0], at[:, 1], words=(words,)),
    )
    title = (
        f"{theme.words(name)} on {theme.words(machine)}: contour error at most {words}\n"
        f"the distance from the path is drawn {enlarged:g} times as large"
    )
    x, y = (PlotAxis(f"{theme.words(axis, 12)} (mm)") for axis in path.axes[:2])
    return Figure(title, (Panel(x, y, marks, height=300, equal=True),))
