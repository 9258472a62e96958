"""One run: a path and limits to setpoints, and the numbers that say how good they are."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.analysis.binding import LimitUse, limit_use
from splinefeed.analysis.check import check
from splinefeed.analysis.motion import AxisMotion, Share, axis_motion
from splinefeed.analysis.ripple import Ripple, chord_errors, feed_ripple
from splinefeed.analysis.thinning import Thread
from splinefeed.errors import InputError, LimitsError, expect
from splinefeed.feed.planning import plan
from splinefeed.geometry.path import Path
from splinefeed.geometry.tool_path import ToolPath
from splinefeed.interpolation.interpolator import interpolate
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.kinematics import JointPath
from splinefeed.machine.table import Machine
from splinefeed.records import Array, Limits, Setpoints, TimeLaw, Verdict, unit_along, view

if TYPE_CHECKING:
    from splinefeed.report.figure import Figure

#: The paper's experiment: f = 60 mm/s, A = D = 50 mm/s^2, J = 2000 mm/s^3, one setpoint a millisecond.
PAPER_LIMITS = Limits(feed=60.0, acceleration=50.0, jerk=2000.0)
PAPER_PERIOD = 1e-3
PAPER_SHAPE = "naca:0025?perimeter=33"
#: The last setpoint is the end of the path within this, relative to the path's size: rounding.
END_TOLERANCE = 1e-9
#: A picture of a tool path shows the tool axis at so many places, so long as a share of the path's size.
TOOLS_DRAWN, TOOL_DRAWN = 41, 0.2
#: Most ticks of a run that is kept in memory, above an hour at 1 ms; `long_run.run_long` knows no such bound.
MOST_TICKS = 4_000_000


@dataclass(frozen=True, eq=False)
class Run:
    """Everything that one run made; `numbers()` is what `--json` prints.

    joints  the path on a machine, of which `path` is that of the tool tip; None where the axes are the path's own
    Lengths in mm, times in s, arrays (n,) or (n, axes) of n ticks. Source: docs/code-overview.md.
    Example: `sf.run(path, limits).numbers()["duration_s"]`
    """

    path: Path
    limits: Limits
    law: TimeLaw
    points: Setpoints
    ripple: Ripple
    motion: AxisMotion
    verdict: Verdict
    chord_error_mm: float
    joints: JointPath | None = field(default=None, kw_only=True)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes that have setpoints."""
        return self.points.axes

    @property
    def linear(self) -> int:
        """How many of them are linear, the first ones."""
        return self.path.linear if self.joints is None else self.joints.linear

    @cached_property
    def place(self) -> Array:
        """Where the tool tip is at the setpoints, (n, d), mm; d linear axes, at most three."""
        if self.joints is not None:
            return self.path.evaluate(self.points.curve, self.points.u, 0)[:, 0]
        return self.points.position[:, : min(self.path.linear, 3)]

    @cached_property
    def use(self) -> LimitUse:
        """How much of each limit is used at each tick, and which one binds."""
        return limit_use(self.motion, self.points, self.joints or self.path, self.law, self.limits)

    @property
    def ticks(self) -> int:
        """Number of setpoints."""
        return len(self.points)

    @cached_property
    def thread(self) -> Array:
        """Where the path runs, for a picture, (m, d), a row of NaN where it is broken; d linear axes, at most three."""
        place = self.place
        if not len(place) or not place.shape[1]:
            return np.zeros((0, place.shape[1]))
        thread = Thread(place.min(axis=0), place.max(axis=0))
        thread.see(place)
        return thread.line if self.joints is None else np.concatenate([thread.line, self._tools(self.joints)])

    def _tools(self, joints: JointPath) -> Array:
        """Lines along the tool axis, for a picture, (m, 3), mm, each behind a row of NaN; evenly along the path."""
        s = np.linspace(0.0, self.path.length, TOOLS_DRAWN)
        tip, axis = joints.kinematics.forward(joints(s))
        far = tip + TOOL_DRAWN * max(self.path.size, 1e-9) * axis
        return np.stack([np.full_like(tip, np.nan), tip, far], axis=1).reshape(-1, 3)

    def setpoints(self) -> Setpoints | Iterator[Setpoints]:
        """All setpoints, whole or in chunks."""
        return self.points

    @property
    def end_error_mm(self) -> float:
        """Distance of the last setpoint from the end of the path over the linear axes, mm."""
        if self.joints is not None:
            return float(self.verdict.numbers["end_error_mm"])
        linear = self.path.linear
        end = self.path.curves[-1](self.path.curves[-1].domain[1])
        return float(np.linalg.norm((self.points.position[-1] - end)[:linear]))

    @property
    def ok(self) -> bool:
        """Whether the check found every limit kept and the path covered to its end."""
        return self.verdict.ok and self.end_reached

    @property
    def end_reached(self) -> bool:
        """Whether the last setpoint is the end of the path, but for rounding."""
        return self.end_error_mm <= END_TOLERANCE * max(self.path.size, 1.0)

    def plot(self) -> Figure:
        """The path coloured by feed with feed and jerk below, as `sf.plot.overview` draws it."""
        from splinefeed.report import plot

        return plot.overview(self)

    def report(self, folder: str | os.PathLike[str], *, formats: Iterable[str] = ("hdf5",)) -> list[str]:
        """Write what `splinefeed run` writes, and give the names of the files: setpoints, law, figures, report.html.

        folder   made if it is not there; files of an earlier run in it are replaced, all at once or not at all
        formats  of the setpoints, names of `splinefeed.formats.setpoints.FORMATS`
        Raises FormatError for a folder that cannot be written or holds such files that are not ours, InputError for an
        unknown format. Example: `sf.run(sf.shapes.butterfly()).report("butterfly")`
        """
        from splinefeed.report import files

        return files.report(self, folder, formats=formats)

    def _repr_html_(self) -> str:
        """A notebook's view of the run: its main numbers, and the picture."""
        verdict = "every limit holds" if self.ok else "; ".join(self.verdict.problems)
        rows = {
            "path": f"{self.path.name}, {self.path.length:.6g} {unit_along(self.path.axes)}",
            "motion": f"{self.law.duration:.6g} s, {self.law.strategy}",
            "setpoints": f"{self.ticks}, one every {self.points.period:g} s",
            "check": verdict,
        }
        return view.table(rows, self.plot()._repr_svg_())

    def numbers(self) -> dict[str, Any]:
        """Durations in s, lengths in mm, limits with their worst value, share and place; rotary axes in degrees."""
        law, points = self.law, self.points
        return {
            "ok": self.ok,
            "duration_s": law.duration,
            "lower_bound_s": law.settings.get("lower_bound_s"),
            "length_mm": self.path.length,
            "ticks": self.ticks,
            "period_s": points.period,
            "method": points.method,
            "strategy": law.strategy,
            "ripple_max": self.ripple.max,
            "ripple_rms": self.ripple.rms,
            "ripple_floor": self.ripple.floor,
            "end_error_mm": self.end_error_mm,
            "end_reached": self.end_reached,
            "feed_max_mm_s": float(points.feed.max()),
            "chord_error_max_mm": self.chord_error_mm,
            "limits": self.verdict.as_dict()["limits"],
            "problems": list(self.verdict.problems),
            "bound_by": self.use.time_bound_by(),
            "axes": self.axis_peaks(),
            "notes": [*self.path.findings, *law.notes, *self.verdict.notes],
        }

    def axis_peaks(self) -> dict[str, dict[str, float | str]]:
        """Largest |velocity|, |acceleration| and |jerk| of each axis, in mm or degrees, with the unit.

        For linear axes their shares of the path's own acceleration and jerk besides, which nothing holds them to.
        """
        peaks: dict[str, dict[str, float | str]] = {}
        for i, axis in enumerate(self.axes):
            rotary = i >= self.linear
            factor = 180.0 / np.pi if rotary else 1.0
            motion = self.motion
            peaks[axis] = {
                "unit": "deg" if rotary else "mm",
                "velocity": factor * float(np.max(np.abs(motion.velocity[:, i]))),
                "acceleration": factor * float(np.max(np.abs(motion.acceleration[:, i]))),
                "jerk": factor * float(np.max(np.abs(motion.jerk[:, i]))),
            }
            if not rotary:
                for name, own in self.own_limits().items():
                    peaks[axis][f"{name}_share"] = float(peaks[axis][name]) / own
        return peaks

    def own_limits(self) -> dict[str, float]:
        """Acceleration and jerk that the path was planned with, the larger of speeding up and down; none left out."""
        limits = self.limits.as_dict()
        both = {"acceleration": ("acceleration", "deceleration"), "jerk": ("jerk", "deceleration_jerk")}
        values = {name: [limits[each] for each in pair if each in limits] for name, pair in both.items()}
        return {name: max(given) for name, given in values.items() if len(given) == 2}


def run(
    path: Path | JointPath,
    limits: Limits = PAPER_LIMITS,
    *,
    machine: str | Machine | None = None,
    period: float = PAPER_PERIOD,
    strategy: str | None = None,
    method: str = DEFAULT_METHOD,
    corrections: int = 1,
    tolerance: float = 0.0,
    law: TimeLaw | None = None,
) -> Run:
    """Plan, interpolate and measure one path; defaults are the paper's limits and period.

    machine  of a ToolPath: the one whose joints follow it, a Machine or its name; law  if it is planned already
    Raises what `plan` and `interpolate` raise, InputError for a machine that cannot follow a tool path, and LimitsError
    for more than MOST_TICKS ticks.
    period in s; setpoints (n, axes), mm, rotary axes rad. Source: docs/code-overview.md walks through it.
    Example: `sf.run(path, sf.Limits(feed=60, axis_jerk=20000)).plot()`
    """
    expect("run(path, limits)", (path, (Path, JointPath)), (limits, Limits))
    path = on_machine(path, machine, limits)
    limits = limits.for_axes(path.axes)
    law = plan(path, limits, strategy=strategy, period=period) if law is None else law
    check_ticks(law, period)
    points = interpolate(path, law, period=period, method=method, corrections=corrections, tolerance=tolerance)
    return measured(path, limits, law, points)


def on_machine(path: Path | JointPath, machine: str | Machine | None, limits: Limits) -> Path | JointPath:
    """A tool path as joints of a machine; any other path as it is.

    Raises InputError for a tool path without a machine, a machine without kinematics, and a machine for another path.
    """
    if not isinstance(path, ToolPath):
        if machine is not None:
            raise InputError("machine: only a ToolPath is planned in the joints of a machine; leave it out")
        return path
    if machine is None:
        raise InputError(
            f"{path.name}: has a tool axis, which only a machine can follow; give a machine with kinematics (--machine)"
        )
    table = machine if isinstance(machine, Machine) else Machine.load(machine)
    if table.kinematics is None:
        line = "" if path.lines is None else f" (line {path.lines[0]})"
        raise InputError(
            f"{table.name}: has no [kinematics], which a tool path needs{line}; add them to the machine file, or take "
            "a machine that has them (trunnion)"
        )
    return JointPath(path, table.kinematics, travel=limits.travel_of(table.kinematics.joints))


def planned_axes(path: Path, machine: Machine | None) -> tuple[str, ...]:
    """The axes that limits are for: those of a path, joints of the machine for a path with a tool axis."""
    if isinstance(path, ToolPath) and machine is not None and machine.kinematics is not None:
        return machine.kinematics.joints
    return path.axes


def measured(path: Path | JointPath, limits: Limits, law: TimeLaw, points: Setpoints) -> Run:
    """Setpoints that are there already, measured and checked as those of a run."""
    if isinstance(path, JointPath):
        verdict = check(points, path, limits, law=law)
        return Run(
            path=path.tool,
            limits=limits,
            law=law,
            points=points,
            ripple=feed_ripple(points, path.tool, law),
            motion=axis_motion(points, path, law),
            verdict=verdict,
            chord_error_mm=float(verdict.numbers["chord_error_max_mm"]),
            joints=path,
        )
    return Run(
        path=path,
        limits=limits,
        law=law,
        points=points,
        ripple=feed_ripple(points, path, law),
        motion=axis_motion(points, path, law),
        verdict=check(points, path, limits, law=law),
        chord_error_mm=float(np.max(chord_errors(points, path), initial=0.0)),
    )


def share_numbers(shares: Mapping[str, Share]) -> dict[str, dict[str, float | bool]]:
    """Limit, worst value, share and place (`at_s`, mm) of each, and whether it holds (`ok`)."""
    return {
        name: {"limit": s.limit, "worst": s.worst, "share": s.share, "at_s": s.at_s, "ok": s.kept}
        for name, s in shares.items()
    }


def check_ticks(law: TimeLaw, period: float) -> None:
    """Raise LimitsError if the motion has more ticks of `period` s than are kept in memory."""
    ticks = law.duration / period
    if ticks > MOST_TICKS:
        raise LimitsError(
            f"the motion takes {law.duration:.6g} s, {ticks:.3g} periods of {period:g} s; at most {MOST_TICKS} are "
            f"kept in memory: raise the period or the feed, or take pipeline.long_run.run_long, which keeps chunks"
        )
