"""What rows are streamed into: the protocol that every sink keeps, the rows, and how they are written as text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from splinefeed.formats.metadata import to_degrees
from splinefeed.records import Array

#: Rows made at a time where a clock takes them, a share of the buffer but no fewer: how soon a change of the override
#: takes effect.
BATCH_SHARE, LEAST_ROWS = 1.0 / 16.0, 8
#: A clock starts when this many fewer rows are there than are kept ahead, at least.
SPARE_ROWS = 20


def batch_rows(ahead: int) -> int:
    """Rows made at a time for a clock that `ahead` rows are kept ahead of."""
    return max(int(BATCH_SHARE * ahead), LEAST_ROWS)


def starting_rows(ahead: int) -> int:
    """Rows with which that clock starts: the producer waits until there is room for a whole batch."""
    return max(ahead - max(batch_rows(ahead), SPARE_ROWS), 1)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a stream in order.

    first     number of the first one; the first row of a stream is 1
    position  (n, axes)  mm, rotary axes rad
    last      whether the last of them is the last row of the stream, on which the axes stay
    """

    first: int
    position: Array
    axes: tuple[str, ...]
    last: bool = False

    def __len__(self) -> int:
        return len(self.position)

    def text(self) -> str:
        """One line a row, `row x y ... last`, as `halstreamer` takes them: 17 digits, rotary axes in degrees."""
        count = len(self)
        values = to_degrees(self.position, self.axes).tolist()
        lines = []
        for k, row in enumerate(values):
            last = int(self.last and k == count - 1)
            lines.append(" ".join([str(self.first + k), *(f"{value:.17g}" for value in row), str(last)]))
        return "\n".join(lines) + "\n" if lines else ""


@dataclass(frozen=True)
class Taken:
    """The state of a sink's consumer.

    row        the last row that it has confirmed; 0 if none
    underruns  periods in which it wanted a row and there was none
    override   the rate set at the controller, negative backwards; None where it has no override
    dry        whether it has run out of rows and waits for `restart`: rows behind `row` were not taken
    """

    row: int
    underruns: int = 0
    override: float | None = None
    dry: bool = False


class Sink(Protocol):
    """Where the rows go.

    paced  whether rows are taken by a clock, so that only so many may be sent ahead
    """

    paced: bool

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin; start (axes,) is where the first row is. Returns where the axes are, `start` if that is not known."""

    def write(self, rows: Rows) -> None:
        """Take more rows; may wait for room."""

    def depth(self) -> int:
        """Rows that were written and are not confirmed yet; 0 where nothing is confirmed but by writing."""

    def restart(self) -> None:
        """Resume after `dry`: the next row written is the one behind `taken().row`, and begins at rest."""

    def close(self) -> Taken:
        """Wait until every row is taken, and end."""

    def abandon(self) -> None:
        """End at once, after an error; leave nothing half-written."""

    def taken(self) -> Taken:
        """What the consumer has confirmed by now."""
