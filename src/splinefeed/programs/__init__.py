"""Programs of machine tools: G-code to paths and back, and how long a control takes for one.

In comes a program in one of the dialects, or a machine's control; out come paths with feeds and markers, or a
CycleTime. `gcode/` reads and writes; `blocks` makes arrays of a program, `control_planning` plans them as a control
does (`firmware` and `linuxcnc_times` hold the rules of open ones, `bounds` what they share), `cycle_time` adds what is
not motion, `calibration` fits a control's numbers to recorded runs (`run_log` reads them).
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
