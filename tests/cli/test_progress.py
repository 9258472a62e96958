"""What commands say of their progress: elapsed time and share, on terminals and elsewhere."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.cli import progress
from splinefeed.telling import percent, tell


@pytest.fixture
def spoken(monkeypatch, capsys):
    """What is written to a stderr that is no terminal, with short waits; not whether kernels are compiled in here."""
    monkeypatch.setattr(progress, "_remark", lambda: "")
    for name, seconds in (("FIRST_WORD", 0.02), ("PATIENCE", 0.1), ("AGAIN", 0.4)):
        monkeypatch.setattr(progress, name, seconds)
    return lambda: capsys.readouterr().err


def test_long_work_is_spoken_of_again_with_time_and_share(spoken):
    with progress.busy() as say:
        say("making the motion")
        for k in range(30):
            tell("planning", k, 29)
            time.sleep(0.05)
    lines = spoken().splitlines()
    said = re.compile(r"splinefeed: making the motion: planning (\d+) % \(\d+ s\)")
    found = [said.fullmatch(line) for line in lines]
    assert all(found), lines
    shares = [int(each[1]) for each in found if each]
    assert len(shares) >= 3
    assert shares == sorted(set(shares))


def test_short_work_is_not_spoken_of(spoken):
    with progress.busy() as say:
        say("reading")
    assert spoken() == ""


def test_a_long_path_tells_how_far_its_plan_and_its_check_are():
    t = np.linspace(0.0, 400.0, 4001)
    path = sf.paths.fit(np.stack([t, 5.0 * np.sin(t)], axis=1), tolerance=1e-3).path()
    heard: dict[str, list[float]] = {}
    run = sf.run(
        path,
        sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000),
        strategy="look-ahead",
        on_progress=lambda what, done, of: heard.setdefault(what, []).append(done / of),
    )
    assert run.verdict.ok
    assert set(heard) >= {"planning", "measuring", "checking the law"}
    for shares in heard.values():
        assert shares == sorted(shares)
        assert shares[-1] == pytest.approx(1.0)
    assert len(heard["planning"]) > 2


def test_a_share_is_at_most_the_whole():
    assert [percent(1, 3), percent(4, 3), percent(0, 0)] == ["33 %", "100 %", "0 %"]
