"""Setpoints of other programs: a CSV with a column of times and one an axis, positions only."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from itertools import islice

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.files import table_text
from splinefeed.files.metadata import check_period, naming
from splinefeed.files.sizes import MAX_COORDINATE, MAX_TICKS
from splinefeed.files.source import check_file, count_lines
from splinefeed.files.table_text import AXES, OURS
from splinefeed.numbers import MOST
from splinefeed.records import Array, Setpoints

#: Lines that are looked at for names of columns and how many digits numbers have.
_LOOKED_AT = 2000
#: Latest time, s.
LATEST = 1e12
#: From this many decimals on a number has all its digits.
_FULL = 12


def is_foreign(path: str | os.PathLike[str]) -> bool:
    """Tell whether the file at `path` is named .csv, .txt or .tsv and was not written by splinefeed."""
    if os.path.splitext(path)[1].lower() not in (".csv", ".txt", ".tsv"):
        return False
    with check_file(path).open("rb") as stream:
        return not stream.read(len(OURS)).startswith(OURS.encode())


def read(
    path: str | os.PathLike[str], *, columns: Sequence[str] | None = None, period: float | None = None
) -> tuple[Setpoints, list[str]]:
    """Read setpoints of another program.

    Parameters
    ----------
    path : path
        The file: numbers between commas, semicolons, tabs or blanks, and NaN.
    columns : sequence of str, optional
        Names of the columns, for a file without: t, x, y, ... with a unit behind (t_ms, x [in], theta_deg); mm, s and
        degrees otherwise. By default the line above the numbers names them, or one above a line of units.
    period : float, optional
        s; by default the one of the times.

    Returns
    -------
    setpoints : Setpoints
        With NaN for u, s and feed.
    notes : list of str
        What had to be guessed, one sentence each.

    Raises
    ------
    FormatError
        For what is no such table, with the line.
    """
    file = check_file(path)
    with file.open(encoding="utf-8-sig", errors="replace") as stream:
        lines = [line.strip() for line in islice(stream, _LOOKED_AT)]
    words = [table_text.words(line.lstrip("# ")) for line in lines]
    first = next((k for k, line in enumerate(lines) if table_text.numbers(line)), None)
    if first is None:
        raise FormatError(f"{path}: holds no numbers in its first {len(lines)} lines")
    above = [row for line, row in zip(lines[:first], words, strict=False) if line]
    with naming(path):
        names = _names([list(columns)] if columns else above, len(words[first]))
    try:
        with warnings.catch_warnings(action="ignore"):  # of blank lines, which count for nothing
            rows = np.loadtxt(
                file,
                delimiter=next((each for each in ",;\t" if each in lines[first]), None),
                skiprows=first,
                ndmin=2,
                encoding="utf-8-sig",
                max_rows=min(MAX_TICKS, count_lines(file) + 1),  # it makes room for all of them beforehand
            )
    except ValueError as error:
        raise FormatError(f"{path}: is not a valid table of numbers: {str(error).split(';')[0]}") from None
    sample = [row for row in words[first:] if len(row) == len(words[first])]
    return _setpoints(rows, names, sample, period, path)


def _names(head: list[list[str]], count: int) -> dict[str, tuple[int, float]]:
    """Column and factor to mm, s or rad of t and of each axis, from the last line that names them, and units below."""
    fits = [len(row) == count and any(table_text.name(word)[0] == "t" for word in row) for row in head]
    if not any(fits):
        raise InputError(f"no line above the numbers names {count} columns, t among them; give --columns t,x,y")
    at = len(fits) - 1 - fits[::-1].index(True)
    below = next((row for row in head[at + 1 : at + 2] if len(row) == count), [""] * count)
    found = [table_text.name(word) for word in head[at]]
    said = [(name, unit or under.strip("[]() ")) for (name, unit), under in zip(found, below, strict=True)]
    names = table_text.columns(said, ("t", *AXES))
    if len(names) < 2:
        raise InputError(f"needs columns t and at least one of {', '.join(AXES)}; has {', '.join(head[at])[:80]}")
    return names


def _decimals(sample: list[list[str]], column: int) -> int:
    """Digits behind the point in a column, at most _FULL; _FULL if numbers have an exponent."""
    texts = [row[column].lower() for row in sample]
    if any("e" in text and "." in text for text in texts):
        return _FULL
    return min(_FULL, max(len(text.partition(".")[2]) for text in texts))


def _setpoints(
    rows: Array, names: dict[str, tuple[int, float]], sample: list[list[str]], period: float | None, path: object
) -> tuple[Setpoints, list[str]]:
    notes = []
    n = len(rows)
    beyond = np.any(np.abs(rows) > MOST, axis=1)  # of such numbers no periods and places can be made
    if beyond.any():
        raise FormatError(f"{path}: {_far(int(np.argmax(beyond)))}")
    if n < 2 and period is None:
        raise FormatError(f"{path}: a single setpoint gives no period; give --period")
    column, factor = names.pop("t")
    t = rows[:, column] * factor
    digit = factor * 10.0 ** -_decimals(sample, column)
    if period is None:
        period = _period(t, digit, path)
        notes.append(f"the times give a period of {period:.9g} s")
    even = t[0] + period * np.arange(n)
    if digit > factor * 10.0**-_FULL and bool(np.all(np.abs(t - even) <= 0.5001 * digit + 1e-9 * period)):
        t = even  # each time is the even one, rounded to the digits of the file
    axes = tuple(axis for axis in AXES if axis in names)
    position = np.column_stack([rows[:, names[axis][0]] * names[axis][1] for axis in axes])
    with naming(path):
        check_period(period)
        far = ~(np.abs(position) <= MAX_COORDINATE) & ~np.isnan(position)
        if far.any() or not np.abs(t[~np.isnan(t)]).max(initial=0.0) <= LATEST:
            raise InputError(_far(int(np.argmax(far.any(axis=1)))))
    decimals = min(_decimals(sample, names[axis][0]) for axis in axes)
    if decimals < _FULL:
        notes.append(
            f"the positions have {decimals} decimals; the differences carry their rounding, and --resolution "
            f"{10.0**-decimals:g} (in the unit of the file) would allow for it"
        )
    nothing = np.full(n, math.nan)
    points = Setpoints(
        t=t, curve=np.full(n, -1), u=nothing, s=nothing, feed=nothing, position=position, axes=axes, period=period,
        method="another program", settings={"file": os.fspath(str(path))},
    )  # fmt: skip
    return points, notes


def _far(row: int) -> str:
    return f"row {row + 1} of the numbers: goes beyond {MAX_COORDINATE:g} mm or rad, or {LATEST:g} s"


def _period(t: Array, digit: float, path: object) -> float:
    """The period that times with that last digit say: their mean step, or the middle one where some are astray."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(t)
    steps = steps[np.isfinite(steps)]
    if not len(steps):
        raise FormatError(f"{path}: column t: gives no period; give --period")
    mean = float(np.mean(steps))
    even = t[0] + mean * np.arange(len(t))
    middle = mean if bool(np.all(np.abs(t - even) <= digit + 1e-9 * abs(mean))) else float(np.median(steps))
    if not middle > 0.0:
        raise FormatError(f"{path}: column t: does not increase; give --period if it counts something else")
    return float(f"{middle:.9g}")
