"""Programs held against LinuxCNC's own interpreter: the same moves, arcs, feeds, tolerances, waits and refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from rs274_held import held_against, ours, tool_table
from rs274_twin import PROGRAM, run

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(PROGRAM is None, reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace"),
]

#: A program for each group of words; each runs in LinuxCNC as it stands.
PROGRAMS = {
    "planes": "G21 G90 F100\nG17 G2 X2 I1\nG3 X0 Y0 I-1 J0\nG18 G2 X2 Z0 I1 K0\nG3 Z4 X2 K2\nG19 G2 Y2 J1\n"
    "G3 Y0 Z4 J-1 F50\nG17 G2 I3\nG18 G3 K2 Y1\nG19 G3 J1 K1 X3 P3\nG17 G2 X1 Y1 Z5 I-1 P2",
    "radii": "G21 F100\nG2 X10 R5\nG3 X0 R-8\nG2 X3 Y4 R2.5\nG18 G3 X5 Z9 R30\nG19 G2 Y7 Z1 R-12\nG17 G3 X0 Y0 Z2 R9",
    "inches": "G20 G90\nF30\nG1 X1 Y2\nG2 X2 Y3 I1\nG21 G1 X1 Y1\nF100\nG20 G91 X.5 Z-.25\nG3 X0.1 Y0.1 R.1",
    "radii that differ": "F99\nG2 X50.028 I25\nG0 X0\nG3 X2000.9 I1000\nG20\nG0 X0\nG2 X1.0028 I.5\n"
    "G0 X0\nG2 X2000.28 I1000",
    "relative": "G91 F10\nG1 X1 Y2 Z3\nX1\nG2 X2 I1\nG90 X3 Y3 I-1 G3\nG91 G0 Z1 A30",
    "centres": "G90.1 F100\nG2 X2 Y0 I1 J0\nG91.1\nG2 X4 I1\nG90.1 G91\nG2 X2 Y0 I5 J0\n",
    "systems": "F100\nG10 L2 P1 X10 Y20\nG10 L2 P2 X-5 Z3\nG54 G1 X1\nG55 X1 Y1\nG10 L20 P2 X100\nX101\nG59.3 X0\n"
    "G10 L2 P0 Y-7\nY1\nG53 G1 X3\nG53 G0 Z0\nX5",
    "shifts": "F100\nG1 X5 Y5\nG92 X1\nX2 Y7\nG92.2\nX1\nG92.3\nX1\nG92 Y3 Z2\nG2 X3 Y5 I1 J1\nG92.1\nG1 X0",
    "feeds": "G94 F100\nG1 X1\nF20 X2\nF30\nX3\nG21 F1000 G1 Y1\nG0 X9\nG1 X0",
    "control": "F100\nG61 G1 X1\nG64 X2\nG64 P0.1 X3\nG64 P.2 Q.01 X4\nG61 X5",
    "waits": "F100\nG4 P.5\nG1 X1 M3 S100\nG4 P2 M8\nM5 M9\nT1 M6\nM0\nM1\nG0 X0",
    "comments": "(start)(more) G1 (x) X1 (y) F50 ; rest\n;\nn10 g1 y 2\nN20G1X3Y4\n\n  g 1 x - 5 . 5\nG01 X+.5 Y007.50",
    "parameters": "F100\n#1=3\n#2=[#1*2] #1=4\nG1 X#1 Y#2\n#1=5 X#1\nX[#1+1]\n#<wide>=4\n"
    "Y#<wide>\n#3=1\nX##3\nY[sin[30]*10]\n"
    "X[2**3+4/2-1] Y[7 mod 4]\nX[atan[1]/[1]] Y[sqrt[2]]\nX[abs[-3.5]] Y[fix[-2.5]]\nX[fup[2.1]] Y[round[2.5]]\n"
    "X[ln[exp[2]]] Y[acos[0.5]]\nX[1 gt 0] Y[1 eq 2]\nX[[1 lt 2] and [3 ge 3]] Y[0 or 0]\nX[1 xor 1] Y-#1\nX[-[#1]]\n"
    "X#5420 Y#5421\nX[-2**2]\nX[5 - 3 - 1] Y[2 ** 2 ** 3]\nX[-7 mod 4] Y[asin[-0.5]]\nX[tan[45]] Y[cos[60]]",
    "rotary": "F100\nG1 X1 A90\nG1 A45 B10 C-30\nG0 A0\nG91 A10\nG20 G90 X1 A20",
    "splines": "F100\nG5 X10 Y10 I1 J1 P-1 Q-1\nG5 X20 Y0 P-1 Q1\nG5.1 X25 Y5 I2 J3\nG1 Z1",
    "nurbs": "F100 G17\nG5.2 X3 Y5 P1 L3\nX5 Y5 P2\nX8 Y1 P1\nX9 Y9 P1\nG5.3\nG1 Z1",
    "inverse time": "G93 G1 X1 F2\nX3 F4\nG2 X5 I1 F1\nG0 X0\nG94 G1 X1 F60",
    "moved systems": "F100\nG1 X3 Y4\nG10 L2 P1 X10 Y20\nG1 X5\nG2 X7 I1 Z2\nG3 X5 R3\nG91 X1 Y1 R9\nG90\n"
    "G53 G0 X1\n"
    "G1 Y1\nG18 G2 X[#5420+2] Z#5422 I1 K0\nG17 G90.1 G1 X5 Y1\nG3 X7 I6 J1\nG1\nG91.1\nG10 L2 P2 X1\nG55 X2 Y3\n"
    "G10 L20 P0 X1\nX5 A10\n"
    "G10 L20 P1 Y7\nG54 X0 Y0\nG28.1 X4 Y5\nG28 X1\nX2\nG30\nX1 Z#5230\nG81 X1 Y2 Z-1 R1\nX5\nG80\nG92 X1 Y2\n"
    "G1 X4\nG41.1 D2\nX9\nY9\nX2\nG40\nG0 X1 Y1\nG92.1\nG10 L2 P1 X0\nX1\nY0",
    "threads": "M3 S600\nG0 X20 Z5\nG33 Z-5 K1.5\nG0 X22 Z5\nG33 X20 Z-5 K2\nG20 G33 Z-.3 K.05\nG21 G91 G33.1 Z-8 K.5\n"
    "S300 Z-3 K-1\nG90 G19 G33 Y3 Z0 K2\nG17 G0 X20 Z1\nG76 P1.5 Z-10 I-1 J.2 R1.5 K1 Q29.5 H2 E1 L2\n"
    "G0 Z1\nG76 P2 Z-10 I3 J.5 K1.2 R2\nG0 Z1 M4\nG91 G76 P2 Z-5 I3 J.7 K1 Q20 E1 L3 H1\nG90\n"
    "G76 P1 Z5 I-1 J.6 K1 Q10 E.5 L1\nG76 P1 Z-5 I-1 J.1 K.5 R.5",
    "a revolution": "S500 G95 F.1 M3\nG1 X1\nS800 X2\nX3\nX4 F.2\nG2 X6 I1\nG20\nF.01\nG1 X1\nG21\nF.1\nG81 X1 Z-3 R1\n"
    "G80 M5\nG94 F100 G1 X3\nG95 F.5\nX5\nG93 X6 F2",
    "kept modes": "G21 F60 G64 P.1 S100 M3 M7\nG1 X1\nM70 G20\nG91 G55 G18 G61.1 F9 S50 M4 M9 G90.1 G95\nX1\nM72\nX2 Y3"
    "\nG91 G3 X1 I.5\nM72\no1 sub\nM73 G20 F5\nG91 G1 X1\no1 if [#1]\nM71\no1 return\no1 endif\no1 endsub\n"
    "o1 call [0]\nX4 Y1\nM98 P7 L2\nX5\no1 call [1]\nX.1\nM72\nX9\nM2\nO7\nM73\nG91 X1 F20\nM99",
    "kept cycles": "F60\nM70 G99\nG98 G81 X1 Z-1 R1\nX2\nM72\nX3\nG0 X4\nG10 L2 P2 X5\nG55\nM70\nG54 X1\nM72\nX2",
    "feeds beside units": "G21 F60 G1 X9\nG20 F7\nX1\nG21 F60 X3\nF50 G20 G1 X2\nG21 F8 G3 X52.8 I1",
    "exact path in cycles": "F60 S100 M3 G64 P.1\nG0 X1 Z-5\nG81 X1 Z-1 R1\nX3\nG0 X4\nG61.1\nG82 X5 Z-2 R2 P.1\n"
    "G0 X6\nG64\nG83 X7 Z-3 R2 Q1\nG61\nG85 X8 Z-3 R1\nG0 X9 Z5",
    "existence": "#<a>=999\nG0 X[exists[#1]] Y[exists[#99999]] Z[exists[#<a>]] A[exists[#<b>]]\nX[exists[#5601]*5]",
    "ends": "G1 X1 F1\nM2\nG1 X2\n",
    "percent": "%\nG1 X1 F1\nX2\n%\nX3\n",
    "order in a line": "X1 F100 G1 G91\nG90 M3 S1 X5 G20\nG1 G21 G91 X1 Y1\nG0 G90 G54 G17 G40 G49 G80 X0 Y0 Z5",
    "modal": "G0 X1\nY2\nG1 F1 X2\nY3\nG2 X4 Y3 I1\nX6 I1\nG3 X8 I1\nG1\nX0\nG2 X8 Y3 I4\nI-4 J1",
    "block delete": "F100\nG1 X1\n/ G1 X2\n/X3 (kept)\nG1 X4",
}  # fmt: skip
#: What both refuse.
REFUSED = [
    "G1 X1 F1 X2", "G2 X1 F1", "F1 G2 X50.03 I25", "F1 G2 X8003 I4000",
    "G20 G2 X1.003 I.5 F1", "G20 G2 X2000.3 I1000 F1",
    "G2 X5 I1 F1", "G2 X1 Y1 R.1 F1", "G21 G20", "M3 M4", "G17 G18", "X1",
    "G1 F1 X1 (open", "G93 G1 X1", "G2 X1 I1 R1 F1", "G17 G2 X1 K1 F1", "G5 X1 Y1 F1", "G5.1 X1 Y1 F1", "G4",
    "G1 X[1/0] F1", "G1 X[sqrt[-1]] F1", "G92", "F-1", "G1 X F1", "Q1", "G1 X1 F1 I2", "G18 F1 G5 X1 Y1 I1 J1 P1 Q1",
    "G5.3", "G0 @5", "G91 G0 @5 ^3", "G0 X1 @5", "G53 G0 @5 ^3",
    "G28 @5 ^3", "G2 X2 I1 P-1 F1", "G53 G2 X1 I1 F1", "M1000", "M72", "M70 M3", "G123.4", "#1=",
    "G1 X[1 + F1", "G3 R5 F1",
]  # fmt: skip


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_moves_as_in_linuxcnc(tmp_path: Path, name: str) -> None:
    file = tmp_path / "part.ngc"
    end = "" if name in ("ends", "percent") else "\nM2\n"
    file.write_text(PROGRAMS[name] + end)
    twin = held_against(file)
    assert twin.error == "" and twin.moves


TOOL_PROGRAMS = [
    "T1 M6\nG43\nG0 Z5\nX1\nG49\nX2 Z5", "T2 M6 G43 H1\nG0 X1 Z5\nG49 X2", "G43 H2\nG0 X1 Z5\nG53 G0 Z0\nG49\nG53 Z0",
    "G43.1 Z3 X1\nG0 X1 Z1\nG43.1 Z5\nX1 Z1\nG43.2 H1\nX0 Z0", "G28", "G0 X3 Y4\nG28 Y1\nX1",
    "G43 H1\nG28\nG0 X1", "G43 H1\nG28 Z5\nG0 X1", "G43 H1\nG0 X1 Y1 Z1\nG28.1\nG0 X5\nG28\nG30 Z3\nG0 X1",
    "G10 L1 P1 Z3\nG43 H1\nG0 X1 Z1\nG53 G0 Z0", "G0 Z5\nG10 L10 P1 Z3\nG43 H1\nG0 X1 Z1", "G43 H0\nG0 Z1",
    "T1\nX1\nM6\nG43\nX2 Z2\nT7 M6\nG43\nX2 Z2\nG43 H0 X3 Z2", "G43 H1\nG92 Z0\nG0 X1 Z1\nG53 G0 Z0",
    "G43 H1\nG10 L20 P1 Z0\nG0 X1 Z1\nG53 G0 Z0", "G20 G43 H1\nG0 X1 Z1\nG21 X1 Z1", "G43 H1\nG81 X1 Z-1 R1\nG49 X2",
    "G43 H5\nG0 X1", "T5 M6\nX1", "G43.2\nX1", "G43.2 H1 Z1\nX1", "G43 H1.5\nX1", "G43 H-1\nX1", "T1.5 M6",
    "T0 M6\nX1 G43", "M61 Q1 G43\nG0 Z5", "M61 Q9", "M61 Q1\nM61", "G10 L11 P1 Z3\nG43 H1\nG0 X1 Z1",
    "G0 X2 Z5\nG92 Z1\nG10 L2 P1 Z7\nG10 L2 P9 X1 Z2\nG10 L11 P1 X1 Z3\nG43 H1\nG0 X0 Z1",
    "G10 L2 P9 X2\nG0 X5 Y1\nG10 L11 P1 X3\nG43 H1\nG0 X0 Y0", "G43 H1\nM70\nG49\nG0 X1 Z1\nM72\nX2 Z2",
    "G10 L2 P1 X2\nG0 X5 Y1\nG10 L10 P1 X3 Y2\nG43 H1\nG0 X0 Y0", "T1 M6\nG43\nM70\nG49\nX1 Z1\nM72\nX2 Z2",
    "G41.1 D2\nG0 X9\nY9\nG40\nT1 M6\nG0 Z5\nX1",
]  # fmt: skip


@pytest.mark.parametrize("program", TOOL_PROGRAMS)
def test_tools_and_reference_places_are_those_of_linuxcnc(tmp_path: Path, program: str) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(f"G21 F100 S100 M3\nG0 X0\n{program}\nM2\n")
    held_against(file, tool_table(tmp_path))


@pytest.mark.parametrize("line", REFUSED)
def test_what_linuxcnc_refuses_is_refused(tmp_path: Path, line: str) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(f"{line}\nM2\n")
    twin = run(file)
    assert twin.error
    assert ours(file)[1].startswith(f"{file}: line 1: ")


@pytest.mark.parametrize("name", ["cncjs_tball.gcode", "linuxcnc_nurbs.ngc", "cncjs_calibration.gcode"])
def test_programs_of_others_move_as_in_linuxcnc(tmp_path: Path, data_dir: Path, name: str) -> None:
    file = tmp_path / name
    file.write_bytes((data_dir / "gcode" / name).read_bytes())
    twin = held_against(file)
    if twin.error:
        assert "line 624" in ours(file)[1] and "r1=29.0000 r2=27.5862" in twin.error


def test_joints_of_five_axes_move_as_in_linuxcnc(tmp_path: Path, data_dir: Path) -> None:
    file = tmp_path / "part.ngc"
    file.write_bytes((data_dir / "five-axis" / "linuxcnc_joints.ngc").read_bytes())
    twin = held_against(file)
    assert twin.error == "" and len(twin.moves) == 7


def test_an_inch_program_without_an_end_moves_as_in_linuxcnc(tmp_path: Path, data_dir: Path) -> None:
    file = tmp_path / "part.ngc"
    file.write_bytes((data_dir / "gcode" / "gcodetoolpath_one-inch-circle.nc").read_bytes() + b"\nM2\n")
    assert held_against(file).error == ""


@pytest.mark.parametrize("as_", ["g5.2", "arcs", "g1"])
def test_what_is_written_is_read_by_linuxcnc(tmp_path: Path, as_: str) -> None:
    file = tmp_path / "part.ngc"
    sf.write(sf.shapes.butterfly(), file, as_=as_, feed=60, tolerance=0.01)
    twin = held_against(file)
    assert twin.error == "" and len(twin.moves) > 1


def random_program(rng: np.random.Generator, lines: int) -> str:
    """Lines of words that belong together, drawn at random; most of them run."""
    value = lambda: f"{rng.uniform(-20, 20):.{rng.integers(0, 5)}f}"  # noqa: E731
    out = ["G21 G90 G17 F100", "G1 X1 Y1 Z1"]
    for _ in range(lines):
        words = [str(rng.choice(["", "", "", "G0", "G1", "G90", "G91", "G20", "G21", "G92", "G55", "G54", "G64 P0.1"]))]
        if words[0] in ("", "G0", "G1"):
            words += [f"{axis}{value()}" for axis in "XYZABC" if rng.random() < 0.35]
        elif words[0] == "G92":
            words += [f"X{value()} Y{value()}"]
        if rng.random() < 0.25:
            radius = abs(float(value())) + 30.0
            plane, (a, b, across) = [("G17", "XYZ"), ("G18", "ZXY"), ("G19", "YZX")][rng.integers(3)]
            motion = rng.choice(["G2", "G3"])
            if rng.random() < 0.5:
                words = [plane, motion, f"{a}{value()} {b}{value()} {across}{value()} R{radius:.3f}"]
            else:  # a full circle, whose end is right by itself
                names = {"X": "I", "Y": "J", "Z": "K"}
                words = [plane, motion, f"{names[a]}{value()} {names[b]}{radius:.2f} {across}{value()}"]
                words += [f"P{rng.integers(1, 4)}"] if rng.random() < 0.5 else []
        if rng.random() < 0.1:
            words.append(str(rng.choice(["M3 S100", "M5", "M8", "(c)", "F200"])))
        out.append(" ".join(words))
    return "\n".join([*out, "M2", ""])


def random_cycles(rng: np.random.Generator, lines: int) -> str:
    """Canned cycles drawn at random, in all planes, absolute and incremental; most of them run."""
    value = lambda low, high: f"{rng.uniform(low, high):.{rng.integers(0, 4)}f}"  # noqa: E731
    plane = str(rng.choice(["G17", "G18", "G19"]))
    cycles = ["G73", "G81", "G82", "G83", "G85", "G86", "G89"]
    cycles += ["G74", "G84"] if plane == "G17" else []  # in other planes LinuxCNC 2.9 exchanges the axes of these two
    spindle = rng.choice(["M3", "M4"], p=[0.8, 0.2])
    out = [str(rng.choice(["G20", "G21"])), f"F100 S500 {spindle} {plane}", "G0 X9 Y9 Z9"]
    for _ in range(lines):
        words = [str(rng.choice(["G90", "G91", "G98", "G99"]))] if rng.random() < 0.3 else []
        kind = rng.random()
        code = str(rng.choice(cycles))
        if kind < 0.5:
            words.append(code)
            words += [f"{axis}{value(-9, 9)}" for axis in "XYZ" if rng.random() < 0.8]
            words += [f"R{value(-2, 14)}"] if rng.random() < 0.9 else []
            words += [f"Q{value(0.5, 5)}"] if code in ("G73", "G83") else []
            words += [f"P{value(0, 2)}"] if code in ("G74", "G82", "G84", "G86", "G89") else []
            words += [f"L{rng.integers(1, 4)}"] if rng.random() < 0.3 else []
        elif kind < 0.85:
            words += [f"{axis}{value(-9, 9)}" for axis in "XY" if rng.random() < 0.8]
        else:
            words = [str(rng.choice(["G80", "G0 X1 Z9", "M5", "M3", "G4 P.1", "G10 L2 P1 X1 Z2"]))]
        out.append(" ".join(words))
    return "\n".join([*out, "M2", ""])


def compare_random(
    folder: Path, seed: int, count: int, made: Callable[[np.random.Generator, int], str] = random_program
) -> None:
    rng = np.random.default_rng(seed)
    file = folder / "part.ngc"
    for _ in range(count):
        file.write_text(made(rng, 12))
        try:
            held_against(file)
        except AssertionError as error:
            raise AssertionError(f"seed {seed}:\n{file.read_text()}") from error


def test_cycles_made_up_move_as_in_linuxcnc(tmp_path: Path) -> None:
    compare_random(tmp_path, 0, 60, random_cycles)


def test_programs_made_up_move_as_in_linuxcnc(tmp_path: Path) -> None:
    compare_random(tmp_path, 0, 40)
