"""The process that reads files with native libraries (HDF5, MATLAB, Parquet, CAD), and what it answers.

A damaged file can lead such a library outside of its memory, and it cannot be stopped. So it runs apart, with a limit
on time and memory; what it cannot bear is an error of one line, and the next file finds a new process.

A request is {"module", "function", "words"}: a function of `splinefeed.formats.MODULE` that gives a description for
JSON, and arrays by name. The answer is one line of JSON, {"refused": why} or {"said", "columns": [name, type, shape]},
with the bytes of the columns one after the other behind it.
"""

from __future__ import annotations

import json
import math
import os
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.files.source import check_file, in_brief
from splinefeed.workers import Answer, Handler, LostError, Mail, Worker

#: Time that a library gets for a file, s, and for each MB of it.
MAX_SECONDS, SECONDS_PER_MB = 15.0, 1.0
#: What a library and the columns that it reads may take of the memory, bytes of address space.
MAX_ADDRESS_SPACE = 8 * 2**30

_worker = Worker("splinefeed.files.native_process:open_libraries", memory=MAX_ADDRESS_SPACE, quiet=True)


def ask(
    module: str, function: str, path: str | os.PathLike[str], seconds_per_mb: float = SECONDS_PER_MB, **words: Any
) -> tuple[Any, dict[str, Any]]:
    """Let a function of a reader read a file, in a process of its own.

    Parameters
    ----------
    module, function : str
        Of the reader, in `splinefeed`.
    path : str or PathLike
        The file.
    seconds_per_mb : float, optional
        Time that each MB of it has, s, beside MAX_SECONDS.
    **words : object
        For the function; for JSON.

    Returns
    -------
    said : object
        What the function says of the file.
    columns : dict of str to array
        Its columns.

    Raises
    ------
    FormatError
        That names the file.
    """
    file = check_file(path)
    seconds = MAX_SECONDS + seconds_per_mb * file.stat().st_size / 1e6
    request = {"module": module, "function": function, "file": os.path.abspath(file), "words": words}
    try:
        line, _, body = _worker.ask(request, seconds=seconds)[1].partition(b"\n")
    except LostError as error:
        why = f"takes longer than {seconds:.0f} s" if error.late else "makes the library that reads it crash"
        raise FormatError(f"{path}: {why}; is it damaged?") from None
    said = json.loads(line)
    if "refused" in said:
        raise FormatError(f"{path}: {said['refused']}")
    columns, at = {}, 0
    for name, kind, shape in said["columns"]:
        values = np.frombuffer(body, kind, math.prod(shape), at)
        at += values.nbytes
        columns[name] = (values if values.flags.aligned else values.copy()).reshape(shape)
    return said["said"], columns


# --- in the process ---------------------------------------------------------------------------------------------------


def open_libraries(mail: Mail) -> Handler:
    """What answers requests; a library is loaded by the first that needs it."""

    def answer(request: dict[str, Any]) -> Answer:
        columns: dict[str, Any] = {}
        try:
            function = getattr(import_module(f"splinefeed.{request['module']}"), request["function"])
            said, columns = function(Path(request["file"]), **request["words"])
            if odd := [name for name, each in columns.items() if each.dtype.kind not in "fiub"]:
                raise InputError(f"{odd[0]}: holds no numbers")
            kinds = [[name, each.dtype.str, each.shape] for name, each in columns.items()]
            head = json.dumps({"said": said, "columns": kinds})
        except InputError as error:
            head, columns = json.dumps({"refused": str(error).removeprefix(f"{request['file']}: ")}), {}
        except MemoryError:
            head, columns = json.dumps({"refused": "needs more memory than a file may take; read it in chunks"}), {}
        except Exception as error:  # the libraries' own exceptions are of many kinds
            head, columns = json.dumps({"refused": f"is not valid: {in_brief(error)}"}), {}
        return {}, b"".join([head.encode(), b"\n", *(each.tobytes() for each in columns.values())])

    return answer
