"""The dataset that a sweep leaves: Parquet parts that are whole, and a journal of what is not in them yet."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.formats import rows_parquet
from splinefeed.formats.atomic import TEMPORARIES, atomic_write
from splinefeed.records import BoolArray
from splinefeed.sweeps.spec import Sweep
from splinefeed.sweeps.work import COLUMNS, Row

#: Runs in one part of the dataset.
PART = 1000
#: What a sweep's folder holds.
ABOUT, JOURNAL, LOCK, PARTS = "sweep.json", "journal.jsonl", "lock", "rows"
_TEXT_SETTINGS = {"strategy": "text", "method": "text", "machine": "text", "corrections": "whole"}


def columns_of(sweep: Sweep) -> dict[str, str]:
    """Name and kind of every column of the dataset: index, source, the settings that vary, and the results."""
    settings = {name: _TEXT_SETTINGS.get(name, "number") for name in sweep.varied if name not in COLUMNS}
    settings.pop("period", None)  # it stands among the results as period_s
    return {"index": "whole", "source": "text", **settings, **COLUMNS}


class Store:
    """The folder of one sweep, held by one process at a time; `done` says which runs it has.

    Rows go to a journal as they come, line by line, and from there to a Parquet part when all its runs are there. A
    part is written whole or not at all, and always from the same rows in the same order, so that the dataset does not
    tell who made it, when, or how often it was killed.
    Raises InputError for a folder that holds another sweep, or that another process works in.
    """

    def __init__(self, folder: str | os.PathLike[str], sweep: Sweep) -> None:
        rows_parquet.available()
        self.folder = Path(folder)
        self.sweep = sweep
        self.columns = columns_of(sweep)
        self.done: BoolArray = np.zeros(len(sweep), dtype=np.bool_)
        self._rows: dict[int, dict[int, Row]] = {}
        self._lock: BinaryIO | None = None
        self._journal: BinaryIO | None = None
        try:
            (self.folder / PARTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(f"{folder}: cannot be made: {error.strerror or error}") from None

    def __enter__(self) -> Store:
        self._take()
        try:
            self._check_same()
            self._load()
        except BaseException:
            self._release()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._release()

    def add(self, row: Row) -> None:
        """Keep a row: it survives whatever happens from here on but the loss of the disk."""
        assert self._journal is not None
        self._journal.write(json.dumps(row, allow_nan=True).encode() + b"\n")
        self._journal.flush()
        self._keep(row)

    def _keep(self, row: Row) -> None:
        index = int(row["index"])
        if self.done[index]:
            return
        self.done[index] = True
        part = self._rows.setdefault(index // PART, {})
        part[index] = row
        if len(part) == min(PART, len(self.sweep) - index // PART * PART):
            self._write_part(index // PART)

    def _write_part(self, number: int) -> None:
        rows = self._rows.pop(number)
        name = self.folder / PARTS / f"part-{number:06d}.parquet"
        rows_parquet.write([rows[index] for index in sorted(rows)], self.columns, name)

    def _take(self) -> None:
        """Lock the folder for as long as this process lives; the system lets go of it even after kill -9."""
        import fcntl

        lock = (self.folder / LOCK).open("ab")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            raise InputError(
                f"{self.folder}: another sweep is at work in this folder; wait for it, or use another"
            ) from None
        self._lock = lock
        for left in (*self.folder.glob(TEMPORARIES), *(self.folder / PARTS).glob(TEMPORARIES)):
            with suppress(OSError):  # begun by a sweep that was killed
                left.unlink()

    def _release(self) -> None:
        if self._journal is not None:
            self._journal.close()
            self._journal = None
            self._compact()
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def _compact(self) -> None:
        """Leave in the journal what no part holds."""
        left = [row for rows in self._rows.values() for row in rows.values()]
        with suppress(OSError, FormatError), atomic_write(self.folder / JOURNAL) as temporary:
            temporary.write_text("".join(f"{json.dumps(row)}\n" for row in left), encoding="utf-8")

    def _check_same(self) -> None:
        about = self.folder / ABOUT
        if about.exists():
            try:
                said = json.loads(about.read_text(encoding="utf-8"))
                digest = said["digest"]
            except (ValueError, KeyError, TypeError, OSError) as error:
                raise FormatError(f"{about}: cannot be read: {error}") from None
            if digest != self.sweep.digest:
                raise InputError(
                    f"{self.folder}: holds another sweep, or its sources have changed since; use another folder"
                )
            return
        foreign = [each.name for each in self.folder.iterdir() if each.name not in (PARTS, LOCK, JOURNAL)]
        if foreign:
            raise InputError(f"{self.folder}: is not a folder of a sweep: it holds {foreign[0]}; use another")
        page = {
            "name": self.sweep.name, "digest": self.sweep.digest, "runs": len(self.sweep), "seed": self.sweep.seed,
            "part": PART, "varied": list(self.sweep.varied), "columns": self.columns,
            "fixed": {name: value for name, value in self.sweep.fixed.items()},
        }  # fmt: skip
        with atomic_write(about) as temporary:
            temporary.write_text(json.dumps(page, indent=2, default=str) + "\n", encoding="utf-8")

    def _load(self) -> None:
        for file in sorted((self.folder / PARTS).glob("part-*.parquet")):
            self.done[np.array(rows_parquet.read([file])["index"], dtype=np.int64)] = True
        journal = self.folder / JOURNAL
        for row in _lines(journal):
            if 0 <= int(row.get("index", -1)) < len(self.sweep):
                self._keep(row)
        self._compact()
        self._journal = journal.open("ab")


def _lines(journal: Path) -> Iterator[Row]:
    """Rows of a journal; a last line that was cut off is left out."""
    if not journal.exists():
        return
    with journal.open("rb") as stream:
        for line in stream:
            if not line.endswith(b"\n"):
                return
            with suppress(ValueError):
                row = json.loads(line)
                if isinstance(row, dict):
                    yield row


def load(folder: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """What a sweep's folder says of itself, and all rows that it has as columns, by index."""
    place = Path(folder)
    try:
        about = json.loads((place / ABOUT).read_text(encoding="utf-8"))
        columns = about["columns"]
    except (OSError, ValueError, KeyError, TypeError):
        raise FormatError(f"{folder}: is not a folder of a sweep; it has no {ABOUT} that can be read") from None
    whole = rows_parquet.read(sorted((place / PARTS).glob("part-*.parquet"))) or {name: [] for name in columns}
    known = set(whole["index"])
    for row in sorted(_lines(place / JOURNAL), key=lambda row: int(row["index"])):
        if row["index"] not in known:
            known.add(row["index"])
            for name in columns:
                whole[name].append(row.get(name))
    return about, whole


def settings_columns(about: Mapping[str, Any]) -> list[str]:
    """The columns that the sweep varies."""
    return [f"{name}_s" if name == "period" else name for name in about["varied"]]
