"""Does the feed arrive at the axes? Each step of the setpoints against the planned one."""

import splinefeed as sf

run = sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000))

figure = sf.plot.ripple(run)
assert run.ripple.max < 10.0 * run.ripple.floor
