"""Figures of a tuned axis: its loop over frequency with the margins marked, and its answer to a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from splinefeed.records import Array
from splinefeed.report import theme
from splinefeed.report.drawing import short
from splinefeed.simulation.curves import TunedAxis
from splinefeed.simulation.linear import ComplexArray, Margins

#: Decibels below the largest value that are shown of a loop.
DEPTH = 60.0
#: Degrees shown of a phase.
PHASES = (-300.0, -30.0)


def bode_figure(tuned: TunedAxis, machine: str) -> Figure:
    """Gain and phase of the opened loop with gain and phase margin, and gain of the closed loop with its bandwidth."""
    old, new, after = tuned.old, tuned.new, tuned.margins
    title = f"{theme.words(machine)}, axis {theme.words(tuned.axis.name, 12)}: {tuned.rule}\n{_margin_words(after)}"
    with theme.applied():
        figure = theme.new_figure(7.6, 8.2, title, gaps=(0.0, 0.2), grid=(3, 1))
        gain, phase, closed = figure.subplots(3, 1, sharex=True)
        for curves, style, loop in ((old, _OLD, tuned.before), (new, _NEW, after)):
            label = style["label"] if loop.stable else f"{style['label']}: unstable"
            gain.plot(curves.frequency, _decibels(curves.loop), **style | {"label": label})
            phase.plot(curves.frequency, _phase(curves.loop), **style)
            if loop.stable:  # an unstable loop has no response to show
                closed.plot(curves.frequency, _decibels(curves.closed), **style)
        if tuned.identified is not None:
            dots: dict[str, Any] = {
                "linestyle": "",
                "marker": ".",
                "color": theme.INK,
                "markersize": 4,
                "label": "measured by sines",
            }
            gain.plot(tuned.identified.frequency, _decibels(tuned.identified.value), **dots)
            phase.plot(tuned.identified.frequency, _phase(tuned.identified.value), **dots)
        top = float(np.max(_decibels(new.loop)))
        gain.set_ylim(max(top - 2.0 * DEPTH, -DEPTH), min(top, 2.0 * DEPTH) + 3.0)
        phase.set_ylim(*PHASES)
        phase.set_yticks([-270.0, -225.0, -180.0, -135.0, -90.0, -45.0])
        peaks = [float(np.max(line.get_ydata())) for line in closed.get_lines()]
        peak = max(peaks, default=0.0)
        closed.set_ylim(-DEPTH / 2.0, min(max(peak + 3.0, 6.0), 30.0))
        for ax, level in ((gain, 0.0), (phase, -180.0), (closed, -3.0)):
            ax.axhline(level, color=theme.FAINT, linewidth=0.8)
        _mark_margins(gain, phase, after)
        if np.isfinite(after.bandwidth):
            closed.plot([after.bandwidth], [-3.01], "o", color=theme.VERMILION, markersize=5)
            _say(closed, after.bandwidth, -3.01, f"bandwidth {short(after.bandwidth)} Hz")
        for ax, label in ((gain, "loop gain (dB)"), (phase, "loop phase (°)"), (closed, "closed loop (dB)")):
            ax.set_xscale("log")
            ax.set_ylabel(label)
            ax.yaxis.set_label_coords(-theme.LABEL_AT / (7.6 - theme.LEFT - theme.RIGHT), 0.5)
            theme.plain_ticks(ax.yaxis)
        closed.set_xlim(new.frequency[0], new.frequency[-1])
        theme.plain_ticks(closed.xaxis)
        closed.set_xlabel("frequency (Hz); the loop ends at half the servo rate")
        gain.legend(loc="upper right", fontsize=8.5, **_LEGEND)
        return figure


_OLD: dict[str, Any] = {"color": theme.FAINT, "linewidth": 1.0, "linestyle": (0, (4, 2)), "label": "old gains"}
_NEW: dict[str, Any] = {"color": theme.BLUE, "label": "new gains"}


_LEGEND: dict[str, Any] = {"frameon": True, "facecolor": "white", "edgecolor": "none", "framealpha": 0.85}


def _margin_words(margins: Margins) -> str:
    if not margins.stable:
        return margins.verdict
    return (
        f"gain margin {short(margins.gain_margin)} ({margins.gain_margin_db:.1f} dB), phase margin "
        f"{short(margins.phase_margin)}°, delay margin {short(1e3 * margins.delay_margin)} ms"
    )


def _mark_margins(gain: Axes, phase: Axes, margins: Margins) -> None:
    """The gain margin as a line from the loop up to 0 dB, the phase margin as one from -180 degrees up to the loop."""
    colour = theme.VERMILION
    if np.isfinite(margins.gain_margin):
        at, low = margins.gain_frequency, -margins.gain_margin_db
        gain.plot([at, at], [low, 0.0], color=colour, linewidth=2.0)
        phase.axvline(at, color=colour, linewidth=0.7, linestyle=(0, (2, 2)))
        _say(gain, at, low, f"gain margin at {short(at)} Hz")
    if np.isfinite(margins.phase_margin):
        at, angle = margins.phase_frequency, -180.0 + margins.phase_margin
        phase.plot([at, at], [-180.0, angle], color=colour, linewidth=2.0)
        gain.axvline(at, color=colour, linewidth=0.7, linestyle=(0, (2, 2)))
        _say(phase, at, min(angle, -180.0), f"phase margin at {short(at)} Hz")


def _say(ax: Axes, x: float, y: float, text: str) -> None:
    """A few words left of a place and below it: a loop comes from above."""
    ax.annotate(
        text,
        (x, y),
        xytext=(-5, -4),
        textcoords="offset points",
        ha="right",
        va="top",
        color=theme.VERMILION,
        fontsize=8.5,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )


def _decibels(values: ComplexArray) -> Array:
    out: Array = 20.0 * np.log10(np.maximum(np.abs(values), 1e-12))
    return out


def _phase(values: ComplexArray) -> Array:
    """Phase without jumps, deg, its start between -270 and 90."""
    angle = np.degrees(np.unwrap(np.angle(values)))
    out: Array = angle - 360.0 * np.round((angle[0] + 90.0) / 360.0)
    return out


def step_figure(axes: Sequence[TunedAxis], machine: str) -> Figure:
    """What a small step does to each axis with its old and new gains, in its own unit; a panel an axis."""
    count = len(axes)
    with theme.applied():
        title = f"{theme.words(machine)}: a small step, on the full model with friction, counts and codes"
        figure = theme.new_figure(7.6, 1.0 + 2.1 * count, title, gaps=(0.0, 0.5), grid=(count, 1), titles=1)
        rows = figure.subplots(count, 1, squeeze=False)[:, 0]
        for ax, tuned in zip(rows, axes, strict=True):
            factor, unit = (180.0 / np.pi, "°") if tuned.axis.rotary else (1e3, "µm")
            loops = (tuned.before, tuned.margins)
            for step, style, loop in zip(tuned.steps, (_OLD, _NEW), loops, strict=True):
                state = ": unstable" if not loop.stable else ""
                label = f"{style['label']}{state}{', ran away' if step.stopped else ''}"
                ax.step(1e3 * step.t, factor * step.position, where="post", **style | {"label": label})
            size = factor * tuned.steps[1].size
            ax.axhline(size, color=theme.FAINT, linewidth=0.8)
            worst = max(float(np.max(np.abs(step.position), initial=0.0)) * factor for step in tuned.steps)
            ax.set_ylim(-0.4 * size, min(1.08 * max(worst, size), 2.5 * size))
            ax.set_xlim(1e3 * tuned.steps[1].t[0], 1e3 * max(step.t[-1] for step in tuned.steps))
            ax.set_ylabel(f"{theme.words(tuned.axis.name, 12)} ({unit})")
            gap = "" if tuned.axis.rotary else " "
            ax.set_title(f"axis {theme.words(tuned.axis.name, 12)}: step of {short(size)}{gap}{unit}", fontsize=9.5)
            ax.yaxis.set_label_coords(-theme.LABEL_AT / (7.6 - theme.LEFT - theme.RIGHT), 0.5)
            theme.plain_ticks(ax.yaxis)
            theme.plain_ticks(ax.xaxis)
            ax.legend(loc="lower right", fontsize=8.5, **_LEGEND)
        rows[-1].set_xlabel("time after the step (ms)")
        return figure
