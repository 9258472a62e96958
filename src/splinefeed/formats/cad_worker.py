"""What runs in the process of the CAD libraries, which `cad_process` asks.

A task is {"kind", "file", "most_curves", "most_points", ...}. The answer is {"units", "findings", "groups"}, with
groups of {"name", "curves"}, whose curves `cad_curves` knows; {"refused": why} where the file is not what it should
be, which the readers say by a FormatError without the file's name; or {"missing": why} without the library.
"""

from __future__ import annotations

import gc
import json
from importlib import import_module
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats.source import in_brief
from splinefeed.workers import Answer, Handler, Mail

#: The module that reads each kind of file.
MODULES = {"step": "occt_shapes", "iges": "occt_shapes", "3dm": "rhino_objects"}


def open_libraries(mail: Mail) -> Handler:
    """What answers tasks; the libraries are loaded by the first that needs them."""
    gc.disable()  # it would walk through the many small objects of an answer again and again

    def answer(task: dict[str, Any]) -> Answer:
        body = json.dumps(_read(task)).encode()
        gc.collect()
        return {}, body

    return answer


def _read(task: dict[str, Any]) -> dict[str, Any]:
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
        return {"refused": f"the CAD library cannot read it: {in_brief(error)}"}
    return found
