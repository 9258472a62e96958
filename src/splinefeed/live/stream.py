"""The stream: keeps so much ahead of the consumer and no more, obeys the knob, and stops at rest on the path."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.live.motion import Motion
from splinefeed.live.sink import Rows, Sink, Taken

#: Rows made at a time: how soon a turn of the knob is seen by the producer, where a clock takes the rows, and else.
PACED_ROWS, FREE_ROWS = 8, 256
#: How far the axes may be from the first row at the start, mm (rotary axes rad).
START_TOLERANCE = 0.01
#: A consumer that takes no row for so long, s, while there are some, has stopped.
STALLED = 5.0
#: Seconds between two savings of where the consumer is.
SAVE_EVERY = 0.5


class StreamError(SplinefeedError):
    """The stream cannot begin, or its consumer has stopped."""


class Knob:
    """What the operator wants, set from any thread: a rate, a hold, a stop."""

    def __init__(self, rate: float = 1.0) -> None:
        self._rate, self._hold, self._stop = rate, False, False
        self._lock = threading.Lock()

    def set_rate(self, rate: float) -> None:
        """Wanted rate, 1 = as planned. InputError unless from 0 to 2."""
        if not 0.0 <= rate <= 2.0:
            raise InputError(f"override {100.0 * rate:g} %; it must be from 0 to 200 %")
        with self._lock:
            self._rate = rate

    def turn(self, by: float) -> None:
        """Raise or lower the wanted rate, within 0 to 2."""
        with self._lock:
            self._rate = min(max(self._rate + by, 0.0), 2.0)

    def hold(self, held: bool = True) -> None:
        """Hold, or go on."""
        with self._lock:
            self._hold = held

    def stop(self) -> None:
        """Come to rest on the path, and end."""
        with self._lock:
            self._stop = True

    @property
    def rate(self) -> float:
        """What is turned to."""
        return self._rate

    @property
    def held(self) -> bool:
        """Whether a hold is wanted."""
        return self._hold

    @property
    def stopping(self) -> bool:
        """Whether a stop is wanted."""
        return self._stop

    @property
    def wanted(self) -> float:
        """The rate to run at."""
        return 0.0 if self._hold or self._stop else self._rate


@dataclass(frozen=True)
class State:
    """How a stream is doing.

    row, depth  rows sent, and sent but not confirmed; confirmed  the last row that the consumer took
    tau, rate  plan time reached, s, and rate of what is sent; confirmed_tau  plan time of the confirmed row
    """

    row: int
    depth: int
    confirmed: int
    confirmed_tau: float
    tau: float
    rate: float
    wanted: float
    underruns: int
    done: bool


def play(
    motion: Motion,
    sink: Sink,
    knob: Knob,
    ahead: int,
    *,
    here: bool = False,
    saved: Callable[[State], None] | None = None,
    seen: Callable[[State], None] | None = None,
) -> State:
    """Stream a motion into a sink until its end, or until a stop has brought it to rest.

    ahead  rows that are kept ahead of a consumer with a clock
    here   whether to move the whole path so that it begins where the axes are; else they must be there
    saved  called now and then, and at the end, with what the consumer has confirmed; seen  called for each batch

    While held no rows are made: the last one holds. Raises StreamError where the axes are not at the first row, and
    for a consumer that takes no rows any more.
    """
    try:
        return _played(motion, sink, knob, ahead, here, saved or _nothing, seen or _nothing)
    except BaseException:
        sink.abandon()
        raise


def _nothing(state: State) -> None:
    """Nobody wants to know."""


def _played(
    motion: Motion,
    sink: Sink,
    knob: Knob,
    ahead: int,
    here: bool,
    saved: Callable[[State], None],
    seen: Callable[[State], None],
) -> State:
    at = sink.open(motion.axes, motion.period, motion.start)
    offset = at - motion.start if here else np.zeros(len(motion.axes))
    off = float(np.max(np.abs(at - motion.start - offset)))
    if off > START_TOLERANCE:
        k = int(np.argmax(np.abs(at - motion.start)))
        raise StreamError(
            f"the axes are not where the path begins: {motion.axes[k]} is at {at[k]:.6g}, the path begins at "
            f"{motion.start[k]:.6g}; move them there, or stream with --here"
        )
    batch = PACED_ROWS if sink.paced else FREE_ROWS
    row, last_taken, moved, save_at = 0, 0, time.monotonic(), 0.0
    position = motion.start[None] + offset

    def state(taken: Taken, *, done: bool = False) -> State:
        return State(
            row=row,
            depth=row - taken.row,
            confirmed=taken.row,
            confirmed_tau=motion.tau_of(taken.row),
            tau=motion.override.tau,
            rate=motion.override.rate,
            wanted=knob.wanted,
            underruns=taken.underruns,
            done=done,
        )

    while not motion.done:
        room = ahead - sink.depth() if sink.paced else batch
        taken = sink.taken()
        now = time.monotonic()
        if taken.row != last_taken or sink.depth() == 0:
            last_taken, moved = taken.row, now
        if now >= save_at:
            saved(state(taken))
            save_at = now + SAVE_EVERY
        resting = motion.held and knob.wanted == 0.0 and row > 0
        if resting and knob.stopping:
            break
        if resting and not sink.paced:
            time.sleep(motion.period * batch)  # a file gets no rows of a hold, as nothing moves
            continue
        if room < min(batch, ahead):
            if now - moved > STALLED:
                raise StreamError(
                    f"the controller takes no rows after row {taken.row}: is it enabled, do the axes follow?"
                )
            time.sleep(min(motion.period * batch / 2.0, 0.01))
            continue
        wanted = knob.wanted
        if taken.override is not None:
            wanted = min(wanted * taken.override, 2.0)
        points = motion.take(min(batch, room), wanted)
        position = points.position + offset
        sink.write(Rows(row + 1, position, motion.axes, last=motion.done))
        row += len(points)
        seen(state(sink.taken()))
    # the very last row once more: a FIFO of LinuxCNC 2.9 may keep the last one to itself; it is also how a stop ends
    sink.write(Rows(row + 1, position[-1:], motion.axes, last=True))
    row += 1
    taken = sink.close()
    final = state(taken, done=motion.done)
    saved(final)
    return final
