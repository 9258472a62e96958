"""Programs of machine tools: G-code to paths and back, and how long a control takes for one."""

from .cycle_time import CycleTime as CycleTime
