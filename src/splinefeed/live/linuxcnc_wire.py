"""The memory shared with LinuxCNC's real-time side: the layout of linuxcnc/splinefeed_wire.h, attached or in a buffer.

One writer for each field. A counter must reach memory after what it counts: the processor's own order on x86, and
elsewhere libatomic's store with release.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import errno
import os
import platform
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import SplinefeedError

KEY, MAGIC, PROTOCOL, AXES = 0x53504C46, 0x53465450, 5, 9
#: Joints that are no axes, at most, and the poses at which real time tells them; columns of a piece.
JOINTS, PROBES = 6, 12
COLUMNS = AXES + JOINTS
SEGMENTS, PIECES, BATCHES, TEXT = 4096, 8192, 512, 240
#: Values of `kind`, `sync`, `why` and `state`.
LINE, ARC = 1, 2
FREE, THREAD, TAP = range(3)
WHY_START, WHY_LATE, WHY_DROPPED, WHY_REFUSED = range(4)
REST, MOVES, STOPS = range(3)

SEGMENT = np.dtype(
    [(name, "<i4") for name in ["id", "line", "kind", "canon", "turn", "enables", "atspeed", "indexer", "term", "sync"]]
    + [(name, "<f8") for name in ["feed", "top", "tolerance"]]
    + [("from", "<f8", AXES), ("to", "<f8", AXES), ("centre", "<f8", 3), ("normal", "<f8", 3)]
)
PIECE = np.dtype([(name, "<f8") for name in ["span", "scale"]] + [("segment", "<u8"), ("c", "<f8", (AXES, 6))])
BATCH = np.dtype(
    [(name, "<u8") for name in ["piece", "after", "done"]]
    + [(name, "<u4") for name in ["n", "sure", "epoch", "from_rest"]]
    + [(name, "<f8") for name in ["rate", "vlimit", "at"]]
)
WIRE = np.dtype(
    [(name, "<u4") for name in ["magic", "protocol", "size", "pad0"]]
    + [(n, "<u8") for n in ["seg_head", "seg_clear", "seg_done", "batch_now", "batch_seen", "piece_now", "piece_seen"]]
    + [(name, "<u4") for name in ["epoch", "why", "state", "piece_i"]]
    + [(name, "<f8") for name in ["period", "feed_scale", "rapid_scale", "vlimit", "rate", "piece_t"]]
    + [("rest", "<f8", AXES), ("answer", "<f8", (PROBES, JOINTS)), ("answered", "<u8")]
    + [(name, "<u4") for name in ["cycles", "late", "refused", "stepping"]]
    + [("said", f"S{TEXT}")]
    + [(name, "<u8") for name in ["batch_head", "beat", "session", "fault"]]
    + [("jerk", "<f8", COLUMNS), ("joint_vmax", "<f8", JOINTS), ("joint_amax", "<f8", JOINTS)]
    + [("joint", "<u4", JOINTS), ("joints", "<u4"), ("pad1", "<u4")]
    + [("probe", "<f8", (PROBES, AXES)), ("text", f"S{TEXT}")]
    + [("segment", SEGMENT, SEGMENTS), ("piece", PIECE, PIECES), ("batch", BATCH, BATCHES)]
    + [("joints_of", "<f8", (PIECES, JOINTS, 6))]
)
#: The order of acquire and release of the C11 memory model, as libatomic counts them.
_ACQUIRE, _RELEASE = 2, 3
FOREIGN = "the shared memory belongs to another user: start the planner as the user who runs LinuxCNC"
#: The number by which shmctl removes a shared memory.
IPC_RMID = 0


class WireError(SplinefeedError):
    """The shared memory is not what this version can use."""


class Wire:
    """The fields of a buffer of WIRE.itemsize bytes, at an address if it is not Python's: `wire.seg_head`."""

    def __init__(self, buffer: Any, ident: int = -1) -> None:
        self._all = np.frombuffer(buffer, WIRE, 1)
        self._address = self._all.__array_interface__["data"][0]
        self.ident = ident
        self.segment, self.piece, self.batch, self.joints_of = (
            self._all[name][0] for name in ("segment", "piece", "batch", "joints_of")
        )
        self._atomic = None if platform.machine() in ("x86_64", "AMD64") else _libatomic()

    def __getattr__(self, name: str) -> Any:
        value = self._all[name][0]
        if self._atomic is not None and WIRE[name] == np.dtype("<u8"):
            return int(self._atomic.__atomic_load_8(ctypes.c_void_p(self._place(name)), _ACQUIRE))
        return value.item() if value.ndim == 0 else value

    def store(self, name: str, value: Any) -> None:
        """Write a field behind all that was written before."""
        if self._atomic is not None and WIRE[name] == np.dtype("<u8"):
            self._atomic.__atomic_store_8(ctypes.c_void_p(self._place(name)), ctypes.c_uint64(int(value)), _RELEASE)
        else:
            self._all[name][0] = value

    def _place(self, name: str) -> int:
        fields = WIRE.fields
        assert fields is not None
        return int(self._address) + int(fields[name][1])


def _libatomic() -> Any:
    name = ctypes.util.find_library("atomic")
    if name is None:
        raise WireError(
            "libatomic is missing, which orders what is written on this processor: apt-get install libatomic1"
        )
    library = ctypes.CDLL(name)
    library.__getattr__("__atomic_load_8").restype = ctypes.c_uint64
    return library


def _libc() -> Any:
    libc = ctypes.CDLL(None, use_errno=True)
    libc.shmat.restype, libc.shmat.argtypes = ctypes.c_void_p, [ctypes.c_int, ctypes.c_void_p, ctypes.c_int]
    libc.shmdt.argtypes = [ctypes.c_void_p]
    return libc


def found() -> int | None:
    """Find the shared memory that a running LinuxCNC has.

    Returns
    -------
    int or None
        Its number; None where none runs with the module.

    Raises
    ------
    WireError
        Where another program, another version, or another user has it.

    Notes
    -----
    One of another size that an ended LinuxCNC left behind is removed.
    """
    libc = _libc()
    ident = int(libc.shmget(KEY, ctypes.c_size_t(0), 0))
    if ident < 0:
        if ctypes.get_errno() == errno.ENOENT:
            return None
        raise WireError(FOREIGN)
    if not users(ident):
        if int(libc.shmget(KEY, ctypes.c_size_t(WIRE.itemsize), 0)) < 0:
            libc.shmctl(ident, IPC_RMID, None)
        return None
    if int(libc.shmget(KEY, ctypes.c_size_t(WIRE.itemsize), 0)) >= 0:
        return ident
    if ctypes.get_errno() == errno.EACCES:
        raise WireError(FOREIGN)
    raise WireError(
        f"the shared memory of key {KEY:#x} has another size: it is of another version of splinefeed_tp; "
        "build it again (halcompile --install splinefeed_tp.c), or end the program that has it (ipcs -m)"
    )


def users(ident: int) -> int:
    """How many processes have the shared memory of this number; 0 for what an ended LinuxCNC left behind."""
    with open("/proc/sysvipc/shm", encoding="ascii") as lines:
        names = next(lines).split()
        for line in lines:
            row = dict(zip(names, line.split(), strict=True))
            if int(row["shmid"]) == ident:
                return int(row["nattch"])
    return 0


def home(ident: int) -> str | None:
    """The home folder of the LinuxCNC that has the shared memory, where its status is; None where that is not known."""
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended, or belongs to somebody else
            maps = (process / "maps").read_text(encoding="ascii", errors="replace").splitlines()
            inside = any(f"/SYSV{KEY:08x}" in line and line.split()[4] == str(ident) for line in maps)
            if inside and int(process.name) != os.getpid():
                words = (process / "environ").read_bytes().split(b"\0")
                return next((os.fsdecode(word[5:]) for word in words if word.startswith(b"HOME=")), None)
    return None


def attached(ident: int) -> Wire | None:
    """Attach a shared memory.

    Parameters
    ----------
    ident : int
        Its number.

    Returns
    -------
    Wire or None
        Its fields; None while LinuxCNC has not begun to use it.

    Raises
    ------
    WireError
        For another version, and for a memory of another user.
    """
    libc = _libc()
    address = libc.shmat(ident, None, 0)
    if address in (None, ctypes.c_void_p(-1).value):
        raise WireError(FOREIGN)
    wire = Wire((ctypes.c_char * WIRE.itemsize).from_address(address), ident)
    if wire.magic != MAGIC:
        libc.shmdt(address)
        return None
    if (wire.protocol, wire.size) != (PROTOCOL, WIRE.itemsize):
        said = f"splinefeed_tp speaks protocol {wire.protocol}, this planner {PROTOCOL}"
        libc.shmdt(address)
        raise WireError(f"{said}: build the module of this version (halcompile --install splinefeed_tp.c)")
    return wire


def detach(wire: Wire) -> None:
    """Leave the shared memory; its fields may not be looked at any more."""
    _libc().shmdt(wire._address)
