"""Files that a page has dropped: each in a folder of its own with a name of ours, few of them, none too large."""

from __future__ import annotations

import re
import secrets
import shutil
from pathlib import Path
from typing import BinaryIO

from splinefeed.errors import InputError

#: Size of an upload at most, bytes, and how many are kept; the oldest goes when another one comes.
LARGEST, MOST = 64 * 2**20, 16
#: Longest name that is kept.
LONGEST_NAME = 80


class Uploads:
    """The folder of uploads."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(mode=0o700)

    def begin(self, name: str, size: int | None) -> Upload:
        """Room for a file of that name; InputError if it is too large or its size is not said."""
        if size is None:
            raise InputError("the size of the upload is missing")
        if size > LARGEST:
            raise InputError(f"{size / 2**20:.0f} MB; at most {LARGEST // 2**20} MB are taken: use the command line")
        if size == 0:
            raise InputError("the file is empty")
        kept = sorted(self.folder.iterdir(), key=lambda each: each.stat().st_mtime_ns)
        for old in kept[: max(len(kept) - MOST + 1, 0)]:
            shutil.rmtree(old, ignore_errors=True)
        return Upload(self.folder, _harmless(name), size)

    def put(self, name: str, content: bytes) -> str:
        """Keep content that is at hand, such as a file of the history; the name of the upload."""
        with_room = self.begin(name, len(content))
        with_room.write(content)
        return with_room.end()

    def content(self, name: str) -> tuple[str, bytes] | None:
        """Name and content of an upload, None if it is not there."""
        place = self.folder / name
        files = sorted(place.iterdir()) if place.is_dir() else []
        return (files[0].name, files[0].read_bytes()) if files else None


class Upload:
    """A file on its way."""

    def __init__(self, folder: Path, name: str, size: int) -> None:
        self.id = secrets.token_hex(16)
        self._place = folder / self.id
        self._place.mkdir(mode=0o700)
        self._left = size
        self._file: BinaryIO = (self._place / name).open("wb")

    def write(self, chunk: bytes) -> None:
        """Take more of it; InputError for more than was said."""
        self._left -= len(chunk)
        if self._left < 0:
            raise InputError("the upload is larger than announced")
        self._file.write(chunk)

    def end(self) -> str:
        """The whole file is there: its id. InputError if a part is missing."""
        self._file.close()
        if self._left != 0:
            self.drop()
            raise InputError("the upload broke off; drop the file again")
        return self.id

    def drop(self) -> None:
        """Forget it."""
        self._file.close()
        shutil.rmtree(self._place, ignore_errors=True)


def _harmless(name: str) -> str:
    """A name for a file of ours that users know again: no folders, no dots in front, not too long."""
    base = re.split(r"[/\\]", name)[-1]
    clean = re.sub(r"[^\w. -]", "_", base).lstrip(". ")
    stem, dot, suffix = clean.rpartition(".")
    if not stem:
        return clean[:LONGEST_NAME] or "upload"
    return f"{stem[: LONGEST_NAME - 12]}{dot}{suffix[:11]}"
