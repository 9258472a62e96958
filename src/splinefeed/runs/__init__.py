"""The chain as one call: read, plan, interpolate, measure; what the command line and other front ends share.

In comes a MotionJob (source, limits, machine, planning); out comes a Run. `run` carries it out; `settings` says which
limits hold and how a path is smoothed; `fold` shows each chunk of setpoints to every meter of `meters` and every
measure of `measures` (each a `measure`: `feed_ripple`, `chord_error`) once, also of a path in parts (`long_path`);
`remarks` says what of a path a user should know before; `following` gives chunks to a machine, `result` the Run.
`comparison` (methods side by side), `tuning`, `contour_feed`, `convert` and `pulses` are the other things that a user
asks for.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
