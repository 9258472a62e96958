"""Figures of what the axes of a machine did: errors over time, their spectra, and how tuned axes answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from splinefeed.analysis.bands import Band
from splinefeed.analysis.following import LEAST_SAMPLES, tracking_spectra
from splinefeed.records import ROTARY_AXES, Array, Response
from splinefeed.reports import theme
from splinefeed.reports.figure import Dots, Figure, Level, Line, Mark, Panel, PlotAxis, peak
from splinefeed.reports.motion_figures import TIME
from splinefeed.runs.contour_feed import FeedTuning
from splinefeed.runs.result import Run
from splinefeed.simulation.curves import SHORTEST, loop_curves, step_responses, watched
from splinefeed.simulation.linear import ComplexArray, Margins
from splinefeed.simulation.tuning import TunedAxis

#: Decibels below the largest value that are shown of a loop, degrees of its phase that are always, and the least.
DEPTH = 60.0
PHASES, LEAST_PHASE = (-300.0, -30.0), -720.0


def errors_figure(
    responses: Mapping[str, Response], name: str = "", machine: str = "", bands: Mapping[str, Band] | None = None
) -> Figure:
    """Draw contour error and following error of each axis over time, one colour a method (fig. 5 of the paper).

    Parameters
    ----------
    responses : mapping of str to Response
        By method. Where the output of an axis is at its limit that is marked; the notes are of the first method.
    name, machine : str, optional
        Of path and machine, for the title.
    bands : mapping of str to Band, optional
        Of the errors of the first method, where its response has but the samples with peaks.

    Returns
    -------
    Figure
        A panel for the contour error where there is one, then one an axis; µm, rotary axes in degrees.
    """
    own = next(iter(responses.values()))
    shown: list[tuple[str, str, dict[str, Array], Line | None, Line | None]] = []
    if own.contour_error is not None:
        errors = {key: 1e3 * each.contour_error for key, each in responses.items() if each.contour_error is not None}
        area = _band(bands, "contour_error", 0, 1e3)
        shown.append(("contour error", "µm", errors, None, area))
    for column, axis in enumerate(own.axes):
        factor, unit = shown_in(axis in ROTARY_AXES)
        errors = {key: factor * each.tracking_error[:, column] for key, each in responses.items()}
        area = _band(bands, "tracking_error", column, factor)
        full = _band(bands, "saturated", column, 1.0) or Line(own.t, own.saturated[:, column].astype(np.float64))
        at_limit = full.through(lambda each: np.where(each > 0.0, 0.0, np.nan)) if full.values.any() else None
        shown.append((f"{theme.words(axis, 12)} following error", unit, errors, at_limit, area))
    panels = []
    for label, unit, errors, at_limit, area in shown:
        lines = [Line(responses[method].t, each) for method, each in errors.items()]
        if area is not None:
            lines[0] = area
        marks: list[Mark] = [
            replace(line, name=theme.words(method, 30), colour=theme.colour(k), named=len(errors) > 1)
            for k, (method, line) in enumerate(zip(errors, lines, strict=True))
        ]
        (at, most), *others = (peak(each) for each in errors.values())
        note = f"at most {theme.short(most)} {unit} at {theme.short(float(own.t[at]))} s" if most > 0.0 else "none"
        note += f"; {', '.join(theme.short(each) for _, each in others)}" if others else ""
        if at_limit is not None:
            marks.append(replace(at_limit, name="output at its limit", colour=theme.VERMILION, width=4.0, named=True))
        if own.stopped is not None and len(own):
            marks.append(Level(float(own.t[-1]), "stopped", upright=True, always=True))
        panels.append(Panel(TIME, PlotAxis(f"{label} ({unit})"), tuple(marks), note=note))
    title = f"{theme.words(name)} on {theme.words(machine)}: errors over time" if name else "errors over time"
    return Figure(title, tuple(panels), legend=True)


def _band(bands: Mapping[str, Band] | None, quantity: str, k: int, factor: float) -> Line | None:
    """A curve of the bands of a quantity in another unit, None where there are none."""
    if not bands or quantity not in bands:
        return None
    band = bands[quantity]
    return Line(band.edges, factor * band.low[:, k], high=factor * band.high[:, k])


def shown_in(rotary: bool) -> tuple[float, str]:
    """What a small error of an axis is multiplied by, and its unit then."""
    return (180.0 / np.pi, "°") if rotary else (1e3, "µm")


def has_spectra(run: Run, response: Response) -> bool:
    """Tell whether there are spectra: they need every tick, and enough of them.

    Parameters
    ----------
    run, response : Run, Response
        The run, and what a machine did.

    Returns
    -------
    bool
        True where there are.
    """
    return run.whole and len(response) >= LEAST_SAMPLES


def spectra_figure(responses: Mapping[str, Response]) -> Figure:
    """Draw amplitude spectra of the following errors, both scales logarithmic.

    Parameters
    ----------
    responses : mapping of str to Response
        By name; of several all but the last are dashed.

    Returns
    -------
    Figure
        One panel, over Hz.
    """
    lines = []
    for called, response in responses.items():
        dash = called != list(responses)[-1]
        for k, (axis, found) in enumerate(tracking_spectra(response).items()):
            factor, unit = shown_in(axis in ROTARY_AXES)
            amplitude = np.maximum(factor * found.amplitude[1:], 1e-12)
            name = ", ".join(filter(None, (f"{axis} ({unit})", called)))
            lines.append(Line(found.frequency[1:], amplitude, name, theme.colour(k), dash=dash, named=True))
    panel = Panel(PlotAxis("frequency (Hz)", log=True), PlotAxis("amplitude", log=True), tuple(lines), height=260)
    return Figure("spectra of the following errors", (panel,), legend=True)


def bode_figure(tuned: TunedAxis, machine: str) -> Figure:
    """Draw gain and phase of the open loop with their margins, and gain of the closed loop with its bandwidth.

    Parameters
    ----------
    tuned : TunedAxis
        Before and after.
    machine : str
        Its name, for the title; may be empty.

    Returns
    -------
    Figure
        Three panels; dB and degrees over Hz.
    """
    new, after = loop_curves(tuned.axis, tuned.period), tuned.margins
    old = loop_curves(tuned.old, tuned.period)
    gain: list[Mark] = []
    phase: list[Mark] = []
    closed: list[Mark] = []
    most = 0.0
    for curves, loop, (name, colour, dash) in ((old, tuned.before, _OLD), (new, after, _NEW)):
        label = name if loop.stable else f"{name}: unstable"
        gain.append(Line(curves.frequency, _decibels(curves.loop), label, colour, dash=dash, named=True))
        phase.append(Line(curves.frequency, _phase(curves.loop), label, colour, dash=dash))
        if loop.stable:  # an unstable loop has no response to show
            decibels = _decibels(curves.closed)
            most = max(most, float(np.max(decibels)))
            closed.append(Line(curves.frequency, decibels, label, colour, dash=dash))
    # what an unstable loop does not have is not finite, and not drawn
    gain += _margin("gain margin", after.gain_frequency, -after.gain_margin_db, 0.0, after.phase_frequency)
    if after.gain_reduction > 0.0:
        gain += _margin("the gain may fall", after.reduction_frequency, after.gain_fall_db, 0.0, after.phase_frequency)[
            :2
        ]
    phase += _margin("phase margin", after.phase_frequency, -180.0 + after.phase_margin, -180.0, after.gain_frequency)
    closed.append(_dot(after.bandwidth, -3.01, f"bandwidth {theme.short(after.bandwidth)} Hz"))
    ends = float(new.frequency[0]), float(new.frequency[-1])
    frequency = PlotAxis("frequency (Hz); the loop ends at half the servo rate", *ends, log=True)
    both = (old, new)
    top = max(float(np.max(_decibels(each.loop))) for each in both)
    turns = np.concatenate([_phase(each.loop)[_decibels(each.loop) > -DEPTH] for each in both])
    rows = (
        ("loop gain (dB)", gain, 0.0, -DEPTH, top + 3.0),
        ("loop phase (°)", phase, -180.0, *_window(turns)),
        ("closed loop (dB)", closed, -3.0, -DEPTH / 2.0, min(max(most + 3.0, 6.0), 30.0)),
    )
    panels = []
    for label, marks, level, bottom, upper in rows:
        marks.append(Level(level, colour=theme.FAINT, always=True))
        panels.append(Panel(frequency, PlotAxis(label, bottom, upper), tuple(marks), height=190))
    axis, of = theme.words(tuned.axis.name, 12), f"{theme.words(machine)}, " if machine else ""
    said = "\n".join([f"{of}axis {axis}: {tuned.rule}", *_margin_words(after)])
    return Figure(said, tuple(panels))


def _window(degrees: Array) -> tuple[float, float]:
    """Ends of a scale of phases, those of PHASES at the least."""
    low, high = (float(each(degrees, initial=0.5 * sum(PHASES))) for each in (np.min, np.max))
    return max(min(low - 10.0, PHASES[0]), LEAST_PHASE), max(high + 10.0, PHASES[1])


_OLD, _NEW = ("old gains", theme.FAINT, True), ("new gains", theme.BLUE, False)


def _margin(name: str, at: float, place: float, edge: float, other: float) -> list[Mark]:
    """A margin as a line from the loop, which has a dot, to the edge of stability; and where the other margin is."""
    line = Line(np.array([at, at]), np.array(sorted([place, edge])), name, theme.VERMILION, 2.4)
    said = f"{name} at {theme.short(at)} Hz"
    dot = Dots(np.array([at]), np.array([place]), said, hover=(said,))
    return [line, dot, Level(other, upright=True, always=True)]


def _dot(x: float, y: float, words: str) -> Dots:
    return Dots(np.array([x]), np.array([y]), words=(words,))


def _margin_words(margins: Margins) -> list[str]:
    """What the bars of a figure are, in a line or two."""
    if not margins.stable:
        return [margins.verdict]
    gains = f"red: gain margin {margins.gain_margin_db:.1f} dB at {theme.short(margins.gain_frequency)} Hz"
    if margins.gain_reduction > 0.0:
        at = theme.short(margins.reduction_frequency)
        gains += f"; the gain may fall by {margins.gain_fall_db:.1f} dB (at {at} Hz)"
    return [
        gains,
        f"phase margin {theme.short(margins.phase_margin)}° at {theme.short(margins.phase_frequency)} Hz, delay margin "
        f"{theme.short(1e3 * margins.delay_margin)} ms",
    ]


def _decibels(values: ComplexArray) -> Array:
    out: Array = 20.0 * np.log10(np.maximum(np.abs(values), 1e-12))
    return out


def _phase(values: ComplexArray) -> Array:
    """Phase without jumps, deg, its start between -270 and 90."""
    angle = np.degrees(np.unwrap(np.angle(values)))
    out: Array = angle - 360.0 * np.round((angle[0] + 90.0) / 360.0)
    return out


def step_figure(axes: Sequence[TunedAxis], machine: str) -> Figure:
    """Draw what a small step does to each axis with its old and new gains.

    Parameters
    ----------
    axes : sequence of TunedAxis
        Before and after.
    machine : str
        Its name, for the title.

    Returns
    -------
    Figure
        A panel an axis, in its own unit, over ms.
    """
    panels = []
    duration = max((watched(each.old, each.axis, each.period) for each in axes), default=SHORTEST)
    for tuned in axes:
        factor, unit = shown_in(tuned.axis.rotary)
        steps = step_responses(tuned.old, tuned.axis, tuned.period, duration)
        size = worst = factor * steps[1].size
        marks: list[Mark] = [Level(size, "commanded", always=True)]
        loops = ((tuned.before, _OLD), (tuned.margins, _NEW))
        for step, (loop, (name, colour, dash)) in zip(steps, loops, strict=True):
            name += "" if loop.stable else ": unstable"
            name += ", stopped" if step.stopped else ""
            worst = max(worst, factor * peak(step.position)[1])
            marks.append(Line(1e3 * step.t, factor * step.position, name, colour, dash=dash, named=True))
        axis, gap = theme.words(tuned.axis.name, 12), "" if tuned.axis.rotary else " "
        label = f"axis {axis}, step of {theme.short(size)}{gap}{unit} ({unit})"
        y = PlotAxis(label, -0.4 * size, min(1.15 * worst, 2.5 * size))
        panels.append(Panel(PlotAxis("time after the step (ms)"), y, tuple(marks), height=170))
    title = f"{theme.words(machine)}: a small step, on the full model with friction, counts and codes"
    return Figure(title, tuple(panels), legend=True)


def feed_curve_figure(tuning: FeedTuning, name: str, machine: str) -> Figure:
    """Draw the contour error of every trial over its top feed, the best one marked.

    Parameters
    ----------
    tuning : FeedTuning
        The trials.
    name, machine : str
        Of path and machine, for the title.

    Returns
    -------
    Figure
        One panel; µm over mm/s.
    """
    sound = [trial for trial in tuning.trials if trial.stopped is None]
    feed, error = np.array([(trial.feed, 1e3 * trial.error) for trial in sound]).reshape(-1, 2).T
    words, best, order = f"{theme.short(1e3 * tuning.tolerance)} µm", tuning.best, np.argsort(feed)
    marks: list[Mark] = [
        Line(feed[order], error[order]),
        Dots(feed, error, colour=theme.BLUE, size=5.0),
        Level(1e3 * tuning.tolerance, f"tolerance {words}", always=True),
    ]
    found = f"none of these feeds keeps {words}"
    if best is not None:
        found = f"within {words}: top feed {theme.short(best.feed)} mm/s, {theme.short(best.duration)} s"
        marks.append(Dots(np.array([best.feed]), np.array([1e3 * best.error]), size=9.0))
    x, y = PlotAxis("top feed (mm/s)", log=True), PlotAxis("largest contour error (µm)", log=True)
    title = f"{theme.words(name)} on {theme.words(machine)}: contour error by feed\n{found}"
    return Figure(title, (Panel(x, y, tuple(marks), height=260),))
