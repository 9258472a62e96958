"""A function of this package called in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
_CALL = """
import importlib, json, sys
room, name, arguments = sys.argv[1:]
print(json.dumps(getattr(importlib.import_module(room), name)(*json.loads(arguments))))
"""


def outcome(room: str, name: str, *arguments: Any, **environment: str) -> Any:
    """What function `name` of benchmarks.`room` returns for `arguments` in a fresh Python; both must fit JSON.

    Raises CalledProcessError, with what the process wrote on its standard error, if it fails.
    """
    command = [sys.executable, "-c", _CALL, f"benchmarks.{room}", name, json.dumps(arguments)]
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, **environment}, check=True, stdout=subprocess.PIPE, text=True
    )
    return json.loads(done.stdout)
