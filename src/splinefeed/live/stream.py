"""The stream: keeps a lookahead buffer, obeys the operator, and stops on the path."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.errors import SplinefeedError
from splinefeed.live.motion import Motion
from splinefeed.live.operator import MOST, Operator
from splinefeed.live.sinks import SetpointRows, Sink, Taken, batch_rows
from splinefeed.records import Array

#: Rows made at a time where no clock takes them.
FREE_ROWS = 256
#: How far the axes may be from the first row at the start, mm (rotary axes rad).
START_TOLERANCE = 0.01
#: A consumer that takes no row for so long, s, while there are some, has stopped.
STALLED = 5.0
#: Seconds between two savings of where the consumer is.
SAVE_EVERY = 0.5
#: Why a stream does not go on.
BLIND = (
    "that stream was not stopped but cut off, and nothing tells where the axes are now; read their positions and give "
    "them by --at (x=12.5,y=3), or move them to the start and leave out --resume"
)
#: Gives the motion from where the axes are to the first row, (axes,) each.
Approach = Callable[[Array, Array], Motion]


class StreamError(SplinefeedError):
    """The stream cannot begin, or its consumer has stopped."""


@dataclass(frozen=True)
class StreamState:
    """The status of a stream.

    Parameters
    ----------
    row, depth : int
        Rows sent, and of these those that are not confirmed.
    confirmed : int
        The last row that the consumer took.
    confirmed_tau, tau : float
        Plan time of that row, and plan time reached by what is sent, s.
    rate : float
        Of what is sent, 1 as planned.
    underruns : int
        Periods in which the consumer wanted a row and there was none.
    done : bool
        Whether the end of the motion is reached.
    rests : bool, optional
        Whether the stream has ended at rest on the path and all rows were confirmed: only from such a state can a sink
        without feedback go on.
    position : tuple of float, optional
        The last row sent, (axes,), mm and rad.
    """

    row: int
    depth: int
    confirmed: int
    confirmed_tau: float
    tau: float
    rate: float
    underruns: int
    done: bool
    rests: bool = False
    position: tuple[float, ...] = ()


def play(
    motion: Motion,
    sink: Sink,
    operator: Operator,
    ahead: int,
    *,
    here: bool = False,
    resume: tuple[float, float] | None = None,
    known: Array | None = None,
    approach: Approach | None = None,
    saved: Callable[[StreamState], None] = lambda state: None,
    seen: Callable[[StreamState], None] = lambda state: None,
) -> StreamState:
    """Stream a motion into a sink until its end, or until a stop has brought it to rest.

    Parameters
    ----------
    motion : Motion
        To be streamed.
    sink : Sink
        That takes the rows.
    operator : Operator
        Whose override, hold, retrace and stop are obeyed.
    ahead : int
        Rows that are kept ahead of a consumer with a clock.
    here : bool, optional
        Whether to move the whole path so that it begins where the axes are; else they must be there.
    resume : tuple of float, optional
        Plan times, s, of the last row confirmed and of the last one sent by a stream that ended early: begin between
        them, where the axes are (rows may have been taken behind the last confirmation).
    known : array (axes,), optional
        Where the axes are, mm and rad, for a sink that cannot tell.
    approach : callable, optional
        Gives the motion of the axes to the first row; without it they must be there.
    saved : callable, optional
        Called from time to time, at the end, and after an error, with what the consumer has confirmed.
    seen : callable, optional
        Called for each batch.

    Returns
    -------
    StreamState
        At the end.

    Raises
    ------
    StreamError
        Where the axes are not at the first row, for a resume where nothing tells where they are, and for a consumer
        that stops taking rows.

    Notes
    -----
    While held no rows are made for a sink without a clock. A consumer that runs dry holds; it then continues from rest,
    after the last row that it took.
    """
    stream = _Stream(motion, sink, operator, ahead, saved, seen)
    try:
        stream.begin(here, resume, known, approach)
        return stream.run()
    except BaseException:
        with suppress(Exception):
            saved(stream.state())
        sink.abandon()
        raise


class _Stream:
    def __init__(
        self, motion: Motion, sink: Sink, operator: Operator, ahead: int,
        saved: Callable[[StreamState], None], seen: Callable[[StreamState], None],
    ) -> None:  # fmt: skip
        self.motion, self.sink, self.operator, self.ahead = motion, sink, operator, ahead
        self.saved, self.seen = saved, seen
        self.parts = [motion]
        self.base = 0  # rows that were sent before the first one of the part that runs
        self.row = 0
        self.offset: Array = np.zeros(len(motion.axes))
        self.position: Array = motion.start[None]
        self.taken = Taken(0)

    def begin(
        self, here: bool, resume: tuple[float, float] | None, known: Array | None, approach: Approach | None
    ) -> None:
        """Find where the axes are, and begin there."""
        motion = self.motion
        if resume is not None and known is None and not self.sink.feedback:
            raise StreamError(BLIND)
        at = self.sink.open(motion.axes, motion.period, motion.start)
        if known is not None and not self.sink.feedback:
            at = known
        if here:
            self.offset = at - motion.start
        elif resume is not None:
            beyond = MOST * (SAVE_EVERY + self.ahead * motion.period)
            motion.begin_near(at, min(resume) - beyond, max(resume) + beyond)
        self.position = motion.start[None] + self.offset
        off = np.abs(at - self.position[0])
        if float(np.max(off)) <= START_TOLERANCE:
            return
        if approach is None:
            k = int(np.argmax(off))
            raise StreamError(
                f"the axes are not where the path begins: {motion.axes[k]} is at {at[k]:.6g}, the path begins at "
                f"{motion.start[k]:.6g}; move them there, or stream with --approach (a straight move to it) or --here"
            )
        self.parts.insert(0, approach(at, motion.start))

    def run(self) -> StreamState:
        """Every part, and the end."""
        for k, part in enumerate(self.parts):
            if k:
                part.take(1, 0.0)  # where the one before ended
                self.base = self.row - 1
            self._run(part, last=part is self.parts[-1])
            if not part.done:
                break
        # the very last row once more: a FIFO of LinuxCNC 2.9 may keep the last one to itself; so does a stop end, too
        self._write(self.position[-1:], last=True)
        self.taken = self.sink.close()
        final = replace(self.state(), rests=part is self.parts[-1])
        self.saved(final)
        return final

    def state(self) -> StreamState:
        """The status."""
        motion, taken = self.motion, self.taken
        return StreamState(
            row=self.row,
            depth=self.row - taken.row,
            confirmed=taken.row,
            confirmed_tau=motion.tau_of(taken.row - self.base),
            tau=motion.override.tau,
            rate=motion.override.rate,
            underruns=taken.underruns,
            done=motion.done,
            position=tuple(self.position[-1].tolist()),
        )

    def _write(self, position: Array, last: bool) -> None:
        self.sink.write(SetpointRows(self.row + 1, position, self.motion.axes, last))
        self.position = position
        self.row += len(position)

    def _run(self, part: Motion, last: bool) -> None:
        """Until the end of a part, or until a stop has brought it to rest."""
        sink, operator = self.sink, self.operator
        batch = batch_rows(self.ahead) if sink.paced else FREE_ROWS
        before, moved, save_at = -1, time.monotonic(), 0.0
        # a part before another one rests at its end until it is confirmed there: retrace cannot cross into it
        while not part.done or (not last and sink.paced and self.taken.row < self.base + part.rows):
            self.taken = taken = sink.taken()
            if taken.dry:
                part.go_back_to(taken.row - self.base)
                self.row = taken.row
                sink.restart()
                continue
            room = self.ahead - sink.depth() if sink.paced else batch
            now = time.monotonic()
            if taken.row != before or room == self.ahead:
                before, moved = taken.row, now
            if now >= save_at:
                self.saved(self.state())
                save_at = now + SAVE_EVERY
            wanted = operator.wanted
            if taken.override is not None:
                wanted = min(max(wanted * taken.override, -MOST), MOST)
            resting = part.rests(wanted)
            if resting and operator.stopping:
                return
            if resting and not sink.paced:
                time.sleep(part.period * batch)  # a file gets no rows of a hold, as nothing moves
                continue
            if room < min(batch, self.ahead):
                if now - moved > STALLED:
                    raise StreamError(
                        f"the controller takes no rows after row {taken.row}: is it enabled, do the axes follow?"
                    )
                time.sleep(min(part.period * batch / 2.0, 0.01))
                continue
            count = min(batch, room)
            if part.done:
                self._write(np.repeat(self.position[-1:], count, axis=0), last=False)
            else:
                position = part.take(count, wanted) + self.offset
                self._write(position, last=last and part.done)
            moved = time.monotonic()
            self.seen(self.state())
