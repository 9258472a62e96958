"""A motion too long to keep: measured, checked and thinned in passes over its chunks, in memory that stays flat."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.analysis.binding import LimitUse
from splinefeed.analysis.check import check
from splinefeed.errors import InputError, LimitsError
from splinefeed.feed.planning import plan
from splinefeed.geometry.path import Path
from splinefeed.interpolation.interpolator import Interpolator, interpolate
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.kinematics import JointPath
from splinefeed.machine.table import Machine
from splinefeed.pipeline.experiment import Served
from splinefeed.pipeline.follow import Servo
from splinefeed.pipeline.long_meter import CountedUse, Meter
from splinefeed.pipeline.run import Run, run
from splinefeed.records import Array, Limits, Setpoints, TimeLaw

#: Motions of more ticks than this are not kept whole by `splinefeed run`.
LONG = 1_000_000
#: Most ticks of a motion, above ten days at 1 ms; more are a slip of the hand.
MOST = 1_000_000_000
#: Stretches of time of which the least and the greatest of every quantity are kept, and most ticks of one.
COLUMNS, MOST_IN_COLUMN = 1200, 65_536
#: Ticks on both sides of a chunk that its measures may look at: what a third difference needs.
NEIGHBOURS = 2
#: Makes the setpoints anew, in chunks of so many ticks, each time that it is called.
Chunks = Callable[[int], Iterator[Setpoints]]
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class LongRun(Run):
    """A run of which `points`, `motion` and `use` hold the ticks that a figure needs: every peak is among them.

    Its numbers are those of all ticks.


    count    ticks of the whole motion; chunks  makes its setpoints anew; line  (m, d) for a picture of the path
    counted  the use of limits; served  what a machine did at these ticks and over all of them, or None
    """

    count: int
    chunks: Chunks
    line: Array
    counted: CountedUse
    served: Served | None

    @property
    def ticks(self) -> int:
        """Number of setpoints."""
        return self.count

    @property
    def use(self) -> LimitUse:
        """How much of each limit is used at the ticks that are kept, and over all of them."""
        return self.counted

    @property
    def thread(self) -> Array:
        """Where the path runs, for a picture, (m, d), a row of NaN where it is broken."""
        return self.line

    def setpoints(self) -> Iterator[Setpoints]:
        """All setpoints, in chunks."""
        settings = self.points.settings
        return (replace(chunk, settings=settings) for chunk in self.chunks(_chunk(self.count)))


def run_any(
    path: Path | JointPath,
    limits: Limits,
    *,
    period: float,
    strategy: str | None = None,
    law: TimeLaw | None = None,
    table: Machine | None = None,
    on_progress: Progress | None = None,
    **how: Any,
) -> Run:
    """`run`, or for a motion of more than LONG ticks `run_long` with `table`; `how` goes to either.

    Raises LimitsError for more than MOST ticks.
    """
    found = plan(path, limits, strategy=strategy, period=period) if law is None else law
    asked: dict[str, Any] = {"period": period, "strategy": strategy, "law": found, **how}
    ticks = found.duration / period
    if ticks > MOST:
        raise LimitsError(
            f"the motion takes {found.duration:.6g} s, {ticks:.3g} periods of {period:g} s; at most {MOST} are made: "
            f"raise the period or the feed"
        )
    if ticks <= LONG or isinstance(path, JointPath):
        return run(path, limits, **asked)
    return run_long(path, limits, table=table, on_progress=on_progress, **asked)


def run_long(
    path: Path,
    limits: Limits,
    *,
    period: float,
    strategy: str | None = None,
    method: str = DEFAULT_METHOD,
    corrections: int = 1,
    tolerance: float = 0.0,
    law: TimeLaw | None = None,
    table: Machine | None = None,
    on_progress: Progress | None = None,
) -> LongRun:
    """`pipeline.run.run` for a motion of any number of ticks, which are made again for each pass.

    law  if it is there already; table  a machine that follows; on_progress(what, ticks done, ticks) now and then
    """
    found = plan(path, limits, strategy=strategy, period=period) if law is None else law
    asked: dict[str, Any] = {"period": period, "method": method, "corrections": corrections, "tolerance": tolerance}

    def chunks(size: int) -> Iterator[Setpoints]:
        return interpolate(path, found, chunk=size, **asked)

    ticks = Interpolator(path, found, **asked).ticks
    return measured_long(path, limits, found, chunks, ticks, table=table, on_progress=on_progress)


def measured_long(
    path: Path,
    limits: Limits,
    law: TimeLaw,
    chunks: Chunks,
    ticks: int,
    *,
    table: Machine | None = None,
    on_progress: Progress | None = None,
) -> LongRun:
    """Setpoints that can be made, or read, again and again, measured and checked as those of a run."""
    say = on_progress or (lambda what, done, of: None)
    size = _chunk(ticks)
    period = next(chunks(1)).period
    meter = Meter(path, limits, law, column_of(ticks), _top_feed(law, period, ticks))
    servo = None if table is None else Servo(table, path)
    for block, own, points in _with_neighbours(chunks(size)):
        meter.see(block, own, points)
        if servo is not None and servo.stopped is None:
            meter.see_response(servo.follow(points), points)
        meter.keep()
        say("measuring", meter.ticks, ticks)
    verdict = check(_told(chunks(size), "checking", ticks, say), path, limits, law=law)
    points = meter.points
    served = None
    if servo is not None:
        served = Served(points, meter.response, servo.tally, tuple(servo.notes), meter.off_law)
    return LongRun(
        path=path,
        limits=limits,
        law=law,
        points=points,
        ripple=meter.ripple,
        motion=meter.motion,
        verdict=verdict,
        chord_error_mm=meter.chord,
        count=ticks,
        chunks=chunks,
        line=meter.thread.line,
        counted=meter.use,
        served=served,
    )


def _top_feed(law: TimeLaw, period: float, ticks: int) -> float:
    """Highest feed at any tick, mm/s."""
    size = MOST_IN_COLUMN
    starts = range(0, ticks, size)
    return max(float(np.max(law.feed(np.arange(k, min(k + size, ticks)) * period))) for k in starts)


def column_of(ticks: int) -> int:
    """Ticks in one column of a motion of so many."""
    return min(max(-(-ticks // COLUMNS), 1), MOST_IN_COLUMN)


def _chunk(ticks: int) -> int:
    """Ticks in one chunk: whole columns, and few enough for the memory."""
    column = column_of(ticks)
    return MOST_IN_COLUMN // column * column


def _with_neighbours(chunks: Iterable[Setpoints]) -> Iterator[tuple[Setpoints, slice, Setpoints]]:
    """Each chunk with the ticks before and behind it, where it is in that, and by itself."""
    before: Setpoints | None = None
    held: Setpoints | None = None
    for chunk in chunks:
        if held is not None:
            yield _beside(before, held, chunk)
            before = held.part(max(len(held) - NEIGHBOURS, 0), len(held))
        held = chunk
    if held is None:
        raise InputError("there are no setpoints to measure")
    yield _beside(before, held, None)


def _beside(before: Setpoints | None, chunk: Setpoints, behind: Setpoints | None) -> tuple[Setpoints, slice, Setpoints]:
    parts = [
        each for each in (before, chunk, None if behind is None else behind.part(0, NEIGHBOURS)) if each is not None
    ]
    first = 0 if before is None else len(before)
    return Setpoints.joined(parts), slice(first, first + len(chunk)), chunk


def _told(chunks: Iterator[Setpoints], what: str, ticks: int, say: Progress) -> Iterator[Setpoints]:
    """The chunks as they are, with a word of progress about each."""
    done = 0
    for chunk in chunks:
        yield chunk
        done += len(chunk)
        say(what, done, ticks)
