"""Setpoints as text: CSV, and for controllers rows of the halstreamer of LinuxCNC and PVT tables.

All numbers have 17 significant digits, so that doubles arrive unchanged; rotary axes are in degrees.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.files.metadata import (
    Sink,
    axes_of,
    axis_units,
    by_name,
    column_names,
    columns_of,
    description,
    settings_of,
    write_rows,
)
from splinefeed.files.sizes import MAX_TICKS
from splinefeed.files.table_text import OURS
from splinefeed.records import Array, IntArray, Setpoints

_METADATA = "# metadata: "
#: More than the longest last line of a CSV, bytes.
_TAIL = 64
#: Fields that a streamer component takes.
MAX_FIELDS = 21
#: A feed below this share of the largest is rest: what is left of it is rounding.
ROUNDING = 1e-12
#: A last step that differs from the period by more than this part of it is worth a comment.
SHORT = 1e-6
#: Ticks that one velocity is taken from, and steps that are worked on at once.
STENCIL, _STEPS = 5, 2**16


def write_csv(file: Path) -> Sink[Setpoints]:
    """Write chunks of setpoints, with metadata in lines that begin with #."""
    ticks = 0
    with file.open("w", encoding="ascii", newline="\n") as stream:
        while (chunk := (yield)) is not None:
            if ticks == 0:
                names = ",".join(column_names(chunk.axes, "deg", chunk.settings))
                stream.write(f"{OURS}\n{_METADATA}{json.dumps(description(chunk, 'deg'))}\n{names}\n")
            write_rows(stream, columns_of(chunk), ",", whole=(1,))
            ticks += len(chunk)
        # without it a file that was cut off between two lines would pass for a whole one
        stream.write(f"# end: {ticks} ticks\n")


def read_csv(file: Path) -> tuple[dict[str, Any], Any]:
    """Read columns and description of a CSV that `write_csv` wrote."""
    with file.open("rb") as tail:
        tail.seek(-min(_TAIL, file.stat().st_size), 2)
        end = re.search(rb"\n# end: ([0-9]{1,12}) ticks\n\Z", tail.read())
    with file.open(encoding="ascii") as stream:
        if stream.readline() != f"{OURS}\n":
            raise InputError(f"line 1: expected {OURS!r}; was this written by splinefeed?")
        line = stream.readline()
        if not line.startswith(_METADATA):
            raise InputError(f"line 2: expected {_METADATA!r}")
        said = json.loads(line.removeprefix(_METADATA))
        names = column_names(axes_of(said), "deg", settings_of(said))
        if stream.readline().strip() != ",".join(names):
            raise InputError(f"line 3: expected the column names {','.join(names)}")
        if end is None or int(end[1]) > MAX_TICKS:
            raise InputError("the last line does not say how many setpoints there are; the file looks cut off")
        rows = np.loadtxt(stream, delimiter=",", ndmin=2)
    if rows.shape != (int(end[1]), len(names)):
        raise InputError(f"has {rows.shape} rows and columns; expected {(int(end[1]), len(names))}")
    columns = by_name([*rows.T])
    curve = columns["curve"]
    if not np.all((curve == np.rint(curve)) & (np.abs(curve) < 2**31)):
        raise InputError("column curve: holds something other than whole numbers")
    return columns, said


def cfg(axes: tuple[str, ...]) -> str:
    """Return the letters of the streamer's `cfg=` for axes: u for the row, f for each axis, b for the last flag."""
    return f"u{'f' * len(axes)}b"


def write_halstreamer(file: Path) -> Sink[Setpoints]:
    """Write chunks of setpoints as the text that `halstreamer` feeds to a HAL streamer, one row a servo period.

    Parameters
    ----------
    file : Path
        To write.

    Yields
    ------
    None
        Chunks of setpoints are sent in; None ends the file.

    Notes
    -----
    A row is `row x y ... last` between blanks: its number from 1, the axes, and a bit that is 1 on the last row, which
    appears twice; see docs/setpoint-files.md. A plan whose last step is a short one says so in a comment.
    """
    count, times = 0, np.empty(0)
    with file.open("w", encoding="ascii", newline="\n") as stream:

        def put(rows: Array, last: bool) -> None:
            numbers = np.arange(count + 1, count + len(rows) + 1)
            write_rows(stream, [numbers, *rows.T, np.full(len(rows), last)], " ", whole=(0, 1 + rows.shape[1]))

        while (chunk := (yield)) is not None:
            if not len(times):
                units, period = axis_units(chunk.axes, "deg"), chunk.period
                axes = " ".join(f"{axis}_{unit}" for axis, unit in zip(chunk.axes, units, strict=True))
                every = f"one row every {chunk.period:.17g} s, last row repeated"
                stream.write(f"# row {axes} last   (cfg={cfg(chunk.axes)}, {every})\n")
                held = chunk.position[:0]
            rows = np.concatenate([held, chunk.position])
            put(rows[:-1], False)
            count, held, times = count + len(rows) - 1, rows[-1:], np.append(times, chunk.t)[-2:]
        step = float(times[-1] - times[0])
        if len(times) > 1 and abs(step - period) > SHORT * period:
            stream.write(f"# the plan takes {step:.9g} s for the last step, the streamer one period\n")
        put(np.concatenate([held, held]), True)


def write_pvt(points: Setpoints, file: Path) -> None:
    """Write the steps between setpoints.

    Parameters
    ----------
    points : Setpoints
        Of every tick.
    file : Path
        To write.

    Raises
    ------
    InputError
        For fewer than two, or ticks that do not follow each other.

    Notes
    -----
    One line a step, `dt, dx, vx, dy, vy, ...`, as Newport's XPS controllers have it: dt in s; dx the way from the tick
    before, vx the velocity at the end of the step, in mm and mm/s, rotary axes in degrees and degrees/s.
    """
    if len(points) < 2:
        raise InputError("one tick is no step; a PVT table needs at least two ticks")
    if not np.all(np.diff(points.t) > 0.0):
        raise InputError("t does not grow from tick to tick; a PVT table needs steps longer than 0")
    with file.open("w", encoding="ascii", newline="\n") as stream:
        for start in range(1, len(points), _STEPS):
            places = np.arange(start, min(start + _STEPS, len(points)))
            way = points.position[places] - points.position[places - 1]
            pairs = np.stack([way, _velocity(points, places)], axis=2).reshape(len(places), -1)
            write_rows(stream, [points.t[places] - points.t[places - 1], *pairs.T], ", ")


def _velocity(ticks: Setpoints, places: IntArray) -> Array:
    """Estimate velocities at ticks; 0 where the planned feed is 0 but for rounding.

    Parameters
    ----------
    ticks : Setpoints
        Five of them or fewer count for each.
    places : (n,) array of int
        The ticks i.

    Returns
    -------
    (n, axes) array
        mm/s or deg/s.

    Notes
    -----
    The derivative of the polynomial of degree 4 through five neighbouring ticks j [1]_, with an error of T^4 q^(5) / 30
    at most in the middle:

        q'(t_i) = sum over j != i of (w_j / w_i) (q_j - q_i) / (t_i - t_j),   w_j = 1 / prod over m != j of (t_j - t_m)

    References
    ----------
    .. [1] Berrut and Trefethen, SIAM Review 46 (2004), 501-517, doi:10.1137/S0036144502417715.
    """
    count = min(STENCIL, len(ticks))
    left = np.clip(places - count // 2, 0, len(ticks) - count)
    index = left[:, None] + np.arange(count)
    own = index == places[:, None]
    t = ticks.t[index]  # (n, count)
    apart = t[:, :, None] - t[:, None, :]
    apart[:, np.arange(count), np.arange(count)] = 1.0
    w = 1.0 / np.prod(apart, axis=2)
    weights = np.where(own, 0.0, w / w[own][:, None] / np.where(own, 1.0, ticks.t[places][:, None] - t))
    way = ticks.position[index] - ticks.position[places][:, None]
    velocity: Array = np.einsum("nj,nja->na", weights, way)
    velocity[np.abs(ticks.feed[places]) <= ROUNDING * np.max(np.abs(ticks.feed))] = 0.0  # q' = (dq/ds) feed
    return velocity
