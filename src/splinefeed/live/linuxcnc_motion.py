"""Moves of LinuxCNC that are one motion from rest to rest: made smooth as they come, and planned block by block."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.kinematics.with_joints import Joints
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_moves import BLEND, POINT, STOP, feeds_of, size_of
from splinefeed.live.linuxcnc_pieces import PlannedTrack, portions
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.smoothing import Smoother
from splinefeed.planner.stream import LookAhead, MotionBlock
from splinefeed.records import State

#: The path goes to look-ahead in parts that take so long, s, at the feeds of the program, and so far ahead, s; for a
#: change of the override so far beyond twice what a stop takes, s: less is planned and sent sooner.
PORTION, KNOWN, SOON = 0.5, 3.0, 0.8
#: Curves that are smoothed in one go.
SMOOTH = 200


class PlannedMotion:
    """Moves that are one motion from rest to rest: smoothed and planned as they come.

    Parameters
    ----------
    first : int
        Number of its first move.
    mill : Mill
        The machine.
    look_ahead : callable
        Makes a LookAhead for it, from its start or `start=` a state.
    overrides : tuple of float
        That it is planned under: of feeds and rapid moves, and the largest velocity.
    joints : Joints, optional
        That are no axes.

    Attributes
    ----------
    closed : bool
        Whether all of its moves have come.
    """

    def __init__(
        self, first: int, mill: Mill, look_ahead: Callable[..., LookAhead],
        overrides: tuple[float, float, float], joints: Joints | None = None,
    ) -> None:  # fmt: skip
        self.first, self.mill, self.look_ahead, self.overrides = first, mill, look_ahead, overrides
        self.track = PlannedTrack(first, joints)
        self.smoother = Smoother("program", mill.axes, corners="round", window=SMOOTH)
        self.closed = False
        self.moves: list[Any] = []  # all of them: an override that changes changes their feeds
        self.look = look_ahead()
        self.base = 0  # curves of the track before the first that `look` knows
        self.given = 0  # parts of the track that `look` knows, and before
        self.times: list[float] = []  # what each part takes at the feeds of the program, s
        self.done = 0.0  # up to where motion is certain, mm
        self.coming: Iterator[MotionBlock] | None = None
        self.planned = False  # all that came is planned to its end
        stop = mill.velocity / mill.acceleration + mill.acceleration / mill.jerk
        self.soon = SOON + 2.0 * float(np.max(stop))
        self.begins = True  # the next batch is the first one from rest

    def push(self, moves: Any, curves: Sequence[NurbsCurve]) -> None:
        """Take moves (rows of wire.SEGMENT) along curves; those that are none count as ends of the ones before."""
        mill = self.mill
        feeds = np.array(feeds_of(moves, mill, 1.0, 1.0, math.inf)[0])
        blends = np.where(moves["tolerance"] > 0.0, moves["tolerance"] * mill.linear, math.inf)
        tolerances = np.where(moves["term"] == BLEND, blends, 0.0)
        markers = [Marker(k + 1) for k in np.flatnonzero(moves["term"] == STOP).tolist() if k + 1 < len(curves)]
        if self.moves and self.moves[-1]["term"] == STOP:
            markers.insert(0, Marker(0))
        self.moves += list(moves)
        path = Path(curves, mill.axes, feeds=feeds, tolerances=tolerances, markers=markers, tolerance=POINT)
        moving = np.array([size_of(move, mill) > POINT for move in moves])
        self.track.push(np.where(moving, np.diff(path.curve_starts), 0.0))
        self._give(self.smoother.push(path))

    def close(self) -> None:
        """No other moves follow: what is left leads to rest."""
        self._give(self.smoother.finish())
        self.closed = True

    def _give(self, paths: list[Path]) -> None:
        for path, origins in zip(paths, self.smoother.origins, strict=True):
            moves = np.array([self.moves[k] for k in origins.tolist()])
            tip = np.diff(path.tip_length(path.curve_starts))  # whose feed it is, where it moves
            way = np.where(tip > POINT, tip, np.diff(path.curve_starts))
            times = way / feeds_of(moves, self.mill, 1.0, 1.0, math.inf)[0]
            whole = moves["sync"][0] == wires.TAP  # which the player goes back over: one batch
            for part, own in portions(path, origins, times, math.inf if whole else PORTION):
                self.track.add(part, own)
                self.times.append(part.length / path.length * float(times.sum()))
        self.planned = False

    def _offer(self) -> None:
        """One more part of the path to look-ahead."""
        self.look.take(self.at_feeds(self.track.parts[self.given], self.track.moves[self.given]))
        self.given, self.planned = self.given + 1, False

    def at_feeds(self, path: Path, origins: Any) -> Path:
        """A part under the feeds that hold now."""
        moves = np.array([self.moves[k] for k in origins.tolist()])
        feeds, _ = feeds_of(moves, self.mill, *self.overrides)
        return path.with_feeds(feeds)

    def restart(self, s: float, state: State) -> None:
        """Plan again from a place on the track, mm, in a state there."""
        track = self.track
        if not track.parts:  # it has not begun
            return
        first = track.part_at(s)
        self.look = self.look_ahead(start=State(state.feed, state.acceleration, max(s - track.starts[first], 0.0)))
        self.base, self.given, self.done = track.curves[first], first, s
        self.coming, self.planned = None, False

    def block(self, *, hungry: bool = False, soon: bool = False) -> MotionBlock | None:
        """Plan the next block of motion.

        Parameters
        ----------
        hungry : bool, optional
            Whether not even a full window may be there.
        soon : bool, optional
            Whether a window is not waited for: it costs time.

        Returns
        -------
        MotionBlock or None
            None where nothing more can be planned yet.
        """
        track, count = self.track, len(self.track.parts)
        begun = track.part_at(self.done) if count else 0
        known = (self.soon if soon else KNOWN) * min(self.overrides[0], 1.0)
        if count:  # from the start of that part on
            known += self.times[begun] * (self.done - track.starts[begun]) / track.parts[begun].length
        while True:
            while self.given < count and (self.given <= begun or sum(self.times[begun : self.given]) < known):
                self._offer()
            if self.coming is None and (self.planned or soon):
                if self.given < count and not soon:  # what is known is not enough for a window
                    self._offer()
                elif count and (self.given < count or not self.closed) and (hungry or soon):
                    return next(self.look.blocks(early=True), None)
                elif self.planned:
                    return None
            if self.coming is None:
                whole = self.closed and self.given == count
                self.coming, self.planned = self.look.blocks(whole=whole), True  # until more is given
            block = next(self.coming, None)
            if block is not None:
                return block
            self.coming = None
