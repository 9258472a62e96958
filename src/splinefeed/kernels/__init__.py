"""What is recursive from tick to tick: functions of floats and contiguous float64 arrays, no classes, no files.

`jit` decides whether Python runs them or Numba compiles them. `layout` is a row of a table of pieces, `pieces` its
arithmetic, `mechanics` an axis of a machine, `override` the rate of a law, `matching` two lines side by side.
"""
