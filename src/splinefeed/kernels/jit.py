"""The one decorator of all kernels: Numba with a disk cache that knows when any kernel's source has changed."""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

#: Rooms that hold kernels. Numba looks only at the file of the function that it loads, so a change in a kernel that
#: another one calls would go unseen; a cache folder named after all the sources together cannot go stale.
_ROOMS = ("kernels", "interpolation")


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """Folder of the compiled kernels: below $NUMBA_CACHE_DIR, the user's cache folder, or the temporary folder.

    Numba runs the machine code that it finds there, so below the temporary folder, where anybody may have been first,
    only a folder counts that is ours and that nobody else can write to.
    """
    package = Path(__file__).parents[1]
    digest = hashlib.sha256(numba.__version__.encode())
    for room in _ROOMS:
        for source in sorted((package / room).glob("*.py")):
            digest.update(source.read_bytes())
    name = f"splinefeed-{digest.hexdigest()[:16]}"
    for base in (os.environ.get("NUMBA_CACHE_DIR"), _user_cache(), _own_temporary()):
        if base:
            folder = Path(base) / "splinefeed" / name
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError:
                continue
            if os.access(folder, os.W_OK):
                return folder
    return Path(tempfile.mkdtemp(prefix="splinefeed-"))


def _user_cache() -> str | None:
    import platformdirs

    try:
        return platformdirs.user_cache_dir(appauthor=False)
    except (RuntimeError, KeyError):  # no HOME and no entry in the password file
        return None


def _own_temporary() -> str | None:
    """A folder of this user alone below the temporary one; None if another user's stands in its place."""
    folder = Path(tempfile.gettempdir()) / f"splinefeed-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    if not stat.S_ISDIR(status.st_mode):  # a link leads elsewhere
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
        return None
    return str(folder)


def kernel(function: F) -> F:
    """Compile `function` in nopython mode on first call, cached on disk; no fastmath, so streams repeat bit for bit."""
    return _compiled(function)


def hot_kernel(function: F) -> F:
    """A `kernel` that the compiler must copy into its callers: for what runs several times a tick.

    A call that is not inlined costs more than its arithmetic, as arrays are counted in and out of it.
    """
    return _compiled(function, forceinline=True)


def _compiled(function: F, **options: bool) -> F:
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_directory())
    try:
        compiled: F = numba.njit(cache=True, error_model="numpy", **options)(function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled
