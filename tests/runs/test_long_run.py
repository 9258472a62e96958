"""A motion too long to keep gives the numbers of one that is kept, every peak, and files in chunks."""

from __future__ import annotations

import json

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.cli.main import command_line
from splinefeed.runs import result
from splinefeed.runs import run as runs
from splinefeed.runs.run import measured

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_acceleration=450, axis_jerk=18000, chord_error=1e-3)
HOW = {"period": 2e-3, "strategy": "look-ahead"}


@pytest.fixture(scope="module")
def both():
    path, table = sf.shapes.butterfly(), sf.Machine.load("xytheta")
    with pytest.MonkeyPatch.context() as patch:
        kept = sf.run(path, LIMITS, machine="xytheta", **HOW)
        patch.setattr(runs, "LONG", 1000)
        patch.setattr(runs, "MOST_KEPT", 1200)
        patch.setattr(runs, "CHUNK", 700)
        yield kept, sf.run(path, LIMITS, machine=table, **HOW)


def rounded(numbers: dict) -> dict:
    """Without what depends on the order of a sum or on the size of a chunk: roundings."""
    text = json.dumps(numbers, default=float)
    numbers = json.loads(text, parse_float=lambda digits: float(f"{float(digits):.12g}"))
    for each in numbers.get("limits", {}).values():
        each.pop("floor")
    return numbers


def test_the_numbers_are_those_of_a_run_that_is_kept(both):
    kept, long = both
    assert kept.whole and not long.whole
    assert rounded(long.numbers()) == rounded(kept.numbers())
    assert len(long.kept) < len(kept.points) / 3
    assert long.ticks == len(kept.points)
    assert rounded(long.served.tally.numbers()) == rounded(kept.served.tally.numbers())
    assert long.served.off_law == kept.served.off_law
    assert len(kept.served.response) == kept.ticks > 3 * len(long.served.response)


def test_every_peak_is_among_the_ticks_of_its_figures(both):
    kept, long = both
    for name in ("velocity", "acceleration", "jerk"):
        whole, thin = getattr(kept.motion, name), getattr(long.motion, name)
        assert np.array_equal(thin.max(axis=0), whole.max(axis=0))
        assert np.array_equal(thin.min(axis=0), whole.min(axis=0))
    assert np.array_equal(long.use.share.max(axis=0), kept.use.share.max(axis=0))
    assert long.ripple.max == kept.ripple.max
    # not only the greatest of all: that of every stretch is there, or a greater one beside it in its block of ticks
    ticks = np.round(long.kept.t / HOW["period"])
    for start in range(0, 3500, 500):
        jerk = kept.motion.jerk[start : start + 500, 0]
        near = (ticks >= start - 250) & (ticks < start + 750)
        assert long.motion.jerk[near, 0].max() >= jerk.max()
        assert long.motion.jerk[near, 0].min() <= jerk.min()


def test_its_setpoints_come_in_chunks_and_are_the_same(both):
    kept, long = both
    chunks = list(long.setpoints())
    assert len(chunks) > 3
    assert np.array_equal(np.concatenate([chunk.position for chunk in chunks]), kept.points.position)
    assert np.array_equal(long.points.position, kept.points.position)


def test_setpoints_that_do_not_fit_in_memory_are_refused(both, monkeypatch):
    monkeypatch.setattr(result, "MOST_TICKS", 1000)
    with pytest.raises(sf.errors.LimitsError, match=r"is not kept in memory; use setpoints\(\), which gives chunks"):
        _ = both[1].points


def test_a_limit_that_is_not_kept_is_found(both):
    kept, _ = both
    tight = sf.Limits(feed=60, axis_jerk=9000)
    found = measured(
        kept.path, tight, kept.law, lambda chunk: sf.interpolate(kept.path, kept.law, chunk=chunk), kept.ticks
    )
    assert not found.ok
    assert found.numbers()["limits"]["axis_jerk.x"]["share"] == pytest.approx(2.0, rel=0.01)


def test_the_command_writes_a_long_run_and_its_report_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(runs, "LONG", 3000)
    words = ["run", "butterfly", "--axis-accel", "450", "--axis-jerk", "18000", "--strategy", "look-ahead"]
    with pytest.raises(SystemExit) as ended:
        command_line.main(
            [*words, "--machine", "xytheta", "-o", "out", "--format", "hdf5", "--format", "csv", "--json"]
        )
    assert ended.value.code == 0
    page = json.loads(capsys.readouterr().out)
    assert any(note.startswith("more than 3000 ticks: figures over time are areas") for note in page["notes"])
    assert len(sf.load("out/response.h5", sf.Response)) == page["ticks"]
    assert page["contour_error_max_mm"] > 0.0
    assert "methods" not in page
    points = sf.load("out/setpoints.h5")
    assert len(points) == page["ticks"] > 3000
    assert points.settings["command"] == page["command"]
    text = (tmp_path / "out/report.html").read_text()
    assert f"{page['ticks']} setpoints" in text
    with pytest.raises(SystemExit) as ended:
        command_line.main(["report", "out", "-o", "again.html", "--json"])
    assert ended.value.code == 0
    again = json.loads(capsys.readouterr().out)
    assert again["ripple_max"] == page["ripple_max"]
    assert again["bound_by"] == page["bound_by"]
