"""The decorators of all kernels: Numba, imported when one first compiles, and a disk cache that knows what changed.

A compiled kernel is kept under a digest of its bytecode, of the constants that it names, and of all kernels that it
calls. So a changed line costs the compile of that kernel and its callers, and a clean clone costs none.

A `Leaf` is a kernel that is worth its compile only for long work: `leaf.for_work(ticks)` is plain Python before that.
"""

from __future__ import annotations

import atexit
import functools
import glob
import hashlib
import os
import pickle
import shutil
import stat
import sys
import tempfile
import time
import types
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])

#: Names of the kernels that this process found in no cache, in the order in which it began to compile them.
compiled_here: list[str] = []
#: Names of the kernels that ran as plain Python because Numba, the extra [sim], is missing: leaves if worth a compile.
wanted_numba: list[str] = []

#: What it costs to have a kernel that is in the cache, as a share of compiling it: to read it, 20 to 40 ms, and to
#: import Numba before, 0.2 s, where a compile takes about 3 s.
LOADING = 0.01
LOADING_WITH_NUMBA = 0.1
#: What a compile takes, s; plain Python that has run for longer was worth one, however few its units of work.
COMPILING = 3.0


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """Folder of the compiled kernels: below $NUMBA_CACHE_DIR or the user's cache folder, or a new one of this process.

    What is found there is run as machine code: so the folder, and the one above it, belong to this user and nobody else
    may write to them, and each file is looked at in the same way. There is none in the temporary folder.
    """
    import platformdirs

    with suppress(OSError, RuntimeError, KeyError):  # RuntimeError, KeyError: no HOME and nothing in the password file
        base = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir(appauthor=False)
        Path(base).mkdir(parents=True, exist_ok=True)
        folder = Path(base) / "splinefeed" / "kernels"
        for each in (folder.parent, folder):
            each.mkdir(mode=0o700, exist_ok=True)
        if _only_ours(os.stat(base), above=True) and all(_closed(each) for each in (folder.parent, folder)):
            return folder
    folder = Path(tempfile.mkdtemp(prefix="splinefeed-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _only_ours(status: os.stat_result, *, above: bool = False) -> bool:
    """Whether nobody but this user can write there; `above`: put another folder in the place of one of ours there."""
    if not hasattr(os, "geteuid"):
        return True  # Windows keeps such folders by user
    if above:
        return not status.st_mode & stat.S_IWOTH or bool(status.st_mode & stat.S_ISVTX)
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _closed(folder: Path) -> bool:
    """Whether nobody but this user can write to a folder, which is closed to others if it is ours."""
    status = folder.stat()
    if hasattr(os, "geteuid") and status.st_uid == os.geteuid() and not _only_ours(status):
        folder.chmod(stat.S_IMODE(status.st_mode) & ~(stat.S_IWGRP | stat.S_IWOTH))
    return _only_ours(folder.stat()) and os.access(folder, os.W_OK)


def kernel(function: F) -> F:
    """Compile `function` in nopython mode on first call, cached on disk; no fastmath, so streams repeat bit for bit."""
    return cast(F, Kernel(function))


def hot_kernel(function: F) -> F:
    """A `kernel` that the compiler must copy into its callers: for what runs several times a tick.

    A call that is not inlined costs more than its arithmetic, as arrays are counted in and out of it.
    """
    return cast(F, Kernel(function, forceinline=True))


class Kernel:
    """A function that Numba compiles when it is first called, from Python or from another compiled function."""

    def __init__(self, function: Callable[..., Any], **options: bool) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.options = {"error_model": "numpy", **options}

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function, or the plain one with NUMBA_DISABLE_JIT or without Numba."""
        return self.compiled(*arguments)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__

    @property
    def name(self) -> str:
        """Module and name of the function."""
        return f"{self.py_func.__module__}.{self.py_func.__qualname__}"

    @cached_property
    def compiled(self) -> Callable[..., Any]:
        """Numba's dispatcher with our cache; the plain function with NUMBA_DISABLE_JIT or without Numba."""
        if _disabled():
            if not _numba_version():
                wanted_numba.append(self.name)
            return self.py_func
        import numba

        dispatcher: Callable[..., Any] = numba.njit(**self.options)(self.py_func)
        if hasattr(dispatcher, "_cache"):
            dispatcher._cache = _Cache(self)
        return dispatcher

    @cached_property
    def plain(self) -> Callable[..., Any]:
        """The function as plain Python: what it calls is plain, too, and not looked up in a kernel at each call."""
        function, around = self.py_func, dict(self.py_func.__globals__)
        made = types.FunctionType(function.__code__, around, function.__name__, closure=function.__closure__)
        self.__dict__["plain"] = made  # before what it calls is made plain: a kernel may call itself
        around.update({name: value.plain for name, value in self._named if isinstance(value, Kernel)})
        return made

    @property
    def _numba_type_(self) -> Any:
        """What Numba asks an object for that a compiled function names: the type of the dispatcher."""
        return self.compiled._numba_type_  # type: ignore[attr-defined]

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that decides what this kernel compiles to but the types of its arguments and the processor."""
        parts, waiting = {_numba_version(), str(sys.implementation.cache_tag)}, [self]
        while waiting:
            kernel = waiting.pop()
            if kernel._own not in parts:
                parts.add(kernel._own)
                waiting += [value for _, value in kernel._named if isinstance(value, Kernel)]
        return hashlib.sha256("\n".join([self._own, *sorted(parts)]).encode()).hexdigest()

    @cached_property
    def _own(self) -> str:
        """The function alone, spelled: bytecode and constants; of what it calls only the names."""
        named = [f"{name}={_spelled(value)}" for name, value in self._named]
        return "\n".join([self.name, str(self.options), _spelled(self.py_func.__code__), *named])

    @property
    def _named(self) -> list[tuple[str, Any]]:
        """Globals and cells of the closure that the function names, and their values."""
        function, code = self.py_func, self.py_func.__code__
        around, codes = function.__globals__, [code, *(c for c in code.co_consts if isinstance(c, types.CodeType))]
        names = sorted({name for each in codes for name in each.co_names if name in around})
        found = [(name, around[name]) for name in names]
        cells = function.__closure__ or ()
        return found + [(name, cell.cell_contents) for name, cell in zip(code.co_freevars, cells, strict=True)]

    @property
    def _file(self) -> str:
        return f"{self.py_func.__name__}-{self.digest[:24]}-"


class Leaf(Kernel, Generic[F]):
    """A kernel that `for_work` runs as plain Python where it is not worth its compile: `@partial(Leaf, worth=1000)`.

    Parameters
    ----------
    function : callable
        The kernel.
    worth : int
        Units of work, such as ticks, that plain Python does in the time of the compile.
    rows : sequence of str, optional
        Names of two-dimensional arrays of which the function takes whole rows.
    lists : sequence of str, optional
        Names of small arrays that the function only reads: lists of Python's floats are the fastest to read.
    """

    def __init__(self, function: F, worth: int, rows: tuple[str, ...] = (), lists: tuple[str, ...] = ()) -> None:
        super().__init__(function)
        self.worth = worth
        self._work = 0
        self._spent = 0.0  # s, as plain Python
        places = function.__code__.co_varnames
        self._rows, self._lists = ([places.index(name) for name in names] for names in (rows, lists))

    def for_work(self, count: int) -> F:
        """The function for `count` more units of work: plain Python until that has cost as much as a compile does.

        So work costs at most twice what it would if its length were known, and short work nothing but itself. The bits
        are the same either way.
        """
        self._work += count
        price = self._price()
        if _disabled() or (self._work <= self.worth * price and self._spent <= COMPILING * price):
            if max(self._work - self.worth, self._spent - COMPILING) > 0 and not _numba_version():
                wanted_numba.append(self.name)
            return cast(F, self.plainly)
        return cast(F, self.compiled)

    def _price(self) -> float:
        """What it costs to have the compiled function, as a share of compiling it."""
        if getattr(self.__dict__.get("compiled"), "signatures", ()):
            return 0.0
        if not any(cache_directory().glob(f"{glob.escape(self._file)}*.nbc")):
            return 1.0
        return LOADING if "numba" in sys.modules else LOADING_WITH_NUMBA

    def plainly(self, *arguments: Any) -> Any:
        """Call the function as plain Python, on memoryviews in place of arrays: their elements are Python's floats.

        Where Python raises and compiled code goes on with inf or nan, as it does after a division by zero, or where a
        function computes with whole arrays, they are put back to what they were and the compiled function takes over.
        """
        given: list[Any] = list(arguments)
        before = [(each, each.copy()) for each in given if isinstance(each, np.ndarray) and each.flags.writeable]
        for place, each in enumerate(given):
            if not isinstance(each, np.ndarray):
                continue
            if place in self._lists:
                given[place] = each.tolist()
            elif place in self._rows:
                given[place] = [row.data for row in each]
            else:
                given[place] = each.data
        begin = time.perf_counter()
        try:
            return self.plain(*given)
        except Exception:
            for array, kept in before:
                array[...] = kept
            with np.errstate(all="ignore"):  # nothing to a compiled function, but it may be plain
                return self.compiled(*arguments)
        finally:
            self._spent += time.perf_counter() - begin


def _disabled() -> bool:
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0") or not _numba_version()


@lru_cache(maxsize=1)
def _numba_version() -> str:
    """The version of Numba, empty if it is not installed."""
    try:
        return version("numba")
    except PackageNotFoundError:
        return ""


def _spelled(value: Any) -> str:
    """A value as text that differs when it does, and is the same in every process if it is a number, text or array."""
    if isinstance(value, types.CodeType):
        names, constants = (value.co_names, value.co_varnames), [_spelled(each) for each in value.co_consts]
        return f"{value.co_argcount} {value.co_flags} {value.co_code.hex()} {names} {constants}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype.str} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, types.ModuleType | types.BuiltinFunctionType):
        return value.__name__
    return value.name if isinstance(value, Kernel) else repr(value)


class _Cache:
    """Where the dispatcher of one kernel looks for what is compiled, and leaves it: a file for each signature.

    It stands in the place of `numba.core.caching.FunctionCache`, which goes by the age of the source file. One file a
    signature, written whole, has no index that two processes could spoil for each other. Whatever goes wrong here,
    Numba compiles.
    """

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel

    @property
    def cache_path(self) -> str:
        """The folder, for Numba's own statistics."""
        return str(cache_directory())

    def _file(self, signature: Any, codegen: Any) -> Path:
        types_and_processor = f"{signature} {codegen.magic_tuple()}"
        key = hashlib.sha256(types_and_processor.encode()).hexdigest()
        return cache_directory() / f"{self._kernel._file}{key[:16]}.nbc"

    def load_overload(self, signature: Any, context: Any) -> Any:
        """What is compiled for the argument types `signature`; None if it is not here."""
        with suppress(Exception):
            from numba.core.compiler import CompileResult

            context.refresh()
            file = self._file(signature, context.codegen())
            with file.open("rb") as stream:
                if not _only_ours(os.fstat(stream.fileno())):
                    raise PermissionError(file)
                result = CompileResult._rebuild(context, *pickle.loads(stream.read()))
            if tuple(result.signature.args) == tuple(signature):
                return result
        compiled_here.append(self._kernel.name)
        return None

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep what was compiled for the argument types `signature`."""
        if result.library.has_dynamic_globals or result.lifted:
            return
        with suppress(Exception):
            from numba.core.serialize import dumps

            file = self._file(signature, result.library.codegen)
            written = file.with_suffix(f".{os.getpid()}")
            with os.fdopen(os.open(written, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as stream:
                stream.write(dumps(result._reduce()))
            written.replace(file)
