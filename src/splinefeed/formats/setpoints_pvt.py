"""Setpoints as a PVT table: for every step how long it takes, how far each axis goes, and how fast it is at its end.

The form is that of Newport's XPS controllers, which PVT interpreters of other makers take with little or no change:
one line a step, `dt, dx, vx, dy, vy, ...`, nothing else in the file. dt in s; dx the way from the tick before, vx the
velocity at the end of the step, in mm and mm/s, rotary axes in degrees and degrees/s. The table starts where the first
tick is, at rest or with the velocity that the planned feed has there.

The velocity is the derivative of the polynomial of degree 4 through five neighbouring ticks, with an error of
T^4 q^(5) / 30 at most in the middle, and 0 where the planned feed is 0. Source of the weights: Fornberg, Math. Comp. 51
(1988), 699-706, doi:10.1090/S0025-5718-1988-0935077-0, here by Lagrange's formula.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import checked_chunks, to_degrees, write_rows
from splinefeed.records import Array, IntArray, Setpoints

#: Ticks that one velocity is taken from.
STENCIL = 5


class _Ticks(NamedTuple):
    """t (n,), feed (n,), position (n, axes), rotary axes in degrees."""

    t: Array
    feed: Array
    position: Array


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write the steps between setpoints, given whole or as an iterable of chunks of which one is in memory at a time.

    Raises FormatError for fewer than two ticks, and for ticks that do not follow each other in time.
    """
    with atomic_write(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
        steps = 0
        for t, position, velocity in _with_velocity(_ticks(record, path)):
            pairs = np.stack([np.diff(position, axis=0), velocity], axis=2).reshape(len(velocity), -1)
            write_rows(stream, [np.diff(t), *pairs.T], ", ")
            steps += len(t) - 1
        if steps == 0:
            raise FormatError(f"{path}: one tick is no step; a PVT table needs at least two ticks")


def _ticks(record: Setpoints | Iterable[Setpoints], path: object) -> Iterator[_Ticks]:
    before = -np.inf
    for chunk in checked_chunks(record, path):
        if len(chunk) == 0:
            continue
        if not (chunk.t[0] > before and np.all(np.diff(chunk.t) > 0.0)):
            raise FormatError(f"{path}: t does not grow from tick to tick; a PVT table needs steps longer than 0")
        before = float(chunk.t[-1])
        yield _Ticks(chunk.t, chunk.feed, to_degrees(chunk.position, chunk.axes))


def _with_velocity(chunks: Iterable[_Ticks]) -> Iterator[tuple[Array, Array, Array]]:
    """t (n + 1,) and position (n + 1, axes) of runs of ticks, and velocity (n, axes) at all but the first of a run.

    A run begins with the last tick of the one before; two ticks on either side of it are held back for its velocity.
    """
    held: _Ticks | None = None
    done = 0  # ticks of `held` that were given out already; they are there for the velocity of others
    for chunk in chunks:
        held = chunk if held is None else _Ticks(*map(np.concatenate, zip(held, chunk, strict=True)))
        ready = len(held.t) - STENCIL // 2
        if ready > max(done, 1) and len(held.t) >= STENCIL:
            yield _run(held, max(done, 1), ready)
            keep = max(ready - STENCIL, 0)  # so many that the last ticks, too, find four others
            held, done = _Ticks(*(each[keep:] for each in held)), ready - keep
    if held is not None and len(held.t) > max(done, 1):
        yield _run(held, max(done, 1), len(held.t))


def _run(ticks: _Ticks, first: int, end: int) -> tuple[Array, Array, Array]:
    places = np.arange(first, end)
    part = slice(first - 1, end)
    return ticks.t[part], ticks.position[part], _velocity(ticks, places)


def _velocity(ticks: _Ticks, places: IntArray) -> Array:
    """Velocity (n, axes) at the ticks `places` (n,): sum_j q_j L_j'(t) over the nearest STENCIL ticks."""
    count = min(STENCIL, len(ticks.t))
    left = np.clip(places - count // 2, 0, len(ticks.t) - count)
    index = left[:, None] + np.arange(count)
    t = ticks.t[index]  # (n, count)
    # about the tick itself, so that the differences of positions keep their digits
    position = ticks.position[index] - ticks.position[places][:, None]
    at = ticks.t[places]
    weights = np.zeros_like(t)
    for j in range(count):
        others = [m for m in range(count) if m != j]
        denominator = np.prod(t[:, [j]] - t[:, others], axis=1)
        for left_out in others:
            rest = [m for m in others if m != left_out]
            weights[:, j] += np.prod(at[:, None] - t[:, rest], axis=1) / denominator
    velocity: Array = np.einsum("nj,nja->na", weights, position)
    velocity[ticks.feed[places] == 0.0] = 0.0  # q' = (dq/ds) feed
    return velocity
