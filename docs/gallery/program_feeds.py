"""Where does my program reach its feeds? Each move in the feed that is programmed, rapid moves dashed."""

from pathlib import Path

import splinefeed as sf

Path("pocket.nc").write_text(
    "G21 G90 G17\nG0 X0 Y0 Z5\nG1 Z-2 F300\n"
    + "".join(f"G1 X{40 - k} F{900 + 100 * (k % 4)}\nY{30 - k}\nX{k}\nY{k + 1}\n" for k in range(0, 14, 2))
    + "G0 Z5\nG0 X60 Y0\nG1 Z-2 F300\nG2 X60 Y0 I0 J12 F1200\nG0 Z5\nM30\n"
)
run = sf.run(sf.read("pocket.nc"), sf.Limits(feed=60, axis_acceleration=1000, axis_jerk=50000))

figure = sf.plot.program(run)
assert run.path.lines is not None
assert int(run.path.lines[-1]) == 36
