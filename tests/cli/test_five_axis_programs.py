"""A five-axis program from the command line, from an empty folder to a report and a check."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

#: The program that the how-to shows.
PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "five-axis.md").read_text(encoding="utf-8")
BLADE = re.findall(r"```\n(%\nO0012.*?)```", PAGE, re.DOTALL)[0]
QUICK = ("--strategy", "look-ahead", "--period", "4ms", "--json")


@pytest.mark.slow
def test_the_how_to_s_program_goes_to_a_report_that_the_check_agrees_with(
    splinefeed: Callable[..., Result], folder: Path
) -> None:
    (folder / "blade.nc").write_text(BLADE)
    (folder / "tools.tbl").write_text("T1 P1 Z80 D6\n")
    given = ("--tools", "tools.tbl", "--offsets", "G54=5,0,-20", "--smooth", "10um", "--angle-tolerance", "0.05deg")
    done = splinefeed("run", "blade.nc", "--machine", "trunnion", *given, "-o", "out", *QUICK)
    page = json.loads(done.stdout)
    assert done.exit_code == 0 and page["ok"] and list(page["axes"]) == ["x", "y", "z", "a", "c"]
    assert any("and back, side by side in the same order (tolerance 0.01 mm)" in note for note in page["notes"])
    assert "tool" in (folder / "out" / "report.html").read_text()
    for words in ("--tools tools.tbl", "--offsets G54=5,0,-20", "--angle-tolerance 0.00087266", "--smooth 0.01"):
        assert words in page["command"]
    checked = splinefeed("check", "out/setpoints.h5", "--json")
    numbers = json.loads(checked.stdout)
    # the check reads the program again as the run did, tool length and work offset with it
    assert checked.exit_code == 0 and numbers["off_curve_max_mm"] < 1e-9
    # Z of the first joint: the tip at the offset, tilted by A, with the tool's length above it
    assert page["limits"]["travel.z"]["worst"] > 80.0


def test_errors_name_line_axis_and_mend(splinefeed: Callable[..., Result], folder: Path) -> None:
    (folder / "blade.nc").write_text(BLADE)
    (folder / "b.nc").write_text("G21\n(B1 is a comment)\nG0 X0 Y0 Z0 B0\nG1 X10 B20 F300\nM2\n")
    (folder / "far.nc").write_text("G43.4 H1\nG0 X0 Y0 Z0 A0 C0\nG1 X10 A-30 F300\nX20 A-130\nG49\nM2\n")
    machine = ("--machine", "trunnion")
    for words, said in (
        (("b.nc", *machine), "b.nc: turns the rotary axis B (line 3), which trunnion does not have; its axes are"),
        (("far.nc", *machine), "(line 4); its travel is -110 to 110 deg; mount"),
        (("blade.nc", "--machine", "router"), "no [kinematics], which a tool path needs (line 9); add them"),
        (("blade.nc",), "has a tool axis, which only a machine can follow; give a machine"),
        (("blade.nc", *machine, "--by-windows"), "blade.nc: line 8: X, Y and Z are the tool's tip; such a program"),
        (("blade.nc", *machine, "--smooth", "1um", "--angle-tolerance", "90deg"), "the tolerance of the tool axis is"),
        (("blade.nc", *machine, "--angle-tolerance", "1deg"), "--angle-tolerance: says how to smooth"),
    ):
        done = splinefeed("run", *words, "--no-figures", "--no-compare")
        assert done.exit_code == 2, words
        assert said in done.stderr, (words, done.stderr)
        assert len(done.stderr.strip().splitlines()) == 1
