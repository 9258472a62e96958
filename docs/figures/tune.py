"""Make the numbers of docs/tune.md anew, between their markers, and draw tune-bode.svg and tune-step.svg."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

from marked import rows, words, write

import splinefeed as sf
from splinefeed.machine.parts import ServoAxis
from splinefeed.reports.servo_figures import bode_figure, step_figure
from splinefeed.runs.tuning import PathTuning, tune_on_path
from splinefeed.simulation.curves import hunts, rest_swing
from splinefeed.simulation.linear import Margins, margins
from splinefeed.simulation.tuning import Tuning

HERE = Path(__file__).parent
PERIOD = 1e-3
put = partial(write, "tune.md", "tune")
#: Lags of the drive that the paper may have had, s.
LAGS = (1e-3, 3e-3, 5e-3, 10e-3, 20e-3)


def main() -> None:
    """Tune the paper's table by every rule and on the paper's path, fill docs/tune.md, and draw X before and after."""
    table = sf.Machine.load("xytheta")
    x = table.servo_axis("x")
    old, calm = sf.runs.tune(x, "ziegler-nichols"), sf.runs.tune(x, "tyreus-luyben")
    put("stable", stable(old))
    put("drives", drives(x))
    run = sf.run(sf.shapes.naca("0025", perimeter=33))
    plain = tune_on_path(table, run.points, run.path)
    forward = tune_on_path(table, run.points, run.path, feed_forward=True)
    put("gains", gains(x, sf.runs.tune(x), old, calm, plain))
    put("margins", by_margins(table))
    put("path", on_path(plain, forward))
    tuned = [replace(axis, rule="rule path, NACA 0025") for axis in plain.axes.values()]
    bode_figure(tuned[0], table.name).save(HERE / "tune-bode.svg")
    step_figure(tuned, table.name).save(HERE / "tune-step.svg")


def gains(x: ServoAxis, shaped: Tuning, old: Tuning, calm: Tuning, path: PathTuning) -> str:
    """Gains and margins of X: the paper's, those of three rules, and those of rule path."""
    named = (
        ("the paper's", x),
        ("margins", shaped.axis),
        ("Ziegler-Nichols", old.axis),
        ("Tyreus-Luyben", calm.axis),
        ("path: NACA 0025", path.axes["x"].axis),
    )
    head = ("gains of X", "kp", "ki", "kd", "gain margin", "phase margin", "delay margin", "bandwidth")
    return rows(head, *((name, *gains_of(axis), *margins_of(margins(axis, PERIOD))) for name, axis in named))


def by_margins(table: sf.Machine) -> str:
    """What rule margins makes of each axis: margins, following error and overshoot before and after."""
    lines = [("axis", "gains", "phase margin", "gain margin", "following error", "step overshoot")]
    for name in table.axes:
        found = sf.runs.tune(table.servo_axis(name)).numbers()
        unit, factor = ("deg", 180.0 / math.pi) if found["rest_swing_unit"] == "rad" else ("µm", 1e3)
        for when, ending in (("old", "_before"), ("new", "")):
            margins = found[f"margins{ending}"]
            lines.append(
                (
                    name, when, f"{margins['phase_margin']:.1f}°", f"{margins['gain_margin_db']:.1f} dB",
                    f"{factor * found[f'following_error{ending}']:.3g} {unit}", f"{found[f'overshoot{ending}']:.0%}",
                )
            )  # fmt: skip
    return rows(*lines, left=2)


def gains_of(axis: ServoAxis) -> tuple[str, ...]:
    """The three gains as a table has them."""
    control = axis.controller
    return f"{control.kp:.2f}", f"{control.ki:.0f}", f"{control.kd:.4f}"


def margins_of(found: Margins) -> tuple[str, ...]:
    """Margins of a stable loop as a table has them."""
    assert found.stable
    return (
        f"{found.gain_margin_db:.1f} dB at {found.gain_frequency:.0f} Hz",
        f"{found.phase_margin:.1f}° at {found.phase_frequency:.1f} Hz",
        f"{1e3 * found.delay_margin:.2f} ms",
        f"{found.bandwidth:.0f} Hz",
    )


def stable(old: Tuning) -> str:
    """What Ziegler and Nichols' gains do: close to unstable, and an axis that never rests."""
    swing = rest_swing(old.axis, PERIOD)
    assert old.margins.close
    assert hunts(old.axis, swing)
    gain, phase = old.margins.gain_margin, old.margins.phase_margin
    return words(
        f"""Ziegler and Nichols' gains are close to unstable here, by a gain margin of {gain:.3g} and a phase margin of
        {phase:.3g}°: the rule dates from 1942 and was made for processes, not for machines that cut corners. Hunting
        on the full model is reported too: with their `ki` of {old.controller.ki:.0f}, X hunts by
        {1e3 * swing:.0f} µm, because the integral pushes against static friction."""
    )


def drives(x: ServoAxis) -> str:
    """Whether the paper's gains are stable, by the lag of the drive, with and without a period of delay."""
    lines = [("lag of the drive", "no computing delay", "one period of delay")]
    for lag in LAGS:
        name = f"{1e3 * lag:g} ms" + (" (`xytheta`)" if lag == x.drive.lag else "")
        lines.append((name, *(short(with_drive(x, lag, delay)) for delay in (0, 1))))
    return rows(*lines, left=3)


def with_drive(x: ServoAxis, lag: float, delay: int) -> Margins:
    """The margins with that lag, s, and that delay, periods."""
    return margins(replace(x, drive=replace(x.drive, lag=lag), controller=replace(x.controller, delay=delay)), PERIOD)


def short(found: Margins) -> str:
    """A verdict for a cell."""
    return found.verdict.replace(" deg", "°").split(": a closed-loop")[0] + (
        f"; stable only below {found.stable_below:.3f} of these gains" if found.stable_below is not None else ""
    )


def on_path(plain: PathTuning, forward: PathTuning) -> str:
    """What rule path makes of the contour error, with and without feed-forward."""
    assert plain.before is not None
    before, after, least = (1e3 * each.max for each in (plain.before, plain.contour, forward.contour))
    ki = forward.axes["x"].axis.controller.ki
    return words(
        f"""On the paper's airfoil the largest contour error falls from {before:.1f} to {after:.1f} µm. With
        `--feed-forward`, which adds volts for the speed and acceleration of the reference and costs no margin, it falls
        to {least:.1f} µm, with a `ki` of {ki:.0f} on X."""
    )


if __name__ == "__main__":
    main()
