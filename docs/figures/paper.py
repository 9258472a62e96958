"""Make the numbers of docs/paper.md anew, between their markers, and draw plants.svg beside this script."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from marked import rows, write

import splinefeed as sf
from splinefeed.machine.parts import Axis, Drive
from splinefeed.reports import theme
from splinefeed.reports.figure import Dots, Figure, Level, Line, Mark, Panel
from splinefeed.reports.figure import PlotAxis as Scale
from splinefeed.runs.comparison import PAPER_ERROR, PAPER_METHODS, comparison, serve_methods
from splinefeed.runs.following import Servo, follow
from splinefeed.runs.settings import PAPER_LIMITS, PAPER_PERIOD, PAPER_SHAPE
from splinefeed.simulation.linear import margins

HERE = Path(__file__).parent
put = partial(write, "paper.md", "paper")
#: Plants that are tried: speed per volt, mm/s/V, and lag, s, of velocity drives; N*m/V of torque drives.
GAINS = (12.5, 25.0, 50.0, 100.0, 200.0, 400.0)
LAGS = (0.003, 0.01, 0.03, 0.1)
TORQUES = (0.127, 0.2, 0.25, 0.3, 0.35, 0.382, 0.42, 0.45, 0.5)
#: Lag of the current of a torque drive, s.
CURRENT_LAG = 1e-4
XY = ("x", "y")


def main() -> None:
    """Run the experiment and the plants, fill docs/paper.md, and draw plants.svg."""
    path = sf.shapes.from_text(PAPER_SHAPE)
    run = sf.run(path, PAPER_LIMITS, period=PAPER_PERIOD)
    table = sf.Machine.load("xytheta")
    flat = list(serve_methods(path, run.law, table))
    solid = list(serve_methods(sf.paths.tangential(path), run.law, table))
    put("run", run_words(run))
    put("methods", methods(path, run.law))
    put("errors", errors(flat, solid))
    put("margins", loops(table))
    put("plants", plants(table, run.points))


def run_words(run: sf.runs.run.Run) -> str:
    """Length, time, top feed, phases, and what the axes see."""
    law, path = run.law, run.path
    peaks = run.axis_peaks()
    phases = ", ".join(f"{1e3 * step:.1f}" for step in np.diff(law.breaks))
    return (
        f"The default path is {path.length:.6f} mm long (chord {chord(path):.4f} mm, least radius "
        f"{path.minimum_radius():.3f} mm) and takes {law.duration:.3f} s, {len(run.points)} setpoints at 1 ms. "
        f"The feed peaks at {run.points.feed.max():.3f} mm/s. Phases, ms: {phases}. At the nose the x axis sees "
        f"{peaks['x']['acceleration']:.0f} mm/s^2 and {peaks['x']['jerk']:.0f} mm/s^3, "
        f"{peaks['x']['acceleration_share']:.1f} and {peaks['x']['jerk_share']:.1f} times the path's A and J."
    )


def chord(path: sf.Path) -> float:
    """Chord of the airfoil, mm."""
    low, high = path.bounding_box()
    return float(high[0] - low[0])


def methods(path: sf.Path, law: sf.TimeLaw) -> str:
    """Ripple and drift of the paper's methods and of ours on the default path."""
    lines = [("method", "feed ripple, largest", "rms", "drift at the end, um", "chord error, um")]
    for trace in sf.runs.compare(path, law, period=PAPER_PERIOD, methods=PAPER_METHODS):
        each = trace.result
        numbers = f"{each.ripple_max:.1e}", f"{each.ripple_rms:.1e}", f"{1e3 * each.drift_mm:.3f}"
        lines.append((f"`{each.method}`", *numbers, f"{1e3 * each.chord_error_mm:.3f}"))
    return rows(*lines)


def errors(flat: list[Servo], solid: list[Servo]) -> str:
    """Largest errors by method, in the plane and with theta, and what follows."""
    lines = [("method", "x, um", "y, um", "contour, um", "its rms, um", "where, mm", "theta, deg (3-D)")]
    for plane, space in zip(flat, solid, strict=True):
        numbers, third = plane.numbers(), space.numbers()
        x, y = (1e3 * numbers["tracking_error_max"][axis] for axis in XY)
        contour, rms = 1e3 * numbers["contour_error_max_mm"], 1e3 * numbers["contour_error_rms_mm"]
        where = numbers["contour_error_at"]["s_mm"]
        lines.append((
            f"`{numbers['method']}`", f"{x:.2f}", f"{y:.2f}", f"{contour:.2f}", f"{rms:.2f}", f"{where:.2f}",
            f"{third['tracking_error_max']['theta']:.2f}",
        ))  # fmt: skip
    found = comparison(flat)
    main = flat[-1].numbers()["tracking"]["x"]
    return (
        f"{rows(*lines)}\n\nThe largest error of an axis is {main['max']:.5f} mm, on x at {main['at_t_s']:.3f} s, "
        f"{main['at_s_mm'] - 16.5:.2f} mm behind the nose; the paper measured {PAPER_ERROR} mm. The contour errors of "
        f"the three methods are {found['spread_share']:.2%} apart; their setpoints are at most "
        f"{1e3 * found['setpoints_off_law_largest_mm']:.2f} um off the time law."
    )


def loops(table: sf.Machine) -> str:
    """Margins of table 2's gains on xytheta, and on the same table with a faster drive."""
    lines = [("axis", "lag 10 ms (xytheta)", "lag 1 ms")]
    for name, axis in table.axes.items():
        fast = replace(axis, drive=replace(axis.drive, lag=1e-3))
        lines.append((name, margins(axis, PAPER_PERIOD).verdict, margins(fast, PAPER_PERIOD).verdict))
    return rows(*lines, left=3)


def plants(table: sf.Machine, points: sf.Setpoints) -> str:
    """The largest x error over plants that the paper may have had, as a table, and as plants.svg."""
    found = {lag: [largest(with_drives(table, velocity(gain, lag)), points) for gain in GAINS] for lag in LAGS}
    lines = [("speed per volt, mm/s/V", *(f"lag {1e3 * lag:g} ms" for lag in LAGS))]
    for i, gain in enumerate(GAINS):
        lines.append((f"{gain:g}", *(cell(*found[lag][i]) for lag in LAGS)))
    heavy = heavier(table)
    torque = [largest(with_drives(heavy, torque_drive(each)), points) for each in TORQUES]
    by_torque = [("torque per volt, N*m/V", "largest error"), *(
        (f"{each:g}", cell(*result)) for each, result in zip(TORQUES, torque, strict=True)
    )]  # fmt: skip
    # between those of the table: the error jumps with counts and codes, so that its own root hangs on rounding
    near = round(float(np.interp(-PAPER_ERROR, [-error for error, _ in torque], TORQUES)), 2)
    tuned = with_drives(heavy, torque_drive(near))
    verdicts = "; ".join(f"{axis}: {margins(tuned.axes[axis], PAPER_PERIOD).verdict}" for axis in XY)
    draw_plants(found, torque)
    return (
        f"Velocity drives, everything else as in `xytheta`; largest error of x and y, um:\n\n{rows(*lines)}\n\n"
        f"Torque drives, current lag {1e3 * CURRENT_LAG:g} ms, the y slide "
        f"{heavy.axes['y'].load.inertia:.0f} kg in place of {table.axes['y'].load.inertia:.0f} kg, um:\n\n"
        f"{rows(*by_torque)}\n\nAbout {near:.2f} N*m/V give the paper's {1e3 * PAPER_ERROR:.2f} um (peak torque at "
        f"{table.axes['x'].motor.peak_force / near:.1f} V); {verdicts}."
    )


def velocity(gain: float, lag: float) -> Drive:
    """A velocity drive like that of xytheta."""
    return Drive(mode="velocity", lag=lag, speed_per_volt=gain, bandwidth=2.0 * np.pi * 60.0)


def torque_drive(torque: float) -> Drive:
    """A torque drive of so many N*m a volt."""
    return Drive(mode="torque", lag=CURRENT_LAG, force_per_volt=torque)


def with_drives(table: sf.Machine, drive: Drive) -> sf.Machine:
    """The table with that drive on x and y."""
    return replace(table, axes={**table.axes, **{name: replace(table.axes[name], drive=drive) for name in XY}})


def heavier(table: sf.Machine) -> sf.Machine:
    """The table with y as heavy beside x as its gains are high beside x's: then both loops are alike."""
    x, y = (table.axes[name] for name in XY)
    ratio = y.controller.kp / x.controller.kp
    load = 1e3 * (ratio * (x.motor_inertia + x.load_inertia) - y.motor_inertia)
    heavy: Axis = replace(y, load=replace(y.load, inertia=load))
    return replace(table, axes={**table.axes, "y": heavy})


def largest(table: sf.Machine, points: sf.Setpoints) -> tuple[float, bool]:
    """Largest error of x and y, mm, and whether both loops are stable."""
    response = follow(points, table)
    stable = all(margins(table.axes[name], PAPER_PERIOD).stable for name in XY)
    return float(np.max(np.abs(response.tracking_error))), stable and response.stopped is None


def cell(error: float, stable: bool) -> str:
    """Micrometres, or that the loop is unstable."""
    return f"{1e3 * error:.1f}" if stable else "unstable"


def draw_plants(found: dict[float, list[tuple[float, bool]]], torque: list[tuple[float, bool]]) -> None:
    """Error over the gain of the drive, stable plants only, with the paper's figure as a line."""
    paper = Level(1e3 * PAPER_ERROR, "the paper's", always=True)
    left: list[Mark] = [paper]
    for (lag, results), colour in zip(found.items(), (theme.BLUE, theme.GREEN, theme.INK, theme.FAINT), strict=True):
        kept = [(gain, 1e3 * error) for gain, (error, stable) in zip(GAINS, results, strict=True) if stable]
        x, y = np.transpose(kept)
        left += [Line(x, y, f"lag {1e3 * lag:g} ms", colour, named=True), Dots(x, y, colour=colour, size=5.0)]
    x, y = np.transpose([(each, 1e3 * error) for each, (error, stable) in zip(TORQUES, torque, strict=True) if stable])
    right = (paper, Line(x, y, "torque drives, heavier y", named=True), Dots(x, y, colour=theme.BLUE, size=5.0))
    error = Scale("largest error (µm)", log=True)
    panels = (
        Panel(Scale("speed per volt (mm/s/V)", log=True), error, tuple(left), height=260),
        Panel(Scale("torque per volt (N·m/V)"), error, right, height=260),
    )
    title = "Largest error of x and y on plants that the paper may have had (stable ones)"
    Figure(title, panels, columns=2, width=860).save(HERE / "plants.svg")


if __name__ == "__main__":
    main()
