"""What every test shares: the Hypothesis profile, the folder of sample files, and a browser."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# No deadline: the first example may wait for a compiler. In CI the examples are the same every time.
settings.register_profile("splinefeed", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("splinefeed")


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
