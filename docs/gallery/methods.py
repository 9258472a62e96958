"""Which interpolator rings? Feed ripple of four methods along one motion, on one scale."""

import splinefeed as sf

path = sf.shapes.naca("0025", perimeter=33)
law = sf.plan(path, sf.Limits(feed=60, acceleration=50, jerk=2000), period=1e-3)
traces = list(sf.runs.compare(path, law, methods=["taylor-2", "milne-simpson", "milne-simpson-anchored", "arc-length"]))

figure = sf.plot.compare(traces, "NACA 0025")
assert traces[1].result.ripple_max > 100.0 * traces[3].result.ripple_max
