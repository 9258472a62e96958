"""Files that appear whole or not at all: written under a temporary name beside the target, then renamed onto it."""

from __future__ import annotations

import errno
import json
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError

#: What temporary names look like; after kill -9 such a file stays.
TEMPORARIES = ".splinefeed-*"
_REASONS = {
    errno.ENOSPC: "no space is left on the disk; free some or write elsewhere",
    errno.EDQUOT: "the disk quota is used up; free some space or write elsewhere",
    errno.EFBIG: "the file would be larger than this system allows",
    **dict.fromkeys((errno.EACCES, errno.EPERM), "no permission to write in that folder; choose another one"),
    errno.EROFS: "the disk is read-only; write elsewhere",
    errno.ENAMETOOLONG: "the name is too long",
}


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary name to write to; the finished file is put at `path`, a failed one is removed.

    Parameters
    ----------
    path : str or PathLike
        The file. A link is followed; a file that was there stays untouched until the new one is complete.

    Yields
    ------
    Path
        The temporary name, beside it.

    Raises
    ------
    FormatError
        For a missing folder, a target that is not a plain file, no permission, and a full disk.
    """
    target = _target(path)
    # Short and of its own, so that a target with the longest name allowed can still be written.
    temporary = target.with_name(f".splinefeed-{secrets.token_hex(8)}{target.suffix[:16]}")
    try:
        temporary.touch(exist_ok=False)
        yield temporary
        with temporary.open("r+b") as stream:
            os.fsync(stream.fileno())  # or a power cut could leave the new name with no content
        os.replace(temporary, target)
    except OSError as error:
        raise FormatError(f"{path}: cannot be written: {reason_of(error)}") from error
    finally:
        with suppress(OSError):  # also after Ctrl-C: nothing half-written is left behind
            temporary.unlink()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text in UTF-8, whole or not at all.

    Parameters
    ----------
    path : str or PathLike
        The file.
    text : str
        Its content.

    Raises
    ------
    FormatError
        As of `atomic_write`.
    """
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_page(path: str | os.PathLike[str], page: Mapping[str, Any]) -> None:
    """Write a page of numbers as JSON, whole or not at all.

    Parameters
    ----------
    path : str or PathLike
        The file.
    page : mapping of str to object
        Its content, without what is not finite.

    Raises
    ------
    FormatError
        As of `atomic_write`.
    """
    write_text(path, json.dumps(page, indent=2, allow_nan=False) + "\n")


def reason_of(error: OSError) -> str:
    """Say why the system refused, and what to do where that is known.

    Parameters
    ----------
    error : OSError
        Of the system.

    Returns
    -------
    str
        A few words.
    """
    return _REASONS.get(error.errno or 0) or error.strerror or " ".join(str(error).split()) or type(error).__name__


def _target(path: str | os.PathLike[str]) -> Path:
    """The file that `path` means, links followed; refuse what cannot be replaced by a file."""
    try:
        target = Path(os.path.realpath(path))
        folder_there, folder, plain = target.parent.is_dir(), target.is_dir(), target.is_file() or not target.exists()
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise FormatError(f"{str(path)[:200]!r}: is not the name of a file: {error}") from None
    if not folder_there:
        raise FormatError(f"{path}: the folder {target.parent} does not exist; make it first")
    if not plain:
        raise FormatError(f"{path}: is {'a folder' if folder else 'a device or pipe'}; give the name of a file")
    return target
