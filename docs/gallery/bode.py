"""Are my gains stable? The loop of an axis before and after tuning for margins of 45 degrees and 6 dB."""

import splinefeed as sf

machine = sf.Machine.load("xytheta")
tuned = sf.runs.tune(machine.servo_axis("x"), "margins", period=1e-3)

figure = sf.plot.bode(tuned, machine.name)
assert tuned.margins.phase_margin >= 44.9
