"""From a path and limits to a time law sigma(t): how far along the path at each time.

In come a path and Limits; out comes a TimeLaw. `planning` chooses the strategy: `seven_phase` (by `profiles`) where
the limits are along the path alone, else `strategies`, the two modes of one planner. That one takes a
`paths.track.Track`, makes cells (`grid`), `coordinates` and the `rows` of their limits under `conditions`, those of
limits along the path by `path_rows`, and solves for q = feed^2, a `spline` (`solve`); `horizon` repeats it where the
`audit` finds the motion over a limit, `receding` goes on from horizon to horizon, `stream` along paths without end,
`timed` to wanted times. `straight` is a closed form, `openings` begins at limits, `law` is the motion in time, `ticks`
slows it where setpoints are over a limit, `bound` says how far from the best it is; `shared` puts waits into a law, and
instants on ticks; `constants` are shared numbers. `override/` runs a law faster and slower. docs/math/planner.md
derives it.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
