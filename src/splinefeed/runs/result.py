"""The result of one run: a record of its setpoints, what they do, and the verdict; it draws nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from splinefeed.analysis.bands import Band
from splinefeed.analysis.measures import AxisMotion, LimitUse, Ripple, TipMotion
from splinefeed.errors import LimitsError
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Array, Limits, Setpoints, TimeLaw, Verdict, unit_along, unit_of_axis, view
from splinefeed.runs.feed_ripple import FeedRipple
from splinefeed.runs.following import Servo
from splinefeed.runs.measure import Measure
from splinefeed.runs.meters import MOTION

#: A picture of a tool path shows the tool axis at so many places.
TOOLS_DRAWN = 41
#: A picture shows so many places of the path over its size, and at least and at most so many of it all.
CELLS, POINTS_DRAWN = 600, (1000, 40_000)
#: Points of the small picture of a notebook.
SHAPE = 2000
#: Most ticks of a motion that is kept in memory, above an hour at 1 ms.
MOST_TICKS = 4_000_000


@dataclass(frozen=True, eq=False)
class Run:
    """The result of one run, what was made and measured; `numbers()` is what `--json` prints.

    Attributes
    ----------
    path : Path
        Of the tool tip; of a path that came in parts the line through the ticks that are kept.
    limits : Limits
        That it was planned and checked with.
    ticks : int
        Number of setpoints n.
    kept : Setpoints
        All of them, or of a long motion those that figures need, every peak among them.
    motion, use, tip : AxisMotion, LimitUse, TipMotion
        At the ticks that are kept; `use` counts over all of them.
    verdict : Verdict
        Of the check.
    measures : tuple of Measure
        What each of `measures` found.
    planned : TimeLaw or None
        The time law, which `law` gives; None where the path came in parts.
    chunks : callable or None
        Makes all setpoints again; None where they were made once, of a path that came in parts.
    joints : Track or None
        The path on a machine, of which `path` is that of the tool tip; None where the axes are the path's own.
    served : Servo or None
        What a machine did that followed the setpoints.
    remarks : tuple of str
        What was left out of the run, one sentence each.
    bands : mapping of str to Band
        The least and the greatest of what figures show over time where ticks are left out; see `CheckMeter`.

    Notes
    -----
    Lengths in mm, times in s, arrays (n,) or (n, axes) of n ticks.

    References
    ----------
    .. [1] docs/code-overview.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> line = sf.Path.polyline([[0, 0], [30, 0]])
    >>> run = sf.run(line, sf.Limits(feed=60, acceleration=500, jerk=20000))
    >>> run
    Run(Path('path', 1 curve(s), axes x y, 30 mm), seven-phase, 0.645 s, 646 setpoints, ok=True)
    >>> run.points.position.shape
    (646, 2)
    """

    path: Path
    limits: Limits
    ticks: int
    kept: Setpoints
    motion: AxisMotion
    use: LimitUse
    tip: TipMotion
    verdict: Verdict
    measures: tuple[Measure, ...]
    planned: TimeLaw | None = None
    chunks: Callable[[], Iterator[Setpoints]] | None = None
    joints: Track | None = None
    served: Servo | None = None
    remarks: tuple[str, ...] = ()
    bands: Mapping[str, Band] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        """Whether every tick is kept."""
        return len(self.kept) == self.ticks

    @property
    def points(self) -> Setpoints:
        """All setpoints; LimitsError where they do not fit in memory, of which `setpoints()` gives them in chunks."""
        if self.whole:
            return self.kept
        if self.ticks > MOST_TICKS:
            raise LimitsError(
                f"a motion of {self.ticks} ticks is not kept in memory; use setpoints(), which gives chunks"
            )
        found = self.setpoints()
        return found if isinstance(found, Setpoints) else Setpoints.joined(list(found))

    @property
    def law(self) -> TimeLaw:
        """The time law; LimitsError for a path that came in parts, of which it is not kept."""
        if self.planned is None:
            raise LimitsError(f"{self.name}: came in parts, and its time law is not kept")
        return self.planned

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
    def duration(self) -> float:
        """Time from the first setpoint to the last, s."""
        return float(self.verdict.numbers["duration_s"]) if self.planned is None else self.planned.duration

    @property
    def length(self) -> float:
        """Arc length of the tip's path, mm (degrees where all axes are rotary)."""
        return float(self.verdict.numbers["length_mm"]) if self.planned is None else self.path.tip_end

    @property
    def strategy(self) -> str:
        """Name of the strategy that planned it."""
        return str(self.kept.settings["strategy"]) if self.planned is None else self.planned.strategy

    @property
    def lower_bound(self) -> float | None:
        """A time that no motion within the limits is shorter than, s, where it is known."""
        return None if self.planned is None else self.planned.settings.get("lower_bound_s")

    @property
    def place(self) -> Array:
        """Where the tool tip is at the ticks that are kept, (n, d), mm; d linear axes, at most three."""
        if self.joints is not None:
            return self.path.evaluate(self.kept.curve, self.kept.u, 0)[:, 0]
        if (arm := self.path.sticks(self.kept.position)) is not None:
            return arm[:, -1]
        return self.kept.position[:, : min(self.path.linear, 3)]

    @property
    def thread(self) -> Array:
        """Where the path runs, for a picture, (m, d), mm, a row of NaN where it is broken; d linear axes, at most 3."""
        path = self.path
        s = np.linspace(0.0, path.length, int(np.clip(CELLS * path.length / max(path.size, 1e-9), *POINTS_DRAWN)))
        starts = path.curve_starts
        along = path(s if len(starts) > len(s) else np.union1d(s, starts))
        if (arm := path.sticks(along)) is not None:
            return arm[:, -1]
        line = along[:, : min(path.linear, 3)]
        held = None if self.joints is None else self.joints.drawn(TOOLS_DRAWN)
        return line if held is None else np.concatenate([line, _broken(held)])

    def poses(self, most: int) -> tuple[Array, Array] | None:
        """Give the lines of an arm at some times of the motion.

        Parameters
        ----------
        most : int
            How many times there are at the most.

        Returns
        -------
        tuple of array or None
            Times (k,), s, evenly apart, and the arm then as lines (k, points, 3), mm, from base to tip; None where what
            moves is no arm.
        """
        kept, moved = self.kept, self.path if self.joints is None else self.joints
        at = np.unique(np.searchsorted(kept.t, np.linspace(kept.t[0], kept.t[-1], most)).clip(0, len(kept.t) - 1))
        arm = moved.sticks(kept.position[at])
        return None if arm is None else (kept.t[at], arm)

    def setpoints(self) -> Setpoints | Iterator[Setpoints]:
        """Give all setpoints, whole or in chunks.

        Returns
        -------
        Setpoints or iterator of Setpoints
            The whole where it is kept, else chunks, made again: positions (n, axes), mm, rotary axes rad.

        Raises
        ------
        LimitsError
            For a path that came in parts, whose setpoints were made once, and written.
        """
        settings, made = self.kept.settings, self.chunks
        if self.whole:
            return self.kept
        if made is None:
            raise LimitsError(f"{self.name}: came in parts and was read once; its setpoints are in the file written")
        return (replace(chunk, settings=settings) for chunk in made())

    @property
    def end_error_mm(self) -> float:
        """Distance of the last setpoint from the end of the path, mm, as the check found it."""
        return float(self.verdict.numbers["end_error_mm"])

    @property
    def ok(self) -> bool:
        """Whether the check found every limit kept and the path covered to its end."""
        return self.verdict.ok

    def __repr__(self) -> str:
        moved = self.path if self.joints is None else self.joints
        return f"Run({moved!r}, {self.strategy}, {self.duration:.6g} s, {self.ticks} setpoints, ok={self.ok})"

    def _repr_html_(self) -> str:
        verdict = "every limit holds" if self.ok else "; ".join(self.verdict.problems)
        rows = {
            "path": f"{self.path.name}, {self.length:.6g} {unit_along(self.path.axes)}",
            "motion": f"{self.duration:.6g} s, {self.strategy}",
            "setpoints": f"{self.ticks}, one every {self.kept.period:g} s",
            "check": verdict,
        }
        place = self.place
        picture = view.shape(place[:: -(-len(place) // SHAPE)], self.name) if place.shape[1] > 1 else ""
        return view.table(rows, picture + view.sparkline(self.kept.feed, "feed over time"))

    def measured(self) -> dict[str, Any]:
        """What the measures found, by the keys of `numbers`."""
        return {key: value for each in self.measures for key, value in each.numbers(self.verdict).items()}

    @property
    def ripple(self) -> Ripple:
        """The feed ripple of the steps at the ticks that are kept, and over all of them."""
        return next(each.ripple for each in self.measures if isinstance(each, FeedRipple))

    @property
    def chord_error_mm(self) -> float:
        """Largest distance of the path from the line between setpoints, mm."""
        return float(self.measured()["chord_error_max_mm"])

    def numbers(self) -> dict[str, Any]:
        """Give the numbers of the run, as `--json` prints them.

        Returns
        -------
        dict of str to object
            Durations in s, lengths in mm, limits with their worst value, share and place; rotary axes in degrees.
            Lengths along a path of joints are in its `unit`, rad, also those whose keys end in _mm.
        """
        setpoints, notes = self.kept, () if self.planned is None else self.planned.notes
        return {
            "ok": self.ok,
            "duration_s": self.duration,
            "lower_bound_s": self.lower_bound,
            "length_mm": self.length,
            "unit": unit_along(self.path.axes),
            "ticks": self.ticks,
            "period_s": setpoints.period,
            "method": setpoints.method,
            "strategy": self.strategy,
            "end_error_mm": self.end_error_mm,
            "end_reached": self.verdict.numbers["end_reached"],
            "feed_max_mm_s": float(setpoints.feed.max()),
            **self.measured(),
            "limits": self.verdict.as_dict()["limits"],
            "problems": list(self.verdict.problems),
            "bound_by": self.use.time_bound_by(),
            "axes": self.axis_peaks(),
            "notes": list(dict.fromkeys([*self.path.findings, *notes, *self.verdict.notes, *self.remarks])),
        }

    def axis_peaks(self) -> dict[str, dict[str, float | str]]:
        """Give the largest |velocity|, |acceleration| and |jerk| of each axis.

        Returns
        -------
        dict of str to dict
            By axis, in mm or degrees, with the unit. Linear axes also have their shares of the path's own acceleration
            and jerk, which they need not keep.
        """
        own = self.own_limits()
        peaks: dict[str, dict[str, float | str]] = {}
        for i, axis in enumerate(self.axes):
            unit = unit_of_axis(axis)
            rotary, factor = unit != "mm", 180.0 / np.pi if unit == "deg" else 1.0
            each = {name: factor * float(np.max(np.abs(getattr(self.motion, name)[:, i]))) for name in MOTION}
            shares = {} if rotary else {f"{name}_share": each[name] / limit for name, limit in own.items()}
            peaks[axis] = {"unit": unit, **each, **shares}
        return peaks

    def own_limits(self) -> dict[str, float]:
        """Give the acceleration and the jerk along the path that it was planned with.

        Returns
        -------
        dict of str to float
            By name, mm/s^2 and mm/s^3, the larger of speeding up and slowing down; without those that have no limit.
        """
        limits = self.limits.as_dict()
        both = (("acceleration", "deceleration"), ("jerk", "deceleration_jerk"))
        return {name: max(limits[name], limits[other]) for name, other in both if {name, other} <= limits.keys()}


def _broken(lines: Array) -> Array:
    """Lines (k, points, 3), mm, one after the other, each behind a row of NaN, (m, 3)."""
    return np.concatenate([np.full_like(lines[:, :1], np.nan), lines], axis=1).reshape(-1, 3)
