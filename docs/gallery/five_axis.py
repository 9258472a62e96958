"""What do the joints of a five-axis machine do? A tool that leans as it follows a line, on a trunnion."""

import splinefeed as sf

tip = sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0, 0.0, 0.0], [60.0, 0.0, 0.0]])
axis = sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0, 0.1, 1.0], [0.3, 0.2, 1.0]])
path = sf.ToolPath(tip, axis, kind="vectors")
limits = sf.Limits(
    feed=40,
    axis_velocity={"x": 200, "y": 200, "z": 200, "a": 1.0, "c": 2.0},
    axis_acceleration={"x": 1000, "y": 1000, "z": 1000, "a": 10, "c": 20},
)
run = sf.run(path, limits, machine="trunnion")

figure = sf.plot.joints(run)
assert run.axes == ("x", "y", "z", "a", "c")
