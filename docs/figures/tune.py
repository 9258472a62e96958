"""Draw docs/figures/tune-bode.svg and tune-step.svg, and print the numbers of docs/tune.md."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import splinefeed as sf
from splinefeed.pipeline.tuning import tune_on_path
from splinefeed.report.bode import bode_figure, step_figure
from splinefeed.report.files import save_figure
from splinefeed.simulation.curves import tuned_axis
from splinefeed.simulation.linear import margins

PERIOD = 1e-3


def main() -> None:
    """Tune the paper's table by every rule and on the paper's path, and draw X before and after."""
    table = sf.Table.load("xytheta")
    for rule in ("ziegler-nichols", "tyreus-luyben"):
        print(sf.tune(table.axes["x"], rule).describe())
    for how in ("sine", "relay"):
        point = sf.tune(table.axes["x"], experiment=how).ultimate
        print(f"{how}: K_u {point.gain:.4g} V/mm, P_u {1e3 * point.period:.4g} ms")
    for lag in (1e-3, 3e-3, 5e-3, 10e-3, 20e-3):
        x = table.axes["x"]
        for delay in (0, 1):
            other = replace(x, drive=replace(x.drive, lag=lag), controller=replace(x.controller, delay=delay))
            print(f"X, lag {1e3 * lag:g} ms, delay {delay}: {margins(other, PERIOD).verdict}")
    run = sf.run(sf.shapes.naca("0025", perimeter=33))
    plain = tune_on_path(table, run.points, run.path)
    print(plain.describe())
    print(tune_on_path(table, run.points, run.path, feed_forward=True).describe())
    tuned = [tuned_axis(a.old, a.axis, "rule path, NACA 0025", PERIOD) for a in plain.axes.values()]
    folder = Path(__file__).parent
    save_figure(bode_figure(tuned[0], table.name), folder / "tune-bode.svg")
    save_figure(step_figure(tuned, table.name), folder / "tune-step.svg")


if __name__ == "__main__":
    main()
