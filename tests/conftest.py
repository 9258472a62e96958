"""What every test shares: the Hypothesis profile, the folder of sample files, and a browser."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

#: Whether kernels run as Python.
PLAIN = bool(int(os.environ.get("NUMBA_DISABLE_JIT", "0")))

# No deadline: the first example may wait for a compiler. In CI the examples are the same every time.
settings.register_profile("splinefeed", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.register_profile("plain", deadline=None, derandomize=True, max_examples=20)
settings.load_profile("plain" if PLAIN else "splinefeed")

#: Tests, one a line, that would take too long as Python: with Numba's compiler off they are left out.
COMPILED = Path(__file__).parent / "compiled.txt"


def compiled() -> set[str]:
    """What stands in COMPILED: "feed/test_x.py" for a whole file, "feed/test_x.py::test_y" for one test of it."""
    lines = COMPILED.read_text(encoding="utf-8").splitlines()
    return {line for line in lines if line and not line.startswith("#")}


def pytest_configure() -> None:
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # of a shell's background: what tests interrupt would inherit
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if PLAIN:
        np.seterr(all="ignore")  # as compiled kernels do; in all else the run with the compiler minds


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not PLAIN:
        return
    slow = compiled()
    kept, left = [], []
    for item in items:
        name = item.nodeid.partition("[")[0].removeprefix("tests/")
        (left if name in slow or name.partition("::")[0] in slow else kept).append(item)
    config.hook.pytest_deselected(items=left)
    items[:] = kept


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of the sample files."""
    return Path(__file__).parent / "data"


#: Chromium without what calls home or needs a screen.
QUIET = (
    "--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser of the tests that are marked `browser`."""
    api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("no browser: apt-get install chromium (make test-browser does it, as root on Debian)")
    with api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=program, args=QUIET.split())
        yield browser
        browser.close()
