"""What was planned before: settings, numbers and a small picture of each, in one SQLite file of the user."""

from __future__ import annotations

import hashlib
import json
import sqlite3
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, InputError
from splinefeed.studio import sources

#: Entries that are kept, and how large a file may be that is kept with them, bytes.
MOST, LARGEST_FILE = 500, 8 * 2**20
_TABLES = """
pragma journal_mode = wal;
create table if not exists plan (
    id integer primary key, made real not null, digest text not null unique,
    name text not null, settings text not null, numbers text not null, picture text not null
);
create table if not exists file (sha256 text primary key, name text not null, content blob not null);
"""
#: Of the entries only the last ones stay, and of the files those that an entry has.
_SWEEP = f"""
delete from plan where id not in (select id from plan order by made desc limit {MOST});
delete from file where sha256 not in
    (select json_extract(settings, '$.source.sha256') from plan where settings like '%"sha256"%');
"""


class History:
    """The file; `uploads` is the folder where files of entries come from and go to when an entry is opened again."""

    def __init__(self, file: Path, uploads: Path) -> None:
        self._uploads = uploads
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            self._base = sqlite3.connect(file, isolation_level=None)
            self._base.executescript(_TABLES)
        except (OSError, sqlite3.Error) as error:
            raise FormatError(f"{file}: the history cannot be kept there: {error}; give another --history") from None
        self.close = self._base.close

    def add(self, settings: Mapping[str, Any], entry: Mapping[str, Any]) -> None:
        """Keep an entry; the same settings again are the same entry, made now. An upload becomes its digest."""
        source = dict(settings["source"])
        try:
            file = sources.upload(source.pop("file", None), self._uploads)
        except InputError:
            file = None
        if file is not None:
            content = file.read_bytes()
            source |= {"sha256": hashlib.sha256(content).hexdigest(), "name": file.name}
            if len(content) <= LARGEST_FILE:
                row = (source["sha256"], file.name, content)
                self._base.execute("insert or ignore into file values (?, ?, ?)", row)
        text = json.dumps({**settings, "source": source}, sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()
        self._base.execute(
            "insert into plan (made, digest, name, settings, numbers, picture) values (?, ?, ?, ?, ?, ?) "
            "on conflict (digest) do update set made = excluded.made, numbers = excluded.numbers",
            (time.time(), digest, str(entry["name"]), text, json.dumps(entry["numbers"]), str(entry["picture"])),
        )
        self._base.executescript(_SWEEP)

    def entries(self) -> list[dict[str, Any]]:
        """All entries, the latest first."""
        columns = ("id", "made", "name", "picture", "settings", "numbers")
        rows = self._base.execute(f"select {', '.join(columns)} from plan order by made desc")
        found = [dict(zip(columns, row, strict=True)) for row in rows]
        return [{**each, **{name: json.loads(each[name]) for name in ("settings", "numbers")}} for each in found]

    def settings(self, number: int) -> dict[str, Any]:
        """The settings of an entry, its file among the uploads again; InputError if there is no such entry."""
        row = self._base.execute("select settings from plan where id = ?", (number,)).fetchone()
        if row is None:
            raise InputError("that plan is not in the history any more")
        settings: dict[str, Any] = json.loads(row[0])
        digest = settings["source"].pop("sha256", None)
        found = self._base.execute("select name, content from file where sha256 = ?", (digest,)).fetchone()
        if found is not None:
            settings["source"]["file"] = sources.put(self._uploads, *found)
        return settings

    def delete(self, number: int) -> None:
        """Forget an entry, and its file if no other one has it."""
        self._base.execute("delete from plan where id = ?", (number,))
        self._base.executescript(_SWEEP)
