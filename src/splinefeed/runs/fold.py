"""One pass over setpoints in chunks: meters that each see every chunk once, in order, however long the motion is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from splinefeed.errors import InputError
from splinefeed.paths.track import Track
from splinefeed.records import Setpoints, TimeLaw

#: Ticks of a chunk.
CHUNK = 16_384
#: Ticks on both sides of a chunk that its meters may use: what a third difference needs.
NEIGHBOURS = 2


@dataclass(frozen=True, eq=False)
class Chunk:
    """Setpoints that follow each other, with the path and the law that they are measured by.

    Parameters
    ----------
    own : Setpoints
        The setpoints; t, s and curve count from the start of the motion.
    around : Setpoints
        They and up to NEIGHBOURS ticks on both sides, on `path` by `law`: t, s and curve count from their starts.
    first : int
        Index in `around` at which `own` begins.
    path : Track
        The whole path, or the parts of it that `around` lies on.
    law : TimeLaw
        Its time law, or that over these parts.
    """

    own: Setpoints
    around: Setpoints
    first: int
    path: Track
    law: TimeLaw

    @property
    def inner(self) -> slice:
        """Where `own` is in `around`."""
        return slice(self.first, self.first + len(self.own))


class Meter(Protocol):
    """What measures a motion, or writes it: `start` before the first chunk, `feed` each, `finish` at the end.

    What it found it has as attributes. `start` and `finish` do nothing unless a meter says what.
    """

    def start(self, chunk: Chunk) -> None:
        """See the first chunk, which `feed` gets, too."""
        return

    def feed(self, chunk: Chunk) -> None:
        """See the next chunk."""

    def finish(self) -> None:
        """Know that there are no more chunks."""
        return


def fold(chunks: Iterable[Chunk], meters: Sequence[Meter]) -> int:
    """Show every chunk to every meter, and count the ticks.

    Parameters
    ----------
    chunks : iterable of Chunk
        Of a motion, in order.
    meters : sequence of Meter
        Each sees `start` before the first chunk, `feed` each, and `finish` at the end.

    Returns
    -------
    int
        Ticks of all chunks.

    Raises
    ------
    InputError
        Where there are no setpoints.
    """
    count = 0
    for chunk in chunks:
        for meter in meters:
            if not count:
                meter.start(chunk)
            meter.feed(chunk)
        count += len(chunk.own)
    if not count:
        raise InputError("there are no setpoints to measure")
    for meter in meters:
        meter.finish()
    return count


def on_one_path(setpoints: Iterable[Setpoints], path: Track, law: TimeLaw) -> Iterator[Chunk]:
    """Pair setpoints of a path that is there as a whole with the ticks before and behind them.

    Parameters
    ----------
    setpoints : iterable of Setpoints
        Chunks, in order.
    path, law : Track, TimeLaw
        What they were made from.

    Yields
    ------
    Chunk
        For each chunk that has ticks.
    """
    for around, first, own in with_neighbours(setpoints):
        yield Chunk(own, around, first, path, law)


def with_neighbours(chunks: Iterable[Setpoints]) -> Iterator[tuple[Setpoints, int, Setpoints]]:
    """Pair each chunk that has ticks with those before and behind it.

    Parameters
    ----------
    chunks : iterable of Setpoints
        In order.

    Yields
    ------
    around : Setpoints
        The chunk with up to NEIGHBOURS ticks on both sides.
    first : int
        Index in `around` at which the chunk begins.
    chunk : Setpoints
        By itself.
    """
    before: list[Setpoints] = []
    held: Setpoints | None = None
    for chunk in chunks:
        if not len(chunk):
            continue
        if held is not None:
            yield Setpoints.joined([*before, held, chunk.part(0, NEIGHBOURS)]), sum(map(len, before)), held
            both = Setpoints.joined([*before, held])
            before = [both.part(max(len(both) - NEIGHBOURS, 0), len(both))]
        held = chunk
    if held is not None:
        yield Setpoints.joined([*before, held]), sum(map(len, before)), held
