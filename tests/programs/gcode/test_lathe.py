"""Programs of lathes are refused as such: read as a mill's they move elsewhere and take other times.

After cncwebsim#2 and public lists of lathe programs; Fanuc's manual of lathes, B-64484EN-1.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import path_of, refusal

LATHES = {
    "feed": [
        "%",
        "O0101 (OUTSIDE TURNING)",
        "G50 S2500",
        "G21 G40 G99",
        "T0101",
        "G96 S180 M03",
        "G00 X52. Z2.",
        "M30",
    ],
    "cycles": ["O0102", "G97 S500 M03", "G00 X52. Z2.", "G90 X48. Z-30. F0.2", "X44.", "M30"],
    "thread": ["O0102", "G97 S500 M03", "G00 X22. Z5.", "G92 X19.5 Z-20. F1.5", "X19.", "M30"],
    "steps": ["O0103", "G97 S500 M03", "G00 X30. Z5.", "G01 W-20. F0.2", "U5.", "M30"],
    "roughing": ["O0104", "G00 X52. Z2.", "G71 U2. R1.", "G71 P10 Q20 U0.5 W0.1 F0.25", "N10 G00 X20.", "N20 X52."],
    "no number": ["G28 U0 W0", "G00 X52 Z2", "G71 P10 Q20 U0.5 W0.1 F0.25", "N10 G00 X20", "N20 X52", "M30"],
    "G76": ["G97 S600 M3", "G0 X25 Z5", "G76 P010060 Q100 R0.05", "G76 X21.5 Z-25. P1624 Q500 F2.5", "M30"],
    "small": ["o0105", "g0x50z2", "g76p021060q50r.02", "m30"],
    "tools": ["O0106", "T0202 M8", "G97 S900 M3", "G0 X20. Z1.", "G1 Z-10. F.1", "M30"],
    "facing": ["O0107", "G97 S900 M3", "G0 X40. Z1.", "G94 X-1. Z0 F.1", "Z-.5", "M30"],
}


@pytest.mark.parametrize("name", LATHES)
def test_a_lathe_program_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    assert "shows a lathe's program" in refusal(tmp_path, *LATHES[name])


def test_the_line_of_the_sign_is_named(tmp_path: Path) -> None:
    assert refusal(tmp_path, *LATHES["feed"]).startswith("line 3: G50 S shows a lathe's program (diameters, turning")


@pytest.mark.parametrize(
    "lines",
    [
        ["O0001", "G21 G90 G54", "G0 X0 Y0 Z5.", "G92 X0 Y0 Z5.", "T0101", "G1 X5. F100.", "M30"],
        ["O0002", "T1 M6", "G90 G0 X5.", "G1 Z-1. F100.", "G90 G1 X9. Z-2. F50.", "M30"],
        ["G90 X5 Z1 F100 G1", "G96 S100 D2000 M3 G95 F.1", "X3", "M2"],  # LinuxCNC, radii
        ["G0 X0 Y0 U0 V0", "G1 X5 Y5 U5 V5 F100", "M2"],
        ["O0003 (G71 P10 Q20)", "G1 X5. F100.", "M30"],
    ],
)  # fmt: skip
def test_what_a_mill_may_have(tmp_path: Path, lines: list[str]) -> None:
    assert path_of(tmp_path, *lines).length > 0.0


@pytest.mark.parametrize(
    ("lines", "sign"),
    [
        (["N10 G18 G54 DIAMON", "N20 G0 X52 Z2"], "line 2: DIAMON"),
        (["G18 G95", "G96 S180 LIMS=2500 M3", "G0 X52 Z2"], "line 3: LIMS="),
        (["G18 G95", "G96 S180 M3", "G0 X52 Z2"], "line 3: G96"),
        (["G0 X52 Z2", 'CYCLE95("A:B",1.5,0.1,0.2,0)'], "line 3: a turning cycle"),
        (["G0 X52 Z2", "CYCLE930(30,-20,5,5,3)"], "line 3: a turning cycle"),
    ],
)
def test_lathes_of_siemens_are_refused(tmp_path: Path, lines: list[str], sign: str) -> None:
    """HadiElnemr/G-Codes-Sinumerik-840-D, turning: X is a diameter unless DIAMOF is said."""
    said = refusal(tmp_path, "; SINUMERIK 828D", *lines)
    assert said.startswith(f"{sign} shows a lathe's program") and said.endswith("where X is a radius, write DIAMOF")


def test_a_siemens_lathe_by_radius_is_read(tmp_path: Path) -> None:
    lines = ["G18 G90 G71 DIAMOF ; not DIAMON", "LIMS=3000", "G95 S1000 M3", "G0 X=10 Z=2", "G1 Z-20 F0.2"]
    path = path_of(tmp_path, "; SINUMERIK", *lines, start=(10, 0, 2))
    assert path.length == pytest.approx(22.0) and path.feeds[0] == pytest.approx(200.0 / 60.0)


def test_a_lathe_of_heidenhain_is_refused(tmp_path: Path) -> None:
    lines = ["0 BEGIN PGM T MM", "1 FUNCTION MODE TURN", "2 L X+52 Z+2 R0 FMAX"]
    assert "'FUNCTION MODE TURN' is a function of the control or of a lathe" in refusal(tmp_path, *lines)
    assert path_of(tmp_path, lines[0], "1 FUNCTION MODE MILL", "2 L X+0 FMAX", "3 L X+9 F100").length == 9.0
