"""The text of a file that a user named, or one line that says why there is none."""

from __future__ import annotations

import os
from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.formats.sizes import MAX_FILE_BYTES

_LFS_POINTER = b"version https://git-lfs"
_UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")


def check_file(path: str | os.PathLike[str]) -> Path:
    """`path` as a Path if it is a plain file with something in it; FormatError otherwise."""
    file = Path(path)
    try:
        status = file.stat()
    except FileNotFoundError:
        raise FormatError(f"{path}: there is no such file; check the name and the folder") from None
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise FormatError(f"{str(path)[:200]!r}: cannot be opened: {reason}") from None
    if file.is_dir():
        raise FormatError(f"{path}: is a folder; name a file in it")
    if not file.is_file():
        raise FormatError(f"{path}: is a device or pipe; name a plain file")
    if status.st_size == 0:
        raise FormatError(f"{path}: is empty; was its writing interrupted?")
    return file


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of `path`, without a byte order mark; FormatError for what is no text file of a sensible size."""
    file = check_file(path)
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(content) > MAX_FILE_BYTES:
        raise FormatError(f"{path}: is larger than {MAX_FILE_BYTES // 2**20} MB; that is no curve but a point cloud")
    if content.startswith(_LFS_POINTER):
        raise FormatError(f"{path}: is a pointer of Git LFS, not the file itself; run: git lfs pull")
    if content.startswith(_UTF_16_MARKS):
        raise FormatError(f"{path}: is UTF-16 text; save it as UTF-8")
    if b"\0" in content:
        raise FormatError(f"{path}: byte {content.index(0)}: is binary; expected text, a JSON curve or an airfoil .dat")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")  # old airfoil files carry accents of their day in the name line
    if not text.strip():
        raise FormatError(f"{path}: holds nothing but blanks")
    return text
