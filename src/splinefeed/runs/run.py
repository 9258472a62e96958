"""One run: a job carried out, a path and limits to setpoints and the numbers of their quality, in one pass."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from splinefeed.analysis.thinning import Kept
from splinefeed.checks.check import Check
from splinefeed.errors import InputError, LimitsError, expect
from splinefeed.formats.setpoints import Writer
from splinefeed.interpolation.interpolator import interpolate
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.kinematics import JointPath
from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.paths.track import Track
from splinefeed.planner.planning import cheap_to_bound, plan
from splinefeed.planner.strategies import LOOK_AHEAD
from splinefeed.records import Limits, Setpoints, State, TimeLaw
from splinefeed.runs.fold import CHUNK, Chunk, Meter, fold, on_one_path
from splinefeed.runs.long_path import METHOD, PartReader, windows
from splinefeed.runs.measure import MeasuredRun
from splinefeed.runs.measures import MEASURES
from splinefeed.runs.meters import CheckMeter, ServoMeter
from splinefeed.runs.result import MOST_TICKS, Run
from splinefeed.runs.settings import PAPER_LIMITS, PAPER_PERIOD
from splinefeed.telling import Listener, listening, tell

#: Most ticks of a motion that is made in chunks, above ten days at 1 ms.
MOST_IN_CHUNKS = 1_000_000_000
#: Of motions of at most so many ticks every tick is kept; of a longer one, and of a path in parts, whose ticks nobody
#: knows beforehand, so many at the most, every peak among them. Figures over time have bands, which are finer.
LONG, MOST_KEPT = 250_000, 60_000
#: Makes the setpoints again, in chunks of so many ticks, each time that it is called.
Chunks = Callable[[int], Iterator[Setpoints]]
#: Is called with how many moves of a file are planned, and how many setpoints are made.
Read = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class MotionJob:
    """A motion that is wanted: where, within which limits, on which machine, planned how.

    Parameters
    ----------
    path : Track or PathParts
        To drive along; a file too long to be held comes in parts.
    limits : Limits
        Complete: of all that the motion has to keep.
    machine : Machine, optional
        Whose axes follow the setpoints, or in whose joints a tool path is planned; None for none.
    period : float, optional
        Of the servo, s.
    strategy : str, optional
        As for `plan`; None chooses one that keeps the limits.
    method, corrections, tolerance : str, int, float, optional
        As for `interpolate`.
    start : State, optional
        Where on the path the motion begins, and how; None for its start, at rest.
    source : str, optional
        What the user calls the path.
    reading : mapping of str to object, optional
        How the path was read, as options of the command line say it.
    notes : tuple of str, optional
        What was assumed, one sentence each.
    """

    path: Track | PathParts
    limits: Limits
    machine: Machine | None = None
    period: float = PAPER_PERIOD
    strategy: str | None = None
    method: str = DEFAULT_METHOD
    corrections: int = 1
    tolerance: float = 0.0
    start: State | None = None
    source: str = ""
    reading: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def run(
    path: Track,
    limits: Limits = PAPER_LIMITS,
    *,
    machine: str | Machine | None = None,
    period: float = PAPER_PERIOD,
    strategy: str | None = None,
    method: str = DEFAULT_METHOD,
    corrections: int = 1,
    tolerance: float = 0.0,
    start: State | None = None,
    law: TimeLaw | None = None,
    meters: Sequence[Meter] = (),
    on_progress: Listener | None = None,
) -> Run:
    """Plan a motion along a path, interpolate it, and measure it.

    The limits and the period that are left out are those of the paper [1]_.

    Parameters
    ----------
    path : Track
        To drive along.
    limits : Limits, optional
        That the motion keeps.
    machine : str or Machine, optional
        A Machine or its name: of a ToolPath its joints follow the path, of another path its axes follow the setpoints,
        simulated.
    period : float, optional
        Of the servo, s.
    strategy : str, optional
        As for `plan`.
    method, corrections, tolerance : str, int, float, optional
        As for `interpolate`.
    start : State, optional
        Where on the path the motion begins, and how, as `plan` takes it.
    law : TimeLaw, optional
        If it is planned already; it knows its start.
    meters : sequence of Meter, optional
        Further ones of the chunks, such as writers of files (`splinefeed.runs.fold`).
    on_progress : callable, optional
        Called with what is done ("planning", "measuring", ...), how much of it is there, and of how much.

    Returns
    -------
    Run
        With setpoints (n, axes), mm, rotary axes rad.

    Raises
    ------
    InputError
        For a machine that cannot follow a tool path, and for a start beside a law.
    LimitsError
        For more than MOST_IN_CHUNKS ticks; and what `plan`, `interpolate` and `follow` raise.

    Notes
    -----
    Setpoints are made and measured in chunks, once. Of more than 250,000 ticks those that figures need are kept, and
    `setpoints()` of the run makes all of them again. docs/code-overview.md walks through this function.

    References
    ----------
    .. [1] S. Alimohammadi and B. Motakef Imani, Modares Mechanical Engineering 15(13) (2015) 158-162; docs/paper.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> line = sf.Path.polyline([[0, 0], [30, 0]])
    >>> run = sf.run(line, sf.Limits(feed=60, acceleration=500, jerk=20000))
    >>> run.ok, run.ticks, round(run.duration, 6)  # 30/60 + 60/500 + 500/20000
    (True, 646, 0.645)
    """
    expect("run(path, limits)", (path, (Path, Track)), (limits, Limits))
    model = Machine.load(machine) if isinstance(machine, str) else machine
    if law is not None and start is not None:
        raise InputError("start: the law that is given begins as it was planned; leave start out, or plan with it")
    how: dict[str, Any] = {"method": method, "corrections": corrections, "tolerance": tolerance, "start": start}
    job = MotionJob(path, limits, model, period, strategy, **how)
    with listening(on_progress):
        return carry_out(job, law=law, meters=meters)


def carry_out(
    job: MotionJob,
    *,
    law: TimeLaw | None = None,
    meters: Sequence[Meter] = (),
    responses: Writer | None = None,
    on_read: Read | None = None,
) -> Run:
    """Plan, interpolate and measure a job in one pass.

    Parameters
    ----------
    job : MotionJob
        What to do.
    law : TimeLaw, optional
        If it is planned already.
    meters : sequence of Meter, optional
        Further ones, which see every chunk, too.
    responses : Writer, optional
        Writes what the machine does.
    on_read : callable, optional
        Called with how many moves of a path in parts are planned, and how many setpoints are made.

    Returns
    -------
    Run
        With setpoints (n, axes), mm, rotary axes rad.

    Raises
    ------
    InputError
        For a machine that cannot follow a tool path, and for a path in parts with what needs a whole one.
    LimitsError
        For more than MOST_IN_CHUNKS ticks; and what `plan`, `interpolate` and `follow` raise.
    """
    if job.path.in_parts is not None:
        return _in_parts(job, job.path.in_parts, meters, responses, on_read or (lambda read, ticks: None))
    path, model, remarks = machine_of(job.path, job.machine, job.limits)
    limits, period = job.limits.on(path.axes), job.period
    if law is None:
        how: dict[str, Any] = {"strategy": job.strategy, "period": period, "start": job.start}
        law = plan(path, limits, bound=cheap_to_bound(path, limits), **how)
    ticks, planned = check_ticks(law, period, MOST_IN_CHUNKS), law

    def chunks(chunk: int) -> Iterator[Setpoints]:
        how: dict[str, Any] = {"method": job.method, "corrections": job.corrections, "tolerance": job.tolerance}
        return interpolate(path, planned, chunk=chunk, period=period, **how)

    made = measured(path, limits, law, chunks, ticks, machine=model, meters=meters, responses=responses)
    return replace(made, remarks=remarks)


def _in_parts(
    job: MotionJob, source: PathParts, meters: Sequence[Meter], responses: Writer | None, on_read: Read
) -> Run:
    """Plan a path that comes in parts window by window, and measure it; memory does not grow with it."""
    if job.start is not None:
        raise InputError("start: a path in parts is planned from its start; leave it out")
    for name, given, only in (("strategy", job.strategy, LOOK_AHEAD), ("method", job.method, METHOD)):
        if given not in (None, only):
            raise InputError(
                f"{name} {given}: needs the whole path; a path in parts is planned by {only}: leave it out"
            )
    check, ticks = Check(job.limits), 0
    reading = PartReader(source, job.reading, check.part)

    def counted(chunks: Iterable[Chunk]) -> Iterator[Chunk]:
        nonlocal ticks
        for chunk in chunks:
            yield chunk
            ticks += len(chunk.own)
            on_read(min(reading.read, source.count), ticks)

    chunks = counted(windows(reading, job.limits, job.period))
    how: dict[str, Any] = {"machine": job.machine, "meters": meters, "responses": responses}
    made = _folded(chunks, check, partial(_line, name=source.name), most=MOST_KEPT, **how)
    return replace(made, remarks=tuple(reading.findings))


def _line(points: Setpoints, name: str) -> Path:
    """The line through setpoints, for pictures of a path that came in parts."""
    at = points.position
    moved = np.append(True, np.any(np.diff(at, axis=0) != 0.0, axis=1))
    return Path.polyline(at[moved], points.axes, name=name)


def measured(
    path: Track,
    limits: Limits,
    law: TimeLaw,
    chunks: Chunks,
    ticks: int,
    *,
    machine: Machine | None = None,
    meters: Sequence[Meter] = (),
    responses: Writer | None = None,
) -> Run:
    """Measure and check setpoints that can be made, or read, again, in one pass.

    Parameters
    ----------
    path, limits, law : Track, Limits, TimeLaw
        What the setpoints were made from.
    chunks : callable
        Makes the setpoints again, in chunks of so many ticks, each time that it is called.
    ticks : int
        Most of them that there are.
    machine : Machine, optional
        Whose axes follow them.
    meters : sequence of Meter, optional
        Further ones, which see every chunk, too.
    responses : Writer, optional
        Writes what the machine does.

    Returns
    -------
    Run
        As `run` gives it.
    """
    again = partial(chunks, CHUNK)
    check = Check(limits, law=law)
    check.part(path)
    passing = on_one_path(_counted(again(), ticks), path, law)
    how: dict[str, Any] = {"machine": machine, "meters": meters, "responses": responses, "top": _top_feed(law, ticks)}
    made = _folded(passing, check, lambda kept: path.tip_path, most=math.inf if ticks <= LONG else MOST_KEPT, **how)
    return replace(made, planned=law, chunks=again, joints=None if path.carries_tip else path)


def _folded(
    chunks: Iterable[Chunk],
    check: Check,
    path_of: Callable[[Setpoints], Path],
    *,
    most: float,
    machine: Machine | None,
    meters: Sequence[Meter],
    responses: Writer | None,
    top: float | None = None,
) -> Run:
    """Pass once over chunks by the meters of a run, and by others.

    Parameters
    ----------
    chunks : iterable of Chunk
        The motion.
    check : Check
        That judges it.
    path_of : callable
        Makes the path of the tip from the ticks that are kept.
    most : float
        How many these may be.
    machine : Machine or None
        What follows the setpoints.
    meters : sequence of Meter
        The others.
    responses : Writer or None
        Takes what the machine did.
    top : float, optional
        Highest feed, mm/s, where it is known.

    Returns
    -------
    Run
        What was made and measured.
    """
    limits, keep = check.limits, partial(Kept, most)
    checked = CheckMeter(check, keep())
    measures = tuple(make(MeasuredRun(limits, keep, top)) for make in MEASURES)
    servo = None if machine is None else ServoMeter(machine, keep(), responses)
    ticks = fold(chunks, [checked, *measures, *([] if servo is None else [servo]), *meters])
    bands = [checked.bands, *(each.bands for each in measures), *([] if servo is None else [servo.servo.bands])]
    return Run(
        path=path_of(checked.kept),
        limits=limits,
        ticks=ticks,
        kept=checked.kept,
        motion=checked.motion,
        use=checked.use,
        tip=checked.tip,
        verdict=checked.verdict,
        measures=measures,
        served=None if servo is None else servo.servo,
        bands={name: band for each in bands for name, band in each.items()},
    )


def _counted(chunks: Iterator[Setpoints], ticks: int) -> Iterator[Setpoints]:
    """The chunks; how many of the ticks came is said."""
    done = 0
    for chunk in chunks:
        done += len(chunk)
        tell("measuring", done, ticks)
        yield chunk


def _top_feed(law: TimeLaw, ticks: int) -> float:
    """The highest feed of the law at its ticks, mm/s."""
    step = law.duration / max(ticks - 1, 1)
    starts = range(0, ticks, CHUNK)
    return max(float(np.max(law.feed(np.arange(k, min(k + CHUNK, ticks)) * step))) for k in starts)


def machine_of(path: Track, machine: Machine | None, limits: Limits) -> tuple[Track, Machine | None, tuple[str, ...]]:
    """Find what moves along a path.

    Parameters
    ----------
    path : Track
        A ToolPath, a path of axes or of joints.
    machine : Machine or None
        That is given.
    limits : Limits
        Of which the travel of the joints is taken.

    Returns
    -------
    path : Track
        Of its own axes, or as joints of a machine.
    machine : Machine or None
        That is simulated.
    remarks : tuple of str
        What was left out, one sentence each.

    Raises
    ------
    InputError
        For a machine beside a path that is already in joints, one that lacks an axis, and as `on_machine` raises it.
    """
    if path.needs_machine:
        return on_machine(path, machine, limits), None, ()
    if path.kinematics is not None and machine is not None:
        raise InputError("machine: the path is already in the joints of a machine; leave it out")
    if machine is not None and machine.axes and not machine.simulates(path.axes):
        check_axes(path.tip_path, machine)
        words = f"axes of {machine.name} have limits alone: what their servo loops do is not simulated"
        return path, None, (words,)
    return path, machine, ()


def check_axes(path: Path, machine: Machine) -> None:
    """Refuse a path that moves an axis which the machine does not have.

    Parameters
    ----------
    path : Path
        Of axes.
    machine : Machine
        That is to follow.

    Raises
    ------
    InputError
        That names the axis.
    """
    for k, axis in enumerate(path.axes):
        if axis not in machine.axes and np.ptp(path.flat.points[:, k]) != 0.0:
            raise InputError(
                f"{path.name}: moves axis {axis}, which {machine.name} does not have; its axes are "
                f"{', '.join(machine.axes)}: add [axis.{axis}.limits]"
            )


def on_machine(path: Track, machine: str | Machine | None, limits: Limits) -> Track:
    """Express a tool path as joints of a machine; leave any other path as it is.

    Parameters
    ----------
    path : Track
        A ToolPath, or any other.
    machine : str or Machine or None
        With kinematics, for a tool path; None for any other.
    limits : Limits
        Of which the travel of the joints is taken, mm and rad.

    Returns
    -------
    Track
        The JointPath, or `path`.

    Raises
    ------
    InputError
        For a tool path without a machine, a machine without kinematics, and a machine for another path.
    """
    if not path.needs_machine:
        if machine is not None:
            raise InputError("machine: only a ToolPath is planned in the joints of a machine; leave it out")
        return path
    if machine is None:
        raise InputError(
            f"{path.name}: has a tool axis, which only a machine can follow; give a machine with kinematics (--machine)"
        )
    model = machine if isinstance(machine, Machine) else Machine.load(machine)
    if model.kinematics is None:
        lines = path.tip_path.lines
        line = "" if lines is None else f" (line {lines[0]})"
        raise InputError(
            f"{model.name}: has no [kinematics], which a tool path needs{line}; add them to the machine file, or take "
            "a machine that has them (trunnion)"
        )
    return JointPath(path.tip_path, model.kinematics, travel=limits.travel_of(model.kinematics.joints))


def check_ticks(law: TimeLaw, period: float, most: int = MOST_TICKS) -> int:
    """Count the ticks of a motion, and refuse too many.

    Parameters
    ----------
    law : TimeLaw
        Of the motion.
    period : float
        Of the servo, s.
    most : int, optional
        That are possible.

    Returns
    -------
    int
        The ticks at the most: ceil(duration / period) + 1.

    Raises
    ------
    LimitsError
        For more than `most` periods.
    """
    ticks = law.duration / period
    if ticks > most:
        raise LimitsError(
            f"the motion takes {law.duration:.6g} s, {ticks:.3g} periods of {period:g} s; at most {most} are possible: "
            f"raise the period or the feed"
        )
    return math.ceil(ticks) + 1
