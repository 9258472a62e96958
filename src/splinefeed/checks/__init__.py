"""The verdict: setpoints and time law against path and limits, by an evaluation of its own.

In come Setpoints, a path, Limits and perhaps the TimeLaw; out comes a Verdict, each limit with its worst share and
place. Nothing of `planner`, `interpolation` or the tables of `curves` is used: `spans` evaluates SciPy's B-splines from
control points and weights. `check` is the entry; `bounds` holds the limits, `path_limits` what evaluates those along
the path, `setpoints` judges tick by tick what `differences` makes of them, `law` exact derivatives, `tool` tip and tool
axis of joints, `axes` where axes do not carry the tip; `by_tick` keeps for reports what both find at each tick; `place`
and `nearest` find where setpoints are, `between` what lies between them; `certificate` writes a verdict with hashes.
"""
