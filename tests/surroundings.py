"""The environment that every test and every process it starts runs in: stated here, and nothing of the caller's."""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: What decides where a package registry is reached, what Windows needs to start a process, and what the runner of the
#: tests says about itself; NUMBA_DISABLE_JIT chooses the subset that runs as plain Python.
KEPT = (
    "NUMBA_DISABLE_JIT", "http_proxy", "https_proxy", "no_proxy", "HTTP_PROXY", "HTTPS_PROXY", "NO_PROXY",
    "PIP_INDEX_URL", "SSL_CERT_FILE", "SYSTEMROOT", "COMSPEC", "PATHEXT", "LOCALAPPDATA", "USERPROFILE", "TMPDIR",
    "TEMP", "TMP",
)  # fmt: skip
#: Where programs are looked for after those beside Python.
PLACES = ("/usr/local/bin", "/usr/bin", "/bin", "/usr/local/sbin", "/usr/sbin", "/sbin", "/opt/homebrew/bin")


def stated(caller: dict[str, str]) -> dict[str, str]:
    """The environment of the tests; of the caller's only KEPT, and the cache folder, whose compiled kernels all share.

    HOME is a folder of the project's, so that no settings of the caller are read.
    """
    home = ROOT / "build" / "home"
    cache = caller.get("XDG_CACHE_HOME") or str(Path(caller.get("HOME", home), ".cache"))
    places = PLACES if os.name == "posix" else (caller.get("PATH", ""),)
    return {
        **{name: value for name, value in caller.items() if name in KEPT or name.startswith("PYTEST_")},
        "HOME": str(home),
        "XDG_CACHE_HOME": cache,
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), *places]),
        "LANG": "C.UTF-8",
        "PYTHONPATH": str(ROOT / "src"),
    }


def enter() -> None:
    """Make that environment this process's own, and with it that of every process it starts."""
    environment = stated(dict(os.environ))
    Path(environment["HOME"]).mkdir(parents=True, exist_ok=True)
    os.environ.clear()
    os.environ.update(environment)
