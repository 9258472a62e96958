"""Curves and laws that the interpolation tests share."""

from __future__ import annotations

import pytest

import motions
from splinefeed import Path, TimeLaw


@pytest.fixture(scope="session")
def butterfly() -> Path:
    return motions.butterfly()


@pytest.fixture(scope="session")
def smooth() -> Path:
    return motions.smooth()


@pytest.fixture(scope="session")
def smooth_law(smooth: Path) -> TimeLaw:
    return motions.smooth_law(smooth)
