"""What every test shares: the Hypothesis profile and the folder of sample files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# No deadline: the first example may wait for a compiler. In CI the examples are the same every time.
settings.register_profile("splinefeed", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("splinefeed")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of the sample files."""
    return Path(__file__).parent / "data"
