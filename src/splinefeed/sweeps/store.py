"""The dataset that a sweep leaves: Parquet parts that are whole, a journal of each that is not, and their summary."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.files import json_values
from splinefeed.files.atomic import TEMPORARIES, write_text
from splinefeed.files.source import read_text
from splinefeed.formats import rows_parquet
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.sweeps.spec import Sweep
from splinefeed.sweeps.work import COLUMNS, DONE, FAILED, OVER, Row

#: Runs in one part of the dataset.
PART = 1000
#: Rows are synced to the disk so often, s: each sync takes some ms.
SYNCED = 0.1
#: Largest page of what a sweep is, and of a journal, bytes.
MOST_BYTES = 2**26
#: What a sweep's folder holds.
ABOUT, LOCK, PARTS = "sweep.json", "lock", "rows"

#: Numbers whose least and greatest values are reported, in the order of the table.
REPORTED = (
    "duration_s",
    "ripple_max",
    "chord_error_max_mm",
    "worst_share",
    "contour_error_max_mm",
    "tracking_error_max_mm",
)
#: Texts of errors that are reported, the most frequent first.
ERRORS = 10


def columns_of(sweep: Sweep) -> dict[str, str]:
    """Return name and kind of every column of the dataset: index, source, the settings that vary, and the results."""
    kinds = {"machine": "text", "corrections": "whole"}
    # the period stands among the results as period_s
    settings = {name: kinds.get(name, "number") for name in sweep.varied if name not in (*COLUMNS, "period")}
    return {"index": "whole", "source": "text", **settings, **COLUMNS}


class Store:
    """Keep the rows of one sweep in a folder, which one process holds at a time.

    Parameters
    ----------
    folder : path
        New, or that of the same sweep.
    sweep : Sweep
        Its runs.

    Attributes
    ----------
    done : (runs,) array of bool
        Which runs it has.

    Raises
    ------
    InputError
        For a folder that holds another sweep, or that another process works in.

    Notes
    -----
    Rows go to the journal of their part as they come, line by line, and from there to a Parquet file when all its runs
    are there. A part is written whole or not at all, and always from the same rows in the same order, so that the
    dataset does not tell who made it, when, or how often it was killed.
    """

    def __init__(self, folder: str | os.PathLike[str], sweep: Sweep) -> None:
        rows_parquet.libraries()
        self.folder, self.rows = Path(folder), Path(folder) / PARTS
        self.sweep = sweep
        self.columns = columns_of(sweep)
        self.done: BoolArray = np.zeros(len(sweep), dtype=np.bool_)
        self._sync_at = 0.0
        self._waiting: dict[int, dict[int, Row]] = {}  # rows of parts that are not whole
        try:
            self.rows.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(f"{folder}: cannot be made: {error.strerror or error}") from None

    def __enter__(self) -> Store:
        import fcntl

        self._lock = (self.folder / LOCK).open("ab")
        try:  # for as long as this process lives; the system lets go of it even after kill -9
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise InputError(f"{self.folder}: another sweep is at work in this folder; wait, or use another") from None
        try:
            for left in (*self.folder.glob(TEMPORARIES), *self.rows.glob(TEMPORARIES)):
                left.unlink()  # begun by a sweep that was killed
            self._check_same()
            self._load()
        except BaseException:
            self._lock.close()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        for number in self._waiting:
            with suppress(OSError), self._part(number, "jsonl").open("ab") as journal:
                os.fsync(journal.fileno())
        self._lock.close()

    def add(self, row: Row) -> None:
        """Keep a row: it survives the death of this process, and a power cut that comes SYNCED s later."""
        with self._part(row["index"] // PART, "jsonl").open("ab") as journal:
            journal.write(json.dumps(row).encode() + b"\n")
            journal.flush()
            if (now := time.monotonic()) >= self._sync_at:
                os.fsync(journal.fileno())
                self._sync_at = now + SYNCED
        self._keep(row)

    def _part(self, number: int, form: str) -> Path:
        return self.rows / f"part-{number:06d}.{form}"

    def _keep(self, row: Row) -> None:
        index = row["index"]
        number = index // PART
        self.done[index] = True
        rows = self._waiting.setdefault(number, {})
        rows[index] = row
        if len(rows) == min(PART, len(self.sweep) - number * PART):
            rows_parquet.write([rows[k] for k in sorted(rows)], self.columns, self._part(number, "parquet"))
            self._part(number, "jsonl").unlink()
            del self._waiting[number]

    def _check_same(self) -> None:
        about = self.folder / ABOUT
        if about.exists():
            if _about(self.folder)["digest"] != self.sweep.digest:
                raise InputError(
                    f"{self.folder}: holds another sweep, or its sources have changed since; use another folder"
                )
            return
        foreign = [each.name for each in self.folder.iterdir() if each.name not in (PARTS, LOCK)]
        if foreign:
            raise InputError(f"{self.folder}: is not a folder of a sweep: it holds {foreign[0]}; use another")
        page = {
            "name": self.sweep.name, "digest": self.sweep.digest, "runs": len(self.sweep), "seed": self.sweep.seed,
            "part": PART, "varied": list(self.sweep.varied), "columns": self.columns, "fixed": dict(self.sweep.fixed),
        }  # fmt: skip
        write_text(about, json.dumps(page, indent=2, default=str) + "\n")

    def _load(self) -> None:
        for file in self.rows.glob("part-*.parquet"):
            self.done[_indices(rows_parquet.read(file, PART), len(self.sweep), file)] = True
            file.with_suffix(".jsonl").unlink(missing_ok=True)
        for journal in sorted(self.rows.glob("part-*.jsonl")):
            rows = _lines(journal, len(self.sweep), self.columns)
            write_text(journal, "".join(f"{json.dumps(row)}\n" for row in rows))  # without a line that was cut off
            for row in rows:
                self._keep(row)


#: What the values of columns of each kind are.
_VALUES = {"number": (int, float), "whole": (int,), "text": (str,)}


def _is_row(row: Mapping[str, Any], runs: int, columns: Mapping[str, str]) -> bool:
    """Whether an object of a journal is one of `runs` rows: a number of a run, and values of the kinds of columns."""
    index = row.get("index")
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < runs:
        return False
    values = [(row.get(name), _VALUES[kind]) for name, kind in columns.items()]
    return all(value is None or (isinstance(value, kinds) and not isinstance(value, bool)) for value, kinds in values)


def _lines(journal: Path, runs: int, columns: Mapping[str, str]) -> list[Row]:
    """Rows of a journal of a sweep of so many runs; lines that are cut off or no rows are left out: they run again."""
    rows: list[Row] = []
    with suppress(FileNotFoundError):  # its part has become whole
        if journal.stat().st_size > MOST_BYTES:
            raise FormatError(f"{journal}: is larger than {MOST_BYTES // 2**20} MB; that is no journal of {PART} runs")
        if not journal.is_file():
            return rows
        for line in journal.read_bytes().split(b"\n")[:-1]:
            with suppress(ValueError, RecursionError):
                row = json.loads(line)
                if isinstance(row, dict) and _is_row(row, runs, columns):
                    rows.append(row)
    return rows


def _indices(rows: Mapping[str, Sequence[Any]], runs: int, file: Path) -> list[int]:
    """The numbers of the runs in a part; FormatError for a part of another dataset."""
    indices = rows.get("index", [])
    if not indices or not all(isinstance(each, int) and 0 <= each < runs for each in indices):
        raise FormatError(f"{file}: is no part of this sweep; take it away, and its runs are made again")
    return list(indices)


def _about(folder: Path) -> dict[str, Any]:
    """What a sweep's folder says of itself; FormatError for what says none of it."""
    file = folder / ABOUT
    text = json_values.text
    known: dict[str, json_values.Check] = {
        "name": text, "digest": text, "runs": json_values.whole, "seed": json_values.whole, "part": json_values.whole,
        "varied": json_values.names, "columns": json_values.anything, "fixed": json_values.anything,
    }  # fmt: skip
    try:
        about = json_values.parse(read_text(file, "the page of a sweep", MOST_BYTES), file)
        about = json_values.fields(about, str(file), known, tuple(known))
        if isinstance(about["columns"], dict) and set(about["columns"].values()) <= set(rows_parquet.KINDS):
            return about
    except (FormatError, TypeError) as error:
        raise FormatError(
            f"{folder}: is not a folder of a sweep; it has no {ABOUT} that can be read: {error}"
        ) from None
    raise FormatError(f"{folder}: is not a folder of a sweep: {ABOUT} names no columns")


def load(folder: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Load what a sweep's folder holds.

    Parameters
    ----------
    folder : path
        Of a `Store`.

    Returns
    -------
    about : dict
        What it says of itself.
    rows : dict of str to list
        All rows that it has, by column.

    Raises
    ------
    FormatError
        For a folder that is none of a sweep, and a part that is not sound.
    """
    place = Path(folder) / PARTS
    about = _about(Path(folder))
    runs = about["runs"]
    rows = [
        row for journal in sorted(place.glob("part-*.jsonl")) for row in _lines(journal, runs, about["columns"])
    ]  # first: they become parts
    columns: dict[str, list[Any]] = {name: [] for name in about["columns"]}
    for file in sorted(place.glob("part-*.parquet")):
        part = rows_parquet.read(file, PART)
        _indices(part, runs, file)
        if missing := [name for name in columns if name not in part]:
            raise FormatError(f"{file}: is no part of this sweep: it has no column {missing[0][:60]}")
        for name, values in columns.items():
            values += part[name]
    known = set(columns["index"])
    for row in sorted(rows, key=lambda row: int(row["index"])):
        if row["index"] not in known:
            known.add(row["index"])
            for name, values in columns.items():
                values.append(row.get(name))
    return about, columns


def settings_columns(about: Mapping[str, Any]) -> list[str]:
    """Return the columns that the sweep varies."""
    return [f"{name}_s" if name == "period" else name for name in about["varied"]]


def summary(about: Mapping[str, Any], rows: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """Count and summarize the rows of a sweep.

    Parameters
    ----------
    about : mapping
        What its folder says of itself.
    rows : mapping of str to sequence
        By column.

    Returns
    -------
    dict
        Counts by status, extremes of each number over the runs that gave one, and failures by kind.
    """
    status = Counter(rows["status"])
    kinds = Counter(
        (kind, error) for kind, error, state in zip(rows["error_kind"], rows["error"], rows["status"], strict=True)
        if state == FAILED
    )  # fmt: skip
    numbers: dict[str, Any] = {}
    for name in REPORTED:
        values = column(rows, name)
        if np.isfinite(values).any():
            least, most = int(np.nanargmin(values)), int(np.nanargmax(values))
            numbers[name] = {
                "least": float(values[least]), "least_run": rows["index"][least], "median": float(np.nanmedian(values)),
                "most": float(values[most]), "most_run": rows["index"][most],
            }  # fmt: skip
    front = pareto(rows)
    return {
        "name": about["name"],
        "runs": about["runs"],
        "there": len(rows["index"]),
        "ok": status[DONE],
        "not_kept": status[OVER],
        "failed": status[FAILED],
        "numbers": numbers,
        "failures": [
            {"kind": kind, "error": error, "runs": count} for (kind, error), count in kinds.most_common(ERRORS)
        ],
        "pareto": [{"index": rows["index"][k], "source": rows["source"][k]} for k in front],
    }


def column(rows: Mapping[str, Sequence[Any]], name: str) -> Array:
    """Return a column as numbers, (n,), NaN where there is none."""
    return np.array([np.nan if value is None else float(value) for value in rows[name]], dtype=np.float64)


def pareto(rows: Mapping[str, Sequence[Any]]) -> IntArray:
    """Find the rows that no other one beats in both cycle time and contour error.

    Parameters
    ----------
    rows : mapping of str to sequence
        By column, n each.

    Returns
    -------
    (k,) array of int
        By cycle time; empty without a machine.

    Notes
    -----
    Only runs that keep every limit count: it is easy to be fast without.
    """
    time, error = column(rows, "duration_s"), column(rows, "contour_error_max_mm")
    kept = np.array([status == DONE for status in rows["status"]], dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(time) & np.isfinite(error) & kept)
    order = known[np.lexsort((error[known], time[known]))]
    best = np.minimum.accumulate(np.append(np.inf, error[order]))  # of those that are faster
    return np.asarray(order[error[order] < best[:-1]], dtype=np.int64)
