"""LinuxCNC's trajectory planner, a step at a time: moves come from its task, motion goes to its real-time side.

Moves become smooth curves, look-ahead plans them, and every block of motion leaves with the stop behind it: a batch.
The player (linuxcnc/splinefeed_player.h) checks and plays it; where no other batch comes in time it plays the stop.
"""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from functools import partial

import numpy as np

from splinefeed.errors import PlanError, SplinefeedError
from splinefeed.kinematics.with_joints import Joints
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_curves import ProgramCurves
from splinefeed.live.linuxcnc_joints import PROBES
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_motion import PlannedMotion
from splinefeed.live.linuxcnc_moves import curve_of, feeds_of
from splinefeed.live.linuxcnc_pieces import PlannedTrack, Quintics, quintics
from splinefeed.live.linuxcnc_wire import Wire
from splinefeed.planner.stream import LookAhead, MotionBlock
from splinefeed.records import State

#: Moves that are taken at once, and where blocks of true curves are to be whole; how long to wait for others that come
#: with one, s.
AT_ONCE, AT_ONCE_OF_CURVES, SETTLE = 200, 1000, 0.003
#: So long a silence is the end of what comes, s, unless so many moves are queued that the task may wait for room.
SILENCE, MANY = 0.050, 900
#: Motion that is planned ahead, s: what a change of the override throws away.
AHEAD = 2.0
#: With less certain motion than this ahead, s, what is known is planned, however little it is.
HUNGRY = 0.4
#: A change of the override is planned when it has not changed for so long, s, from a place so far ahead, s: what the
#: player takes to look at its pieces, and so many times what planning took of late, or is taken to take first, s.
STEADY, LOOKED_AT, TIMES, SLOW, FARTHEST = 0.004, 0.02, 1.5, 0.03, 0.15
#: Cells of a window.
WINDOW = 60
#: A batch that follows at the end of a piece: a time in it that is later.
LATEST = 1e9


@dataclass(eq=False)
class SentBatch:
    """What was sent: its pieces of certain motion, from number `piece` on, on which track, and under what."""

    track: PlannedTrack
    piece: int
    behind: int  # number of the piece behind its last one
    sure: Quintics
    stop: float  # where its last piece ends, mm
    overrides: tuple[float, float, float]  # of feeds and rapid moves, and the largest velocity


class Planner:
    """A planner for one LinuxCNC, as long as it runs.

    Parameters
    ----------
    wire : Wire
        The shared memory.
    mill : Mill
        The machine.
    reserve : float
        Share of the acceleration that is kept for pause and override.
    window : int, optional
        Cells that are planned at a time.
    say : callable, optional
        Takes each message.
    curves : callable, optional
        Gives the true curves of the program that is loaded, None where it has none.
    waits : callable, optional
        Tells since when LinuxCNC's task waits for motion, s by the clock; inf while it goes on, None where nobody
        knows.
    clock : callable, optional
        Gives the time, s.
    """

    def __init__(
        self, wire: Wire, mill: Mill, reserve: float, *, window: int = WINDOW, say: Callable[[str], None] = print,
        curves: Callable[[], ProgramCurves | None] = lambda: None, waits: Callable[[], float | None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self.wire, self.mill, self.window, self.say, self.waits = wire, mill, window, say, waits
        self.clock, self.curves = clock, curves
        self.limits = mill.limits(reserve)
        self.period = float(wire.period)
        moved = mill.moved
        self.inverse = 1.0 / mill.column_units
        self.session = time.time_ns() & 0x7FFFFFFFFFFFFFFF
        self.run: PlannedMotion | None = None
        self.sent: dict[int, SentBatch] = {}
        self.head = max(int(wire.batch_head), 1)  # the number played, batch_now, is 0 before the first one
        self.piece = int(wire.piece_seen)
        self.after = 0
        self.read = int(wire.seg_done)
        self.epoch = -1
        self.stranded = False  # real time plays a stop, behind which to go on
        self.overrides = (1.0, 1.0, math.inf)  # under which it plans: of feeds and rapid moves, largest velocity
        self.changed, self.wanted = 0.0, (1.0, 1.0, math.inf)
        self.takes = SLOW  # how long it takes to plan a change of the override, s: what it took of late
        self.queued, self.grown = self.read, self.clock()  # moves that came, and when the last did
        self.news = self.seen = self.alive = self.began = self.clock()  # `seen`: when the last moves were there
        jerk = np.zeros(wires.COLUMNS)
        jerk[mill.piece_columns] = mill.jerk * self.inverse
        wire.store("jerk", jerk)
        if moved is not None:
            count, own = len(moved.numbers), len(mill.axes)
            wire.joint_vmax[:count] = mill.velocity[own:] * self.inverse[own:]
            wire.joint_amax[:count] = mill.acceleration[own:] * self.inverse[own:]
            wire.joint[:count] = moved.numbers
            wire.probe[:] = PROBES / mill.units
        wire.store("joints", 0 if moved is None else len(moved.numbers))
        wire.store("session", self.session)

    @property
    def there(self) -> bool:
        """Whether LinuxCNC still is what this planner has greeted."""
        return int(self.wire.magic) == wires.MAGIC and int(self.wire.session) == self.session

    def step(self) -> bool:
        """Do what there is to do; whether there was anything."""
        self.alive = self.clock()
        try:
            return self._step()
        except PlanError as error:  # no way on from its state: it comes to rest, and goes on from there
            if self.stranded or not self._own():
                self.fault(str(error))
            self.stranded = self.run is not None
        except SplinefeedError as error:
            self.fault(str(error))
        except (ArithmeticError, ValueError, LookupError, AssertionError) as error:  # a fault of ours: no motion
            at = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{at.filename.rpartition('/')[2]}, line {at.lineno}"
            self.fault(f"internal fault of the planner, {type(error).__name__}: {error} ({place})")
        return True

    def fault(self, text: str) -> None:
        """Tell LinuxCNC why motion cannot go on; the player stops, and waits for an abort."""
        self.say(text)
        self.wire.store("text", " ".join(text.split()).encode("ascii", "replace")[: wires.TEXT - 1])
        self.wire.store("fault", int(self.wire.fault) + 1)
        self.run, self.read = None, int(self.wire.seg_head)

    def _step(self) -> bool:
        wire = self.wire
        if int(wire.epoch) != self.epoch:
            self._begin_again()
        if self.stranded:
            self._go_on_at_rest()
            return not self.stranded
        self._overrides()
        ended = self._ended()
        fresh = self._take()
        run = self.run
        if run is None:
            return fresh
        if fresh:
            self.news = self.clock()
        elif not run.closed and ended:
            run.close()
        ahead = self.ahead()
        if ahead > AHEAD:
            return fresh
        begun = self.clock()
        block = run.block(hungry=ahead < HUNGRY and begun - self.began > SILENCE)
        if block is not None:
            self._send(run, block)
            self._took(begun)
        return fresh or block is not None

    # --- what comes -------------------------------------------------------------------------------------------------

    def _take(self) -> bool:
        """Moves into the run that is open; into another one when that has been played to its end."""
        wire = self.wire
        now, head = self.clock(), int(wire.seg_head)
        if head != self.queued:
            self.queued, self.grown = head, now
        if head == self.read:
            return False
        if self.run is not None and self.run.closed:
            if int(wire.state) != wires.REST or int(wire.seg_done) < self.read:
                return False
            self.run = None
        self.seen = now
        known = self.curves()
        count = min(head - self.read, AT_ONCE if known is None else AT_ONCE_OF_CURVES)
        moves = np.array([wire.segment[k % wires.SEGMENTS] for k in range(self.read, self.read + count)])
        silent = now - self.grown > SILENCE or count == AT_ONCE_OF_CURVES
        runs = [] if known is None or silent else known.runs(moves)
        if known is not None and runs and runs[-1][2] == count:
            line, first, _ = runs[-1]
            moves = moves if known.whole(line, moves[first:]) else moves[:first]  # the others of its block come
            if not len(moves):
                return False
        last = moves["sync"][0] if self.run is None else self.run.moves[-1]["sync"]
        other = np.diff(moves["sync"], prepend=last) != 0  # such a move begins at rest
        waits = (moves["atspeed"] != 0) | (moves["indexer"] >= 0) | other | (moves["sync"] == wires.TAP)
        ends = np.flatnonzero(waits)
        if self.run is None:
            joints: Joints | None = None
            if self.mill.moved is not None:
                if int(wire.answered) != self.session:
                    return False
                found = wire.answer[:, : len(self.mill.moved.numbers)] * self.mill.linear
                joints = self.mill.moved.answering(found)
            ends = ends[ends > 0]
            self._settled()
            own = partial(LookAhead, self.limits, self.period, self.mill.axes, self.window, joints=joints)
            self.run = PlannedMotion(self.read, self.mill, own, self.overrides, joints)
            self.began = now
        if len(ends):
            moves = moves[: int(ends[0])]
        if len(moves):
            self.read += len(moves)
            curves = [curve_of(move, self.mill) for move in moves] if known is None else known.curves_of(moves)
            self.run.push(moves, curves)
        if len(ends) or self.run.moves[-1]["sync"] == wires.TAP:
            self.run.close()
        return True

    def _ended(self) -> bool:
        """Whether nothing else comes before motion is over: looked at before the moves that came are."""
        since, now = self.waits(), self.clock()
        if since is not None and since < now and (since > self.seen or now - self.news > SETTLE):
            return True
        full = int(self.wire.seg_head) - int(self.wire.seg_done) > MANY
        return now - self.news > SILENCE and not full

    # --- overrides --------------------------------------------------------------------------------------------------

    def _now(self) -> tuple[float, float, float]:
        wire, last = self.wire, self.overrides
        scales = [
            now if now > 0.0 else before
            for now, before in zip((wire.feed_scale, wire.rapid_scale), last[:2], strict=True)
        ]
        vlimit = float(wire.vlimit)
        return scales[0], scales[1], vlimit if vlimit > 0.0 else last[2]

    def _settled(self) -> None:
        self.wanted = self._now()
        self._under(self.wanted)

    def _under(self, overrides: tuple[float, float, float]) -> None:
        """Plan under these from now on."""
        self.overrides = overrides
        if self.run is not None:
            self.run.overrides = overrides

    def _overrides(self) -> None:
        """Plan again where an override or the largest velocity has changed, and stays."""
        now = self._now()
        if now != self.wanted:
            self.wanted, self.changed = now, self.clock()
        if now == self.overrides or self.run is None:
            return
        if self.clock() - self.changed < STEADY:
            return
        wire, run = self.wire, self.run
        if int(wire.state) == wires.STOPS:
            return
        if int(wire.state) == wires.REST:
            if not run.given:  # nothing of it is planned: else it is planned again when it moves
                self._settled()
            return
        batch = self.sent.get(int(wire.batch_now))
        if batch is None or batch.track is not run.track or batch.overrides != self.overrides:
            return  # it does not yet play what was planned last
        self._branch(batch, now)

    def _branch(self, batch: SentBatch, now: tuple[float, float, float]) -> None:
        """Plan from a piece somewhat ahead, in the state that the motion has there at the rate that it has now."""
        wire, run = self.wire, self.run
        assert run is not None
        rate = float(wire.rate)
        piece = int(wire.piece_now)
        old = batch.overrides
        here = piece - batch.piece
        if not 0 <= here < len(batch.sure) or rate <= 0.05:
            return
        lowest = min(1.0, *(a / b for a, b in zip(now, old, strict=True) if math.isfinite(b)))
        if abs(rate - 1.0) > 1e-9 and abs(rate - lowest) > 1e-6:
            return  # it is still slowing down, or this kind of move does not heed the override that has changed
        rate = 1.0 if abs(rate - 1.0) <= 1e-9 else lowest
        sure = batch.sure
        starts = np.concatenate([[0.0], np.cumsum(sure.span[here:])]) - float(wire.piece_t)
        when = rate * min(LOOKED_AT + TIMES * self.takes, FARTHEST)
        at = int(np.searchsorted(starts, when, side="right")) - 1
        if when > starts[-1] - self.period:
            return  # too near to the end of what is certain: the next batch
        t = when - float(starts[at]) if sure.straight[here + at] else float(sure.span[here + at])
        at += here
        s, feed, acceleration = sure.state(at, t)
        begun, other = self.clock(), copy(run)
        other.overrides = now
        try:
            other.restart(s, State(feed * rate, acceleration * rate * rate))
            block = other.block(soon=True)
        except SplinefeedError:
            block = None
        if block is None:  # the motion of before goes on, slower where it must
            self.changed = self.clock() + 20 * STEADY
            return
        self.run = other
        self._under(now)
        self.after = batch.piece + at
        self._send(other, block, rate=rate, at=t)
        self._took(begun)

    def _took(self, begun: float) -> None:
        """Note how long the last batch took to plan since a time, s."""
        self.takes += 0.3 * (self.clock() - begun - self.takes)

    # --- what goes --------------------------------------------------------------------------------------------------

    def ahead(self) -> float:
        """Certain motion that the player has not played, s."""
        now = int(self.wire.batch_now)
        total = sum(float(batch.sure.span.sum()) for k, batch in self.sent.items() if k > now)
        if int(self.wire.state) == wires.MOVES and now in self.sent:
            batch = self.sent[now]
            total += float(batch.sure.span[max(int(self.wire.piece_now) - batch.piece, 0) :].sum() - self.wire.piece_t)
        return total

    def _quintics(self, run: PlannedMotion, block: MotionBlock) -> Quintics:
        return quintics(run.track, run.track.place(run.base + block.curve, block.offset), block.law)

    def _send(self, run: PlannedMotion, block: MotionBlock, rate: float = 0.0, at: float = LATEST) -> None:
        """A block of certain motion, and the stop behind it; it follows at a time in the piece before, s."""
        wire, track = self.wire, run.track
        sure, stop = self._quintics(run, block), run.look.stop
        parts = [sure] if stop is None else [sure, self._quintics(run, stop)]
        h, c = np.concatenate([part.span for part in parts]), np.concatenate([part.c for part in parts])
        middle = np.concatenate([part.middle for part in parts])
        n, end = len(h), parts[-1].end[0]
        if self.piece + n - int(wire.piece_now) > wires.PIECES:
            raise SplinefeedError(f"{n} pieces of motion at once are more than the player holds")
        numbers = track.segments(middle)
        moves = np.array([run.moves[k] for k in (numbers - run.first).tolist()])
        scale = feeds_of(moves, self.mill, *self.overrides)[1]
        ring = (self.piece + np.arange(n)) % wires.PIECES
        rows = wire.piece
        rows["c"][ring] = 0.0
        c, own = c * self.inverse[:, None], len(self.mill.axes)
        rows["c"][ring[:, None], self.mill.columns] = c[:, :own]
        wire.joints_of[ring[:, None], np.arange(c.shape[1] - own)] = c[:, own:]
        rest = np.setdiff1d(np.arange(wires.AXES), self.mill.columns)
        rows["c"][ring[:, None], rest, 0] = wire.rest[rest]
        for name, values in (("span", h), ("scale", scale), ("segment", numbers)):
            rows[name][ring] = values
        row = wire.batch[self.head % wires.BATCHES : self.head % wires.BATCHES + 1]
        whole = len(parts) == 1 and run.closed and end > track.length - 1e-6
        row["piece"], row["n"], row["sure"], row["epoch"] = self.piece, n, len(sure), self.epoch
        still = rate == 0.0 and block.law.coefficients[0, 1] == 0.0
        row["from_rest"] = (1 if run.begins else 2) if still else 0
        row["after"], row["at"], row["rate"], run.begins = max(self.after, 0), at, rate, False
        row["done"] = self.read if whole else int(track.segments(np.array([end]))[0])
        row["vlimit"] = min(self.overrides[2], 1e9)
        self.sent[self.head] = SentBatch(track, self.piece, self.piece + n, sure, end, self.overrides)
        for k in [k for k in self.sent if k < int(wire.batch_now) - 1]:
            del self.sent[k]
        self.head += 1
        wire.store("batch_head", self.head)
        self.after, run.done = self.piece + len(sure) - 1, sure.end[0]
        self.piece += n

    def _own(self) -> list[int]:
        """Numbers of the batches of this run, each with a stop behind it, that were sent since it last was at rest."""
        return [k for k, batch in self.sent.items() if self.run is not None and batch.track is self.run.track]

    # --- what went wrong --------------------------------------------------------------------------------------------

    def _begin_again(self) -> None:
        """Real time counts nothing of what was sent: an abort, or a batch that came too late or was refused."""
        wire = self.wire
        why = int(wire.why)
        self.epoch = int(wire.epoch)
        if why == wires.WHY_REFUSED and self.run is not None:
            raise SplinefeedError(f"the player refused the motion, {wire.said.decode('ascii', 'replace')}")
        if why == wires.WHY_LATE and self.run is not None and not int(wire.seg_clear) > self.run.first:
            now = int(wire.batch_now)
            playing = self.sent.get(now)
            self.sent = {k: batch for k, batch in self.sent.items() if k <= now}
            self.stranded = int(wire.state) != wires.MOVES or playing is None or playing.track is not self.run.track
            if not self.stranded and playing is not None:  # it goes on as planned before: there is time to plan again
                self._under(playing.overrides)
                self.piece = playing.behind
                self.takes = min(2.0 * self.takes, FARTHEST)
                self.after = playing.piece + len(playing.sure) - 1
                s, feed, acceleration = playing.sure.end
                with suppress(SplinefeedError):
                    self.run.restart(s, State(feed, acceleration if feed > 0.0 else 0.0))
            return
        self.stranded = False
        self.read = max(self.read, int(wire.seg_clear))
        if why == wires.WHY_DROPPED or self.run is not None:
            self.run = None
        self.sent.clear()

    def _go_on_at_rest(self) -> None:
        """Where the stop has been played, plan on from there."""
        wire, run = self.wire, self.run
        assert run is not None
        self.stranded = int(wire.state) != wires.REST or max(self._own(), default=0) > int(wire.batch_now)
        if self.stranded:
            return
        batch = self.sent.get(int(wire.batch_now))
        s = 0.0 if batch is None or batch.track is not run.track else batch.stop
        self._settled()
        self.sent.clear()
        run.restart(s, State())
        run.begins = True
