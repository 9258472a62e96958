"""Public names that are imported at their first use, so that `import splinefeed` stays fast."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazily(
    room: str, homes: Mapping[str, str], moved: Mapping[str, str] | None = None
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package whose public names live in modules of their own.

    homes  module of each name, below splinefeed; the name stands for the module itself where that has none such
    moved  where a name that was here stands now, "splinefeed.live.LookAhead"; it warns, for one release
    """

    def find(name: str) -> Any:
        if moved is not None and name in moved:
            warnings.warn(f"{room}.{name} is now {moved[name]}", DeprecationWarning, stacklevel=2)
            home, _, now = moved[name].rpartition(".")
            return getattr(import_module(home), now)
        if name not in homes:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        module = import_module(f"splinefeed.{homes[name]}")
        value = getattr(module, name, module)
        setattr(sys.modules[room], name, value)
        return value

    return find, lambda: sorted(sys.modules[room].__all__)
