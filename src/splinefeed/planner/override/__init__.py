"""Feedrate override, feed hold, resume and reverse: a law run at a rate of its own, within its limits.

`override` finds the rate of each tick; `source` and `setpoint_source` are what it runs, a law along a path or setpoints
alone; `reserve` makes the limits that a plan leaves room under. docs/math/override.md says what holds.
"""
