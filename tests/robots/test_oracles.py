"""Arms against pinocchio and libfranka's own limiter, where they are installed, as `python -m benchmarks robots`."""

from __future__ import annotations

import pytest
from benchmarks import robots


@pytest.mark.parametrize("measure", ["_pinocchio", "_franka"])
def test_what_others_say(measure, monkeypatch):
    monkeypatch.setattr(robots, "PATHS", 2)
    try:
        rows = getattr(robots, measure)()
    except ImportError as error:
        pytest.skip(f"not installed: {error}")
    assert rows
    assert [row for row in rows if row[3] != "yes"] == []
