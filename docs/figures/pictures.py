"""Draw the pictures of README and docs: the paper's experiment, the butterfly to the limits of its axes."""

from __future__ import annotations

from pathlib import Path

import splinefeed as sf
from splinefeed.reports.path_figures import contour_figure
from splinefeed.reports.servo_figures import errors_figure
from splinefeed.runs.comparison import serve_methods

HERE = Path(__file__).parent


def main() -> None:
    """Write all pictures beside this script."""
    experiment()
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    butterfly = sf.run(sf.shapes.butterfly(), limits, strategy="time-optimal")
    sf.plot.overview(butterfly).save(HERE / "overview.svg")
    law = butterfly.law
    print(f"butterfly: {law.duration:.3f} s, lower bound {law.settings['lower_bound_s']:.3f} s")
    classic = sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, acceleration=500, jerk=20000))
    peaks = classic.axis_peaks()["x"]
    print(f"seven phases: {classic.law.duration:.3f} s, and {peaks['acceleration']:.3g} mm/s^2 on x")


def experiment() -> None:
    """The paper's experiment with theta, by its two methods and ours: errors over time, and where it left the path."""
    path = sf.paths.tangential(sf.shapes.naca("0025", perimeter=33))
    run = sf.run(path)
    served = list(serve_methods(path, run.law, sf.Machine.load("xytheta")))
    responses = {each.method: each.response for each in served}
    errors_figure(responses, "NACA 0025, 33 mm", "xytheta").save(HERE / "experiment-errors.svg")
    beside = served[-1].deviation()
    assert beside is not None
    contour_figure(beside, "NACA 0025, 33 mm", "xytheta").save(HERE / "experiment-contour.svg")


if __name__ == "__main__":
    main()
