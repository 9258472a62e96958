"""How long does my program take? Seconds by kind of time along its lines, as a control runs it."""

from pathlib import Path

import splinefeed as sf
from splinefeed.reports.time_figures import time_figure

Path("part.nc").write_text(
    "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F200\n"
    + "".join(f"G1 X{60 * (k % 2)} F1200\nY{k}\n" for k in range(1, 21))
    + "G0 Z5\nT2 M6\nG0 X30 Y30\nG1 Z-5 F100\nG4 P1\nG0 Z5\nM30\n"
)
time = sf.cycle_time("part.nc", "hurco-04")

figure = time_figure(time)
assert [each["tool"] for each in time.tools] == ["", "T1", "T2"]
