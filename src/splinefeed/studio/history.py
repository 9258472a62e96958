"""What was planned before: settings, numbers and a small picture of each, in one SQLite file of the user."""

from __future__ import annotations

import hashlib
import json
import sqlite3
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.studio.uploads import Uploads

#: Entries that are kept, and how large a file may be that is kept with them, bytes.
MOST, LARGEST_FILE = 500, 8 * 2**20
_TABLES = """
create table if not exists plan (
    id integer primary key, made real not null, digest text not null unique,
    name text not null, settings text not null, numbers text not null, picture text not null
);
create table if not exists file (sha256 text primary key, name text not null, content blob not null);
create table if not exists uses (plan integer not null references plan(id) on delete cascade, sha256 text not null);
"""


class History:
    """The file; `uploads` is where files of entries come from and go to when an entry is opened again."""

    def __init__(self, file: Path, uploads: Uploads) -> None:
        self._uploads = uploads
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            self._base = sqlite3.connect(file, isolation_level=None)
            self._base.execute("pragma journal_mode = wal")
            self._base.execute("pragma foreign_keys = on")
            self._base.executescript(_TABLES)
        except (OSError, sqlite3.Error) as error:
            raise FormatError(f"{file}: the history cannot be kept there: {error}; give another --history") from None

    def add(self, settings: Mapping[str, Any], entry: Mapping[str, Any]) -> int:
        """Keep an entry; the same settings again are the same entry, made now. Its number."""
        kept, file = self._without_upload(settings)
        text = json.dumps(kept, sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()
        row = (time.time(), digest, str(entry["name"]), text, json.dumps(entry["numbers"]), str(entry["picture"]))
        with self._base:
            self._base.execute("begin")
            self._base.execute(
                "insert into plan (made, digest, name, settings, numbers, picture) values (?, ?, ?, ?, ?, ?) "
                "on conflict (digest) do update set made = excluded.made, numbers = excluded.numbers",
                row,
            )
            number = int(self._base.execute("select id from plan where digest = ?", (digest,)).fetchone()[0])
            if file is not None:
                self._base.execute("insert or ignore into file values (?, ?, ?)", file)
                self._base.execute("delete from uses where plan = ?", (number,))
                self._base.execute("insert into uses values (?, ?)", (number, file[0]))
            self._base.execute(
                "delete from plan where id not in (select id from plan order by made desc limit ?)", (MOST,)
            )
            self._sweep()
        return number

    def entries(self) -> list[dict[str, Any]]:
        """All entries, the latest first."""
        rows = self._base.execute("select id, made, name, settings, numbers, picture from plan order by made desc")
        return [
            {
                "id": number, "made": made, "name": name, "settings": json.loads(settings),
                "numbers": json.loads(numbers), "picture": picture,
            }
            for number, made, name, settings, numbers, picture in rows
        ]  # fmt: skip

    def settings(self, number: int) -> dict[str, Any] | None:
        """The settings of an entry, its file among the uploads again; None if there is no such entry."""
        row = self._base.execute("select settings from plan where id = ?", (number,)).fetchone()
        if row is None:
            return None
        settings: dict[str, Any] = json.loads(row[0])
        digest = settings["source"].pop("sha256", None)
        found = self._base.execute("select name, content from file where sha256 = ?", (digest,)).fetchone()
        if found is not None:
            settings["source"]["file"] = self._uploads.put(found[0], found[1])
        return settings

    def delete(self, number: int) -> None:
        """Forget an entry, and its file if no other one has it."""
        with self._base:
            self._base.execute("begin")
            self._base.execute("delete from plan where id = ?", (number,))
            self._sweep()

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def _sweep(self) -> None:
        self._base.execute("delete from file where sha256 not in (select sha256 from uses)")

    def _without_upload(self, settings: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, str, bytes] | None]:
        """The settings with a digest in place of an upload, and digest, name and content of a file that is kept."""
        source = dict(settings["source"])
        upload = source.pop("file", None)
        found = None if upload is None else self._uploads.content(upload)
        if found is None:
            return {**settings, "source": source}, None
        name, content = found
        digest = hashlib.sha256(content).hexdigest()
        kept = {**settings, "source": {**source, "sha256": digest, "name": name}}
        return kept, (digest, name, content) if len(content) <= LARGEST_FILE else None
