"""`splinefeed pulses`: words from files of setpoints, back to positions, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import motions
import splinefeed as sf


@pytest.fixture
def points(folder):
    path = motions.smooth()
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20_000), period=1e-3)
    found = sf.interpolate(path, law, period=1e-3)
    sf.save(found, folder / "points.h5")
    return found


def test_the_clock_that_is_enough_is_found(splinefeed, points):
    page = json.loads(splinefeed("pulses", "points.h5", "--pulses", "x=1000,y=1000", "--json").stdout)
    counts = np.rint(points.position * 1000)
    fastest = int(np.max(np.abs(np.diff(counts, axis=0))))
    assert page["fastest"]["pulses"] == fastest
    assert page["slots_per_period"] == -(-fastest // 16) * 16
    assert page["pulse_clock_hz"] == pytest.approx(1000.0 * page["slots_per_period"])
    assert page["off_max_pulses"] <= 0.5 + 1e-9
    assert page["files"] == []
    assert [page["pulses_plus"][a] - page["pulses_minus"][a] for a in "xy"] == (counts[-1] - counts[0]).tolist()


def test_words_and_back(splinefeed, points, folder):
    name = "words.bits"
    made = splinefeed("pulses", "points.h5", "--machine", "xytheta", "--clock", "256kHz", "-o", name)
    assert made.exit_code == 0, made.output
    assert "256 slots in each, a pulse clock of 256 kHz" in made.stdout
    assert "decoded again: at most 0.5 pulses off a setpoint" in made.stdout
    back = splinefeed("pulses", name, "--decode", "-o", "back.csv")
    assert back.exit_code == 0, back.output
    table = np.loadtxt(folder / "back.csv", delimiter=",", skiprows=1)
    assert (folder / "back.csv").read_text().splitlines()[0] == "t [s],x [mm],y [mm]"
    np.testing.assert_allclose(table[:, 1:], np.rint(points.position * 4000) / 4000, rtol=0, atol=1e-12)
    np.testing.assert_allclose(table[:, 0], points.t, rtol=0, atol=1e-9)


def test_what_is_refused(refused, points, folder):
    assert refused("pulses", "points.h5") == (
        "the size of a pulse is missing; give either --machine NAME or --pulses x=1000,y=1000"
    )
    assert refused("pulses", "points.h5", "--pulses", "x=1000") == (
        "pulses_per_unit is {'x': 1000.0}; give one scale for each of x, y"
    )
    assert refused("pulses", "points.h5", "--pulses", "x=1,y=zero") == (
        "--pulses: 'x=1,y=zero' cannot be read; write for example x=1000,y=1000"
    )
    assert refused("pulses", "points.h5", "--pulses", "x=1,y=nan").startswith("pulses_per_unit['y']")
    assert (
        refused("pulses", "points.h5", "--pulses", "x=1,y=0") == "pulses_per_unit['y'] is 0; it must be greater than 0"
    )
    assert refused("pulses", "points.h5", "--machine", "xytheta", "--clock", "200kHz") == (
        "--clock: 200 slots in a period of 0.001 s; it must be a multiple of 16: take 192 kHz or 208 kHz"
    )
    fast = refused("pulses", "points.h5", "--machine", "xytheta", "--clock", "32kHz", "-o", "w.bits")
    assert "pulses are needed before the next tick" in fast
    assert fast.endswith("take more slots per period or fewer than 4000 pulses per mm")
    assert refused("pulses", "points.h5", "--machine", "lintable").startswith(
        "machine 'lintable': axis x has no encoder"
    )
    assert refused("pulses", "points.h5", "--decode").startswith("points.h5: needs points.h5.json beside it")
    assert refused("pulses", "points.h5", "--decode", "--clock", "1MHz").startswith("--clock: ")
    assert refused("pulses", "points.h5", "--machine", "xytheta", "-o", "w.txt").startswith("w.txt: ")
    assert refused("pulses", "none.h5", "--machine", "xytheta").startswith("none.h5: no such file")
