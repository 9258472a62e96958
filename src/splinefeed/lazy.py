"""Public names that are imported at their first use, so that `import splinefeed` stays fast."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

_IMPORT = re.compile(r"^from ([\w.]+) import (\w+) as \2$", re.MULTILINE)


def lazily(room: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__`, `__all__` of a package whose stub, __init__.pyi, says where its public names live."""
    package = sys.modules[room]
    with open(f"{os.path.splitext(str(package.__file__))[0]}.pyi", encoding="utf-8") as stub:
        homes = {name: home for home, name in _IMPORT.findall(stub.read())}

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        within = None if homes[name] == room else getattr(import_module(homes[name]), name, None)
        value = within or import_module(f"{homes[name]}.{name}")
        setattr(package, name, value)
        return value

    return find, lambda: sorted(package.__all__), list(homes)
