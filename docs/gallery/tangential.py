"""How does a knife turn? A third axis follows the tangent of an ellipse."""

import splinefeed as sf

path = sf.paths.tangential(sf.shapes.ellipse(a=30, b=15))
limits = sf.Limits(
    feed=60,
    axis_acceleration={"x": 500, "y": 500, "theta": 20},
    axis_jerk={"x": 20000, "y": 20000, "theta": 800},
)
run = sf.run(path, limits)

figure = sf.plot.joints(run)
assert run.axes[-1] == "theta"
