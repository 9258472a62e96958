"""Figures of records, and the files that a run leaves behind; draws what others computed.

`sf.report(run, folder)` writes a run: until the room has another name, calling it calls `folder.report`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from types import ModuleType
from typing import Any


class _Report(ModuleType):
    """The room itself, which can be called."""

    def __call__(self, run: Any, folder: str | os.PathLike[str], *, formats: Iterable[str] = ("hdf5",)) -> list[str]:
        from splinefeed.reports.folder import report

        return report(run, folder, formats=formats)


sys.modules[__name__].__class__ = _Report
