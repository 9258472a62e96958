"""Five-axis programs from an empty folder to a report and a check: the how-to's, and such that CAM systems made."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

import splinefeed as sf
from splinefeed.formats.registry import read_all
from splinefeed.kinematics import kinematics

#: The program that the how-to shows.
PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "five-axis.md").read_text(encoding="utf-8")
BLADE = re.findall(r"```\n(%\nO0012.*?)```", PAGE, re.DOTALL)[0]
#: Programs that CAM systems made, as LinuxCNC brings them for its simulated trunnions; they are not ours to pass on.
DEMOS = Path("/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/vismach/5axis/table-rotary-tilting/demos")
needs_demos = pytest.mark.skipif(
    not DEMOS.is_dir(), reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace"
)
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
    assert any("both ways, side by side in the same order (tolerance 0.01 mm)" in note for note in page["notes"])
    assert "tool" in (folder / "out" / "report.html").read_text()
    for words in ("--tools tools.tbl", "--offsets G54=5,0,-20", "--angle-tolerance 0.00087266", "--smooth 0.01"):
        assert words in page["command"]
    checked = splinefeed("check", "out/setpoints.h5", "--json")
    numbers = json.loads(checked.stdout)
    # the check reads the program again as the run did, tool length and work offset with it
    assert checked.exit_code == 0 and numbers["off_curve_max_mm"] < 1e-9
    # Z of the first joint: the tip at the offset, tilted by A, with the tool's length above it
    assert page["limits"]["travel.z"]["worst"] > 80.0


def test_a_program_that_begins_upright_turns_its_table_before_the_tool_tilts(
    splinefeed: Callable[..., Result], folder: Path
) -> None:
    lines = ["TRAORI", "G0 X0 Y0 Z30 A3=0 B3=0 C3=1", "G1 Z0 F1000", "X20", "X30 A3=0 B3=0.3 C3=1"]
    lines += ["X60 Y10 A3=0.2 B3=0.3 C3=1", "X70 A3=0 B3=0 C3=1", "X80", "X90 A3=-0.3 B3=0.1 C3=1", "TRAFOOF", "M30"]
    (folder / "up.mpf").write_text("\n".join([*lines, ""]))
    done = splinefeed("run", "up.mpf", "--machine", "trunnion", "--no-figures", "-o", "out", *QUICK)
    page = json.loads(done.stdout)
    assert done.exit_code == 0 and page["ok"] and page["axes"]["c"]["velocity"] > 1.0
    checked = json.loads(splinefeed("check", "out/setpoints.h5", "--json").stdout)
    assert checked["ok"] and checked["off_axis_max_rad"] < 1e-9


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
        (("blade.nc", *machine, "--smooth", "1um", "--angle-tolerance", "90deg"), "the tolerance of the tool axis is"),
        (("blade.nc", *machine, "--angle-tolerance", "1deg"), "--angle-tolerance: needs --smooth"),
    ):
        done = splinefeed("run", *words, "--no-figures")
        assert done.exit_code == 2, words
        assert said in done.stderr, (words, done.stderr)
        assert len(done.stderr.strip().splitlines()) == 1
    with pytest.raises(sf.errors.FormatError, match="line 8: X, Y and Z are the tool's tip; such a program"):
        sf.formats.read_parts("blade.nc")


def words_of(line: str) -> dict[str, float]:
    """Letters and numbers of a line, comments left out."""
    found = re.findall(r"([A-Z])\s*(-?[\d.]+)", re.sub(r"\(.*?\)", "", line))
    return {letter: float(number) for letter, number in found}


@pytest.mark.slow
@pytest.mark.linuxcnc
@needs_demos
def test_a_cam_program_of_an_impeller_keeps_every_limit(splinefeed: Callable[..., Result], folder: Path) -> None:
    lines = (DEMOS / "impeller-7bl-xyzac.ngc").read_text(encoding="utf-8").splitlines()[:250]
    (folder / "impeller.ngc").write_text("\n".join([*lines, "M30", ""]), encoding="utf-8")
    path = sf.read(folder / "impeller.ngc")
    assert isinstance(path, sf.ToolPath) and path.lines is not None and path.tool_axis is not None
    assert len(path.curves) > 200 and path.rotary == ("a", "c")
    for curve, axis, number in zip(path.curves, path.tool_axis, path.lines, strict=True):
        said = words_of(lines[number - 1])
        assert np.array_equal(curve.control_points[-1], [said["X"], said["Y"], said["Z"]])
        assert np.array_equal(np.degrees(axis.control_points[-1]).round(9), [said["A"], said["C"]])
    given = ("--machine", "trunnion", "--smooth", "10um", "--angle-tolerance", "0.1deg", "--no-figures")
    page = json.loads(splinefeed("run", "impeller.ngc", *given, "-o", "out", *QUICK).stdout)
    assert page["ok"] and max(limit["share"] for limit in page["limits"].values()) <= 1.0 + 1e-6
    checked = splinefeed("check", "out/setpoints.h5", "--json")
    assert checked.exit_code == 0 and json.loads(checked.stdout)["off_curve_max_mm"] < 1e-12


@pytest.mark.slow
@pytest.mark.linuxcnc
@needs_demos
def test_cam_programs_of_a_boat_keep_every_limit() -> None:
    for letters, machine in (("xyzac", kinematics("xyzac-trt")), ("xyzbc", kinematics("xyzbc-trt"))):
        limits = sf.Limits(axis_velocity=100.0, axis_acceleration=500.0, axis_jerk=3000.0, feed=50.0)
        paths = read_all(DEMOS / f"boat-{letters}.ngc")
        assert len(paths) >= 10
        for tool in paths[1::3]:
            path = sf.kinematics.JointPath(tool, machine)
            law = sf.plan(path, limits, period=2e-3, strategy="look-ahead")
            verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
            assert verdict.ok, (tool.name, verdict.problems)
