"""What every test shares: the Hypothesis profile, the folder of sample files, and a browser."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import surroundings

surroundings.enter()  # before NumPy and Numba read the environment

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

#: Whether kernels run as Python.
PLAIN = bool(int(os.environ.get("NUMBA_DISABLE_JIT", "0")))

# No deadline: the first example may wait for a compiler. The examples are the same every time; `make torture` looks for
# new ones.
settings.register_profile("splinefeed", deadline=None, derandomize=True)
settings.register_profile("plain", deadline=None, derandomize=True, max_examples=20)
settings.load_profile("plain" if PLAIN else "splinefeed")


def pytest_configure() -> None:
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # of a shell's background: what tests interrupt would inherit
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if PLAIN:
        np.seterr(all="ignore")  # as compiled kernels do; in all else the run with the compiler minds


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
        pytest.skip("no browser; on Debian: apt-get install chromium")
    with api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=program, args=QUIET.split())
        yield browser
        browser.close()
