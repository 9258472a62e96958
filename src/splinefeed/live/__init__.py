"""Setpoints to a running controller: a look-ahead buffer, override, feed hold and stop; one small file a sink.

In comes a motion; out go rows of setpoints, one a period. `stream` sends what `motion` makes under override and hold
to a sink of `sinks`; `operator` takes orders from outside. `hal_files` and `hal_player` play rows in LinuxCNC's HAL
for `linuxcnc_sink`; the other files whose names begin with linuxcnc are the planner inside LinuxCNC:
`linuxcnc_serve` is its process, and `linuxcnc_planner` a step of it: what `linuxcnc_wire` brings becomes a
`linuxcnc_motion` by the limits of `linuxcnc_limits`, as `linuxcnc_moves` and `linuxcnc_pieces` say, along true curves
of `linuxcnc_curves` where the program has such, while `linuxcnc_task` watches what LinuxCNC waits for and has loaded;
`linuxcnc_joints` has joints that are no axes, `linuxcnc_refusals` says what of that will not run.
"""
