"""What a program will not do with splinefeed as LinuxCNC's planner, without LinuxCNC."""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import program
from linuxcnc_machine import mill
from splinefeed.live.linuxcnc_refusals import refused

MILL = mill(60.0, 1000.0, 50_000.0)


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        (["M3 S600", "G33 Z-5 K1", "G33.1 Z-9 K1"], ""),
        (["M3 S3600", "G33 Z-5 K1"], "line 2: will not run: in step with the spindle it goes at 60 mm/s"),
        (["M3 S4200", "G33 X30 Z-30 K1"], ""),  # 70 mm/s along both, 49.5 mm/s for each
        (["M3 S6000", "G1 X5 F600", "N10G33.1Z-5K1"], "line 3: will not run"),
        (["M3 S6000", "G33 Z-5 K1", "G33 Z-9 K1"], "lower S or the pitch; likewise 1 more"),
        (["M3 S6000", "O1 sub", "G33 Z-5 K1", "O1 endsub", "O1 call", "O1 call"], "line 3: will not run"),
        (["S600", "G33 Z-5 K1"], "line 2: G33 needs the spindle to turn; write M3 or M4 before it: it will not run"),
        (["M3", "G95 F1 G1 X5"], "line 2: feed a revolution (G95) needs the speed of the spindle"),
        (["M3 S6000", "G18 G8", "G0 X10 Z0", "G76 P1.5 Z-25 I-1 J0.4 R1 K1"], "line 4: will not run"),
        (["G1 X5 F600", "G76"], ""),  # LinuxCNC says itself what is wrong with it
    ],
)
def test_a_program_is_looked_through(lines: list[str], wanted: str, tmp_path: Path):
    said: list[str] = []
    found = refused(str(program(tmp_path, *lines)), MILL, said.append)
    assert (wanted in found) if wanted else not found
    assert len(said) == (lines[-1] == "G76")


def test_what_is_looked_for_is_found_at_any_place_of_a_long_program(tmp_path: Path):
    lines = ["G0 X1 Y1"] * (2**18 // 9 - 1)
    for shift in range(12):  # across the end of what is looked at in one go
        end = ["(" + "-" * shift + ")", "M3 S6000 G33 Z-5 K1"]
        assert "will not run" in refused(str(program(tmp_path, *lines, *end)), MILL, print)


def test_a_program_without_motion_that_may_be_refused_is_not_read(tmp_path: Path):
    said: list[str] = []
    assert refused(str(program(tmp_path, "G1 X5 F600", "no G code")), MILL, said.append) == ""
    assert refused(str(tmp_path / "not there.ngc"), MILL, said.append) == ""
    assert len(said) == 1
