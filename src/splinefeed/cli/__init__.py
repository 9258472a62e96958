"""The command line: one file a command, none of which computes anything.

`main` has the names of commands and imports one file: `about` (machine, methods, version), `check`, `convert`,
`cycle_time` (time, calibrate), `follow`, `info`, `linuxcnc`, `machine_from`, `plan`, `pulses`, `report`, `run`,
`stream`, `studio`, `sweep`, `tune`. `options` are shared, `source` and `setpoints_file` read what a user names,
`answers` and `output` print, `summary` says it in words, `progress` says how far it is, `failures` makes one line of
an error.
"""
