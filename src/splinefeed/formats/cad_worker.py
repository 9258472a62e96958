"""The process that runs CAD libraries: started by `cad_process`, it answers one line of JSON with another.

A task is {"kind", "file", "most_curves", "most_points", ...}. The answer is {"units", "findings", "groups"}, with
groups of {"name", "curves"}, whose curves `cad_curves` knows; {"refused": why} where the file is not what it should
be, which the readers say by a FormatError without the file's name; or {"missing": why} without the library. What the
libraries print goes nowhere.
"""

from __future__ import annotations

import gc
import json
import os
from contextlib import suppress
from importlib import import_module
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats.source import in_brief

#: What a library may take of the memory, bytes of address space; OCCT itself is half a gigabyte of it.
MAX_ADDRESS_SPACE = 6 * 2**30
#: The module that reads each kind of file.
MODULES = {"step": "occt_shapes", "iges": "occt_shapes", "3dm": "rhino_objects"}


def main() -> None:
    """Answer tasks until stdin ends."""
    with os.fdopen(os.dup(0), "rb") as tasks, os.fdopen(os.dup(1), "wb") as answers:
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        _limit_memory()
        gc.disable()  # it would walk through the many small objects of an answer again and again
        for line in tasks:
            answers.write(json.dumps(answer(json.loads(line))).encode() + b"\n")
            answers.flush()
            gc.collect()


def answer(task: dict[str, Any]) -> dict[str, Any]:
    """What is in the file of `task`, or why nothing is."""
    try:
        found: dict[str, Any] = import_module(f"splinefeed.formats.{MODULES[task['kind']]}").read(task)
    except FormatError as error:
        return {"refused": str(error)}
    except ImportError as error:
        return {"missing": str(error)}
    except MemoryError:
        return {"refused": "needs more memory than a CAD file may take"}
    except Exception as error:  # the libraries' own exceptions are of many kinds
        words = in_brief(error)
        return {"refused": f"the CAD library cannot read it: {words}"}
    return found


def _limit_memory() -> None:
    with suppress(ImportError, ValueError, OSError):  # not on every system
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_ADDRESS_SPACE, MAX_ADDRESS_SPACE))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
