"""The text of a file that a user named, or one line that says why there is none."""

from __future__ import annotations

import os
import re
import tomllib
from functools import partial
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.files.sizes import MAX_FILE_BYTES
from splinefeed.numbers import MOST_WHOLE

_LFS_POINTER = b"version https://git-lfs"
#: Longest words of a library that are passed on, characters.
MOST_SAID = 200
_UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")
#: Largest TOML text, characters, and most words of a key between dots: the reader's time and memory grow with the
#: square of these words.
MAX_TOML, MAX_KEY_WORDS = 2**20, 8
_KEY_WORD = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_KEY_WORD}(?:[ \t]*+\.[ \t]*+{_KEY_WORD}){{{MAX_KEY_WORDS}}}")
#: Python converts thousands of digits to a whole number in quadratic time, or refuses.
_LONG_NUMBER = re.compile(r"(?<![\w.+-])[+-]?[0-9][0-9_]{400}")


def check_file(path: str | os.PathLike[str]) -> Path:
    """Check that a name is that of a plain file with something in it.

    Parameters
    ----------
    path : str or PathLike
        The name.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    FormatError
        That says what it is in place of that.
    """
    file = Path(path)
    try:
        status = file.stat()
    except FileNotFoundError:
        raise FormatError(f"{path}: no such file; check the name and the folder") from None
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


def in_brief(error: BaseException) -> str:
    """Shorten what a library said of a file to one line: some quote the file.

    Parameters
    ----------
    error : BaseException
        Of the library.

    Returns
    -------
    str
        At most MOST_SAID letters.
    """
    words = " ".join(str(error).split()) or type(error).__name__
    return words if len(words) <= MOST_SAID else f"{words[:MOST_SAID]}..."


def check_size(path: str | os.PathLike[str], max_bytes: int | None = None) -> None:
    """Check that a file is not too large.

    Parameters
    ----------
    path : str or PathLike
        The file.
    max_bytes : int, optional
        MAX_FILE_BYTES by default.

    Raises
    ------
    FormatError
        For a larger one.
    """
    most = MAX_FILE_BYTES if max_bytes is None else max_bytes
    if Path(path).stat().st_size > most:
        raise FormatError(f"{path}: is larger than {most // 2**20} MB; that is not a curve but a point cloud")


def read_head(path: str | os.PathLike[str], size: int) -> bytes:
    """Read the first bytes of a text file.

    Parameters
    ----------
    path : str or PathLike
        The file.
    size : int
        How many bytes.

    Returns
    -------
    bytes
        At most so many.

    Raises
    ------
    FormatError
        For a pointer of Git LFS, UTF-16 text and nothing but blanks.
    """
    head = read_bytes(path, size)
    if head.startswith(_LFS_POINTER):
        raise FormatError(f"{path}: is a pointer of Git LFS, not the file itself; run: git lfs pull")
    if head.startswith(_UTF_16_MARKS):
        raise FormatError(f"{path}: is UTF-16 text; save it as UTF-8")
    if not head.strip() and len(head) < size:
        raise FormatError(f"{path}: holds only white space")
    return head


def head_text(head: bytes) -> str:
    """The text at the beginning of a file, without a byte order mark; its last letter may be cut."""
    return head.decode("utf-8-sig", errors="replace")


def read_text(path: str | os.PathLike[str], expected: str = "text", max_bytes: int | None = None) -> str:
    """Read a text file.

    Parameters
    ----------
    path : str or PathLike
        The file.
    expected : str, optional
        What it should be, for the message.
    max_bytes : int, optional
        Its largest size, MAX_FILE_BYTES by default.

    Returns
    -------
    str
        The text, without a byte order mark: UTF-8, or else Latin 1.

    Raises
    ------
    FormatError
        For what is not a text file of a sensible size.
    """
    check_size(check_file(path), max_bytes)
    content = read_bytes(path, -1)
    if b"\0" in content:
        raise FormatError(f"{path}: byte {content.index(0)}: is binary; expected {expected}")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")  # old airfoil files carry accents of their day in the name line
    if not text.strip():
        raise FormatError(f"{path}: holds only white space")
    return text


def read_bytes(path: str | os.PathLike[str], size: int = -1) -> bytes:
    """Read bytes of a plain file.

    Parameters
    ----------
    path : str or PathLike
        The file.
    size : int, optional
        How many, from its beginning; all by default.

    Returns
    -------
    bytes
        At most so many.

    Raises
    ------
    FormatError
        For an empty file, for none, and where it is refused.
    """
    try:
        with check_file(path).open("rb") as stream:
            return stream.read(size)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None


def toml_of(text: str, source: str, most: int = MAX_TOML) -> dict[str, Any]:
    """Read TOML within bounds of size, depth and numbers.

    Parameters
    ----------
    text : str
        To be read.
    source : str
        What the message calls it.
    most : int, optional
        Letters that it may have.

    Returns
    -------
    dict of str to object
        What it says.

    Raises
    ------
    FormatError
        With the line that is none, or goes too far.
    """
    if len(text) > most:
        raise FormatError(f"{source}: has {len(text)} letters; at most {most} are read here")
    for pattern, why in (
        (_LONG_KEY, f"has more than {MAX_KEY_WORDS} words between dots; no key here has as many"),
        (_LONG_NUMBER, "is too large for a number"),
    ):
        if found := pattern.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise FormatError(f"{source}: line {line}: {found[0][:20]!r}... {why}")
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        said = "brackets are nested too deeply" if isinstance(error, RecursionError) else in_brief(error)
        raise FormatError(f"{source}: is not TOML: {said}") from None
    inside: list[tuple[str, Any]] = list(content.items())
    for place, value in inside:  # grows by what is inside
        if isinstance(value, dict):
            inside += [(f"{place}.{key}", each) for key, each in value.items()]
        elif isinstance(value, list):
            inside += [(place, each) for each in value if isinstance(each, dict | list | int)]
        elif isinstance(value, int) and abs(value) > MOST_WHOLE:
            raise FormatError(f"{source}: {place[:80]}: a whole number has more than 64 bits")
    return content


def count_lines(path: str | os.PathLike[str]) -> int:
    """How many lines a file has, however long it is."""
    with open(path, "rb") as stream:
        return sum(block.count(b"\n") for block in iter(partial(stream.read, 2**20), b""))
