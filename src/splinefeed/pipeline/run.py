"""One run: a path and limits to setpoints, and the numbers of their quality; in chunks where it is long."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.analysis.check import Check
from splinefeed.analysis.measures import AxisMotion, LimitUse, Ripple
from splinefeed.errors import InputError, LimitsError, expect
from splinefeed.feed.planning import cheap_to_bound, plan
from splinefeed.geometry.path import Path
from splinefeed.geometry.tool_path import ToolPath
from splinefeed.interpolation.interpolator import interpolate
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.kinematics import JointPath
from splinefeed.machine.machine import Machine
from splinefeed.pipeline.fold import Meter, fold, on_one_path
from splinefeed.pipeline.follow import Servo
from splinefeed.pipeline.meters import MOTION, CheckMeter, ChordMeter, RippleMeter, ServoMeter, UseMeter
from splinefeed.records import Array, Limits, Setpoints, TimeLaw, Verdict, unit_along, view

if TYPE_CHECKING:
    from splinefeed.report.figure import Figure

#: The paper's experiment: f = 60 mm/s, A = D = 50 mm/s^2, J = 2000 mm/s^3, one setpoint a millisecond.
PAPER_LIMITS = Limits(feed=60.0, acceleration=50.0, jerk=2000.0)
PAPER_PERIOD = 1e-3
PAPER_SHAPE = "naca:0025?perimeter=33"
#: A picture of a tool path shows the tool axis at so many places, so long as a share of the path's size.
TOOLS_DRAWN, TOOL_DRAWN = 41, 0.2
#: A picture shows so many places of the path over its size, and at least and at most so many of it all.
CELLS, POINTS_DRAWN = 600, (1000, 40_000)
#: Most ticks of a motion that is kept in memory, above an hour at 1 ms, and of one that is made in chunks, above ten
#: days.
MOST_TICKS, MOST_IN_CHUNKS = 4_000_000, 1_000_000_000
#: Of motions of at most so many ticks every tick is kept. Of a longer one: stretches of time of which the least and the
#: greatest of every quantity are kept, and most ticks of one stretch and of one chunk.
LONG, COLUMNS, CHUNK = 1_000_000, 1200, 16_384
#: Makes the setpoints again, in chunks of so many ticks, each time that it is called.
Chunks = Callable[[int], Iterator[Setpoints]]
#: Is called with what is being done, how many ticks are done, and of how many.
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Run:
    """The result of one run; `numbers()` is what `--json` prints.

    ticks   number of setpoints; kept  all of them, or of a long motion those that figures need, every peak among them
    motion, use, ripple  at the ticks that are kept; use and ripple count over all of them
    chunks  makes all setpoints again
    joints  the path on a machine, of which `path` is that of the tool tip; None where the axes are the path's own
    served  what a machine did that followed the setpoints, or None
    remarks  what was left out of the run, one sentence each
    Lengths in mm, times in s, arrays (n,) or (n, axes) of n ticks. Source: docs/code-overview.md.
    Example: `sf.run(path, limits).numbers()["duration_s"]`
    """

    path: Path
    limits: Limits
    law: TimeLaw
    ticks: int
    kept: Setpoints
    ripple: Ripple
    motion: AxisMotion
    use: LimitUse
    verdict: Verdict
    chord_error_mm: float
    chunks: Callable[[], Iterator[Setpoints]]
    joints: JointPath | None = None
    served: Servo | None = None
    remarks: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether every tick is kept."""
        return len(self.kept) == self.ticks

    @property
    def stretch(self) -> float:
        """Time, s, of which the kept ticks show the least and the greatest of each quantity; 0: all are kept."""
        return 0.0 if self.whole else column_of(self.ticks) * self.kept.period

    @property
    def points(self) -> Setpoints:
        """All setpoints; LimitsError for a long motion, of which `setpoints()` gives them in chunks."""
        if not self.whole:
            raise LimitsError(
                f"a motion of {self.ticks} ticks is not kept in memory; use setpoints(), which gives chunks"
            )
        return self.kept

    @property
    def name(self) -> str:
        """Name of the path."""
        return self.path.name

    @property
    def settings(self) -> dict[str, Any]:
        """How the setpoints are made."""
        return dict(self.kept.settings)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes that have setpoints."""
        return self.kept.axes

    @property
    def linear(self) -> int:
        """How many of them are linear, the first ones."""
        return self.path.linear if self.joints is None else self.joints.linear

    @property
    def place(self) -> Array:
        """Where the tool tip is at the ticks that are kept, (n, d), mm; d linear axes, at most three."""
        if self.joints is not None:
            return self.path.evaluate(self.kept.curve, self.kept.u, 0)[:, 0]
        return self.kept.position[:, : min(self.path.linear, 3)]

    @property
    def thread(self) -> Array:
        """Where the path runs, for a picture, (m, d), mm, a row of NaN where it is broken; d linear axes, at most 3."""
        path = self.path
        s = np.linspace(0.0, path.length, int(np.clip(CELLS * path.length / max(path.size, 1e-9), *POINTS_DRAWN)))
        starts = path.curve_starts
        line = path(s if len(starts) > len(s) else np.union1d(s, starts))[:, : min(path.linear, 3)]
        return line if self.joints is None else np.concatenate([line, _tools(self.joints)])

    def setpoints(self) -> Setpoints | Iterator[Setpoints]:
        """All setpoints, whole or in chunks."""
        settings = self.kept.settings
        return self.kept if self.whole else (replace(chunk, settings=settings) for chunk in self.chunks())

    @property
    def end_error_mm(self) -> float:
        """Distance of the last setpoint from the end of the path, mm, as the check found it."""
        return float(self.verdict.numbers["end_error_mm"])

    @property
    def ok(self) -> bool:
        """Whether the check found every limit kept and the path covered to its end."""
        return self.verdict.ok

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
        from splinefeed.report import folder as report_folder

        return report_folder.report(self, folder, formats=formats)

    def __repr__(self) -> str:
        return f"Run({self.path!r}, {self.law!r}, {self.ticks} setpoints, ok={self.ok})"

    def _repr_html_(self) -> str:
        verdict = "every limit holds" if self.ok else "; ".join(self.verdict.problems)
        rows = {
            "path": f"{self.path.name}, {self.path.tip_end:.6g} {unit_along(self.path.axes)}",
            "motion": f"{self.law.duration:.6g} s, {self.law.strategy}",
            "setpoints": f"{self.ticks}, one every {self.kept.period:g} s",
            "check": verdict,
        }
        return view.table(rows, self.plot()._repr_svg_())

    def numbers(self) -> dict[str, Any]:
        """Durations in s, lengths in mm, limits with their worst value, share and place; rotary axes in degrees."""
        law, setpoints = self.law, self.kept
        return {
            "ok": self.ok,
            "duration_s": law.duration,
            "lower_bound_s": law.settings.get("lower_bound_s"),
            "length_mm": self.path.tip_end,
            "ticks": self.ticks,
            "period_s": setpoints.period,
            "method": setpoints.method,
            "strategy": law.strategy,
            "ripple_max": self.ripple.max,
            "ripple_rms": self.ripple.rms,
            "ripple_floor": self.ripple.floor,
            "end_error_mm": self.end_error_mm,
            "end_reached": self.verdict.numbers["end_reached"],
            "feed_max_mm_s": float(setpoints.feed.max()),
            "chord_error_max_mm": self.chord_error_mm,
            "limits": self.verdict.as_dict()["limits"],
            "problems": list(self.verdict.problems),
            "bound_by": self.use.time_bound_by(),
            "axes": self.axis_peaks(),
            "notes": list(dict.fromkeys([*self.path.findings, *law.notes, *self.verdict.notes, *self.remarks])),
        }

    def axis_peaks(self) -> dict[str, dict[str, float | str]]:
        """Largest |velocity|, |acceleration| and |jerk| of each axis, in mm or degrees, with the unit.

        For linear axes their shares of the path's own acceleration and jerk, too, which they need not keep.
        """
        own = self.own_limits()
        peaks: dict[str, dict[str, float | str]] = {}
        for i, axis in enumerate(self.axes):
            rotary = i >= self.linear
            factor = 180.0 / np.pi if rotary else 1.0
            each = {name: factor * float(np.max(np.abs(getattr(self.motion, name)[:, i]))) for name in MOTION}
            shares = {} if rotary else {f"{name}_share": each[name] / limit for name, limit in own.items()}
            peaks[axis] = {"unit": "deg" if rotary else "mm", **each, **shares}
        return peaks

    def own_limits(self) -> dict[str, float]:
        """Acceleration and jerk that the path was planned with, the larger of speeding up and down; none left out."""
        limits = self.limits.as_dict()
        both = (("acceleration", "deceleration"), ("jerk", "deceleration_jerk"))
        return {name: max(limits[name], limits[other]) for name, other in both if {name, other} <= limits.keys()}


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
    meters: Sequence[Meter] = (),
    on_progress: Progress | None = None,
) -> Run:
    """Plan, interpolate and measure one path; defaults are the paper's limits and period.

    machine  a Machine or its name: of a ToolPath its joints follow the path, of another path its axes follow the
             setpoints, simulated; law  if it is planned already
    meters   further ones of the chunks, such as writers of files (`splinefeed.pipeline.fold`)

    Setpoints are made and measured in chunks, once. Of more than a million ticks those that figures need are kept, and
    `setpoints()` of the run makes all of them again.
    Raises what `plan`, `interpolate` and `follow` raise, InputError for a machine that cannot follow a tool path, and
    LimitsError for more than MOST_IN_CHUNKS ticks.

    period in s; setpoints (n, axes), mm, rotary axes rad. Source: docs/code-overview.md walks through it.
    Example: `sf.run(path, sf.Limits(feed=60, axis_jerk=20000)).plot()`
    """
    expect("run(path, limits)", (path, (Path, JointPath)), (limits, Limits))
    model = Machine.load(machine) if isinstance(machine, str) else machine
    if isinstance(path, ToolPath):
        path, model = on_machine(path, model, limits), None
    if isinstance(path, JointPath) and model is not None:
        raise InputError("machine: the path is already in the joints of a machine; leave it out")
    remarks: tuple[str, ...] = ()
    if isinstance(path, Path) and model is not None and model.axes and not model.simulates(path.axes):
        check_axes(path, model)
        remarks = (f"axes of {model.name} have limits alone: what their servo loops do is not simulated",)
        model = None
    limits = limits.on(path.axes)
    bound = cheap_to_bound(path, limits)
    law = plan(path, limits, strategy=strategy, period=period, bound=bound) if law is None else law
    ticks = check_ticks(law, period, MOST_IN_CHUNKS)

    def chunks(chunk: int) -> Iterator[Setpoints]:
        return interpolate(
            path, law, chunk=chunk, period=period, method=method, corrections=corrections, tolerance=tolerance
        )

    made = measured(path, limits, law, chunks, ticks, machine=model, meters=meters, on_progress=on_progress)
    return replace(made, remarks=remarks)


def check_axes(path: Path, machine: Machine) -> None:
    """InputError for a path that moves an axis which the machine does not have."""
    for k, axis in enumerate(path.axes):
        if axis not in machine.axes and np.ptp(path.flat.points[:, k]) != 0.0:
            raise InputError(
                f"{path.name}: moves axis {axis}, which {machine.name} does not have; its axes are "
                f"{', '.join(machine.axes)}: add [axis.{axis}.limits]"
            )


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
    model = machine if isinstance(machine, Machine) else Machine.load(machine)
    if model.kinematics is None:
        line = "" if path.lines is None else f" (line {path.lines[0]})"
        raise InputError(
            f"{model.name}: has no [kinematics], which a tool path needs{line}; add them to the machine file, or take "
            "a machine that has them (trunnion)"
        )
    return JointPath(path, model.kinematics, travel=limits.travel_of(model.kinematics.joints))


def planned_axes(path: Path, machine: Machine | None) -> tuple[str, ...]:
    """The axes that limits are for: those of a path, joints of the machine for a path with a tool axis."""
    if isinstance(path, ToolPath) and machine is not None and machine.kinematics is not None:
        return machine.kinematics.joints
    return path.axes


def measured(
    path: Path | JointPath,
    limits: Limits,
    law: TimeLaw,
    chunks: Chunks,
    ticks: int,
    *,
    machine: Machine | None = None,
    meters: Sequence[Meter] = (),
    on_progress: Progress | None = None,
) -> Run:
    """Setpoints that can be made, or read, again, at most `ticks` of them, measured and checked as a run in one pass.

    meters  further ones, which see every chunk, too
    """
    joints = path if isinstance(path, JointPath) else None
    tip, column = path.tip_path, column_of(ticks)
    again = partial(chunks, max(CHUNK // column, 1) * column)
    check = Check(limits, law=law)
    check.part(path)
    use, ripple, chord = UseMeter(limits, column), RippleMeter(column, _top_feed(law, ticks)), ChordMeter()
    checked, servo = CheckMeter(check), None if machine is None else ServoMeter(machine, column)
    all_meters: list[Meter] = [use, ripple, chord, checked, *([] if servo is None else [servo]), *meters]
    count = fold(on_one_path(_with_progress(again(), on_progress, ticks), path, law), all_meters)
    verdict = checked.verdict
    return Run(
        path=tip,
        limits=limits,
        law=law,
        ticks=count,
        kept=use.kept,
        ripple=ripple.ripple,
        motion=use.motion,
        use=use.use,
        verdict=verdict,
        chord_error_mm=chord.largest if joints is None else float(verdict.numbers["chord_error_max_mm"]),
        chunks=again,
        joints=joints,
        served=None if servo is None else servo.servo,
    )


def _with_progress(chunks: Iterator[Setpoints], say: Progress | None, ticks: int) -> Iterator[Setpoints]:
    done = 0
    for chunk in chunks:
        done += len(chunk)
        if say is not None:
            say("measuring", done, ticks)
        yield chunk


def column_of(ticks: int) -> int:
    """Ticks in one column of a motion of so many: one where all are kept."""
    return 1 if ticks <= LONG else min(-(-ticks // COLUMNS), CHUNK)


def _top_feed(law: TimeLaw, ticks: int) -> float:
    """The highest feed of the law at its ticks, mm/s."""
    step = law.duration / max(ticks - 1, 1)
    starts = range(0, ticks, CHUNK)
    return max(float(np.max(law.feed(np.arange(k, min(k + CHUNK, ticks)) * step))) for k in starts)


def _tools(joints: JointPath) -> Array:
    """Lines along the tool axis, for a picture, (m, 3), mm, each behind a row of NaN; evenly along the path."""
    s = np.linspace(0.0, joints.length, TOOLS_DRAWN)
    tip, axis = joints.kinematics.forward(joints(s))
    far = tip + TOOL_DRAWN * max(joints.tool.size, 1e-9) * axis[:, -3:]  # of an arm the last of three columns
    return np.stack([np.full_like(tip, np.nan), tip, far], axis=1).reshape(-1, 3)


def check_ticks(law: TimeLaw, period: float, most: int = MOST_TICKS) -> int:
    """Ticks of `period` s in a motion at the most; LimitsError if they are more than `most`."""
    ticks = law.duration / period
    if ticks > most:
        raise LimitsError(
            f"the motion takes {law.duration:.6g} s, {ticks:.3g} periods of {period:g} s; at most {most} are possible: "
            f"raise the period or the feed"
        )
    return math.ceil(ticks) + 1
