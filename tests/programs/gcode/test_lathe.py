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
    "per turn by G99": ["O0108", "G21 G99 S1000 M3", "G0 X20. Z2.", "G1 Z-10. F0.2", "X30.", "M30"],
    "per turn by G95": ["O0109", "G18 G21 G95 G97 S1000 M3", "G0 X20. Z2.", "G1 Z-10. F0.2", "M30"],
    "G32": ["O0110", "G97 S500 M3", "G0 X20. Z5.", "G32 Z-20. F1.5", "M30"],
    "pecks": ["O0111", "G0 X0. Z2.", "G74 R1.", "G74 Z-20. Q5000 F0.1", "M30"],
    "no number, tools": ["G21 G40", "T0303", "G97 S900 M3", "G0 X20. Z1.", "G1 Z-10. F.1", "M30"],
    "no number, G99": ["G21 G99", "S900 M3", "G0 X20. Z1.", "G1 Z-10. F.1", "M30"],
    "Mach3": ["(Mach3Turn)", "G21 G90 M3 S500", "G0 X10 Z2", "G1 Z-10 F50", "M30"],
    "thread of Mach3": ["(Mach3)", "G21 M3 S500", "G0 X10 Z2", "G76 X8 Z-10 Q1 P1 H0.2 I30 R0.1 K1", "M30"],
    "per turn in Mach3": ["(Mach3)", "G18 G21 G95 M3 S500", "G0 X10 Z2", "G1 Z-10 F.1", "M30"],
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
        ["O0004", "G21 G90 G98 S900 M3", "G0 X5. Z2.", "G1 Z-1. F100.", "M30"],
        ["O0005", "G21 G0 X5. Z9.", "G99 G81 Z-3. R2. F80.", "X9.", "G80", "M30"],
        ["O0006", "T1 M6", "S500 M3 G95", "G0 X5. Z2.", "G1 Z-1. F.2", "M30"],
        ["O0007", "S500 M3 G95", "G0 X5. Y0. Z2.", "G1 Z-1. F.2", "M30"],
        ["O0008", "G18 G0 X0. Y0. Z5.", "G2 X10. Z5. I5. F100.", "M30"],
        ["O0009", "T303", "G90 G0 X5. Z2.", "T3 M6", "G1 Z-1. F90.", "M30"],
        ["O0010 (ENGRAVE ALONG X)", "G21 G90 G17", "T0101", "G0 X0. Z5.", "G1 Z-1. F100.", "X80. F400.", "M30"],
        ["G21", "T0202", "G0 X0 Z5", "G43 H2", "G1 Z-1 F100", "X50", "M2"],
        ["(Mach3)", "G18 G95 M3 S500", "G0 X10 Y0 Z2", "G1 Z-10 F.1", "M30"],
    ],
)  # fmt: skip
def test_what_a_mill_may_have(tmp_path: Path, lines: list[str]) -> None:
    assert path_of(tmp_path, *lines).length > 0.0


TOOL_ALONE = ["G21 G90", "T0101", "G0 X0 Z5", "G1 Z-1 F100", "X50", "G0 Z5", "M2"]


@pytest.mark.parametrize("number", [[], ["O0011"]])
def test_a_tool_with_its_offset_and_feeds_a_minute_are_asked_for(tmp_path: Path, number: list[str]) -> None:
    said = refusal(tmp_path, *number, *TOOL_ALONE)
    assert said.startswith(f"line {len(number) + 2}: a tool with its offset where no line moves Y may be a lathe's or")
    assert said.endswith("name its control (option dialect)")
    assert path_of(tmp_path, *number, *TOOL_ALONE, dialect="fanuc").length == pytest.approx(67.0)


@pytest.mark.parametrize("number", [[], ["O0012"]])
def test_feeds_of_a_turn_alone_are_asked_for(tmp_path: Path, number: list[str]) -> None:
    lines = [*number, "G21 S1000 M3", "G0 X52 Z2", "G1 Z-30 F0.2", "X54", "M30"]
    said = refusal(tmp_path, *lines)
    assert said.startswith(f"line {len(number) + 3}: F0.2 where no line moves Y may be a lathe's or a mill's")
    assert path_of(tmp_path, *lines, dialect="fanuc").length == pytest.approx(52.038 + 32.0 + 2.0, abs=1e-3)
    for mill in ("G17", "T1 M6", "G0 Y0"):
        assert path_of(tmp_path, *number, mill, *lines[len(number) :]).length > 80.0


def test_a_named_dialect_does_not_make_a_lathe_a_mill(tmp_path: Path) -> None:
    assert "shows a lathe's program" in refusal(tmp_path, *LATHES["tools"], dialect="fanuc")


@pytest.mark.parametrize(
    ("lines", "sign"),
    [
        (["N10 G18 G54 DIAMON", "N20 G0 X52 Z2"], "line 2: DIAMON"),
        (["G18 G95", "G96 S180 LIMS=2500 M3", "G0 X52 Z2"], "line 3: LIMS="),
        (["G18 G95", "G96 S180 M3", "G0 X52 Z2"], "line 3: G96"),
        (["G0 X52 Z2", 'CYCLE95("A:B",1.5,0.1,0.2,0)'], "line 3: a turning cycle"),
        (["G0 X52 Z2", "CYCLE930(30,-20,5,5,3)"], "line 3: a turning cycle"),
        (["G95 S900 M4", "G0 X52 Z2", "G1 Z-9 F.2"], "line 2: a feed per revolution (G95)"),
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


@pytest.mark.parametrize("line", ["G0 X9 Y=2 Z2", "T1 M6"])
def test_a_mill_of_siemens_may_feed_by_turns(tmp_path: Path, line: str) -> None:
    path = path_of(tmp_path, "; SINUMERIK", "G95 S1000 M3", line, "G0 X9 Z2", "G1 Z-8 F0.2", start=(9, 2, 2))
    assert path.feeds is not None and path.feeds[-1] == pytest.approx(200.0 / 60.0)
