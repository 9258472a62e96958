"""R parameters, expressions, jumps and loops of Siemens' programs, by the rules of its manual (12/2019, 3.1)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, program, refusal


def ends(folder: Path, *lines: str) -> list[list[float]]:
    path = path_of(folder, "G17 G90 G94 F600", *lines, dialect="siemens")
    return path.ends[:, 1].tolist()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2+3*4", 14.0),
        ("(2+3)*4", 20.0),
        ("-3+5", 2.0),
        ("2*-3", -6.0),
        ("10-3-2", 5.0),
        ("12/4/3", 1.0),
        ("7 DIV 2", 3.0),
        ("7 MOD 4", 3.0),
        ("3.2EX2", 320.0),
        ("SIN(30)*2", 1.0),
        ("ATAN2(30.5,80.1)", 20.8455),  # the manual's example: 20.8455 degrees
        ("POT(3)+SQRT(16)", 13.0),
        ("ROUND(2.5)+TRUNC(-2.7)+ABS(-4)", 5.0),
        ("TRUNC(R1)", 3.0),
        ("R[1+1]", 7.0),
        ("R1+R2", 10.6),
        ("(1==1) AND (2>3)", 0.0),
        ("NOT (2>3)", 1.0),
        ("5 B_AND 3", 1.0),
        ("5 B_OR 3", 7.0),
        ("MAXVAL(2,9)-MINVAL(2,9)", 7.0),
        ("0.1+0.2 == 0.3", 1.0),  # within 1e-12 of the values
        ("$PI", math.pi),
    ],
)
def test_values(tmp_path: Path, text: str, value: float) -> None:
    found = ends(tmp_path, "R1=3.6 R2=7", f"R3={text}", "G1 X=R3+1")
    assert found == [[pytest.approx(value + 1.0, abs=1e-4)]]


def test_words_are_computed_where_they_stand(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "DEF REAL _DEEP=-2*3, _SIDE", "DEF INT _COUNT=2.6", "R1=10 R2=R1*2", "_SIDE=R2/4",
        "N20 G1 X=R1+5 Y=-R2 Z=_DEEP F=R1*60", "X=IC(R1) Y=AC(_SIDE)", "G3 X=R1 Y=_SIDE CR=R1*2",
        "G1 X=_COUNT", dialect="siemens", start=(0, 0, 0),
    )  # fmt: skip
    expected = np.array([[15.0, -20.0, -6.0], [25.0, 5.0, -6.0], [10.0, 5.0, -6.0], [3.0, 5.0, -6.0]])
    assert path.ends[:, 1] == pytest.approx(expected, abs=1e-12)
    assert path.feeds is not None and set(path.feeds.tolist()) == {10.0}


def test_cycles_take_parameters(tmp_path: Path) -> None:
    begin = ["G17 G90 F200 S300 M3", "R1=110 R2=100 R3=2", "DEF REAL DEEP=35", "G0 X=40 Y=120 Z=110"]
    computed = path_of(tmp_path, *begin, "CYCLE81(R1,R2,R3,DEEP)", dialect="siemens", start=(0, 0, 110))
    plain = path_of(tmp_path, *begin, "CYCLE81(110,100,2,35)", dialect="siemens", start=(0, 0, 110))
    assert computed.ends.tolist() == plain.ends.tolist()
    assert len(plain.curves) == 4


CONTROL = {
    "if": (["R1=3", "IF R1>2", "X=1", "ELSE", "X=2", "ENDIF"], [1]),
    "else": (["R1=1", "IF R1>2", "X=1", "ELSE", "X=2", "ENDIF"], [2]),
    "neither": (["R1=1", "IF R1>2", "X=1", "ENDIF", "X=5"], [5]),
    "within": (["R1=1 R2=1", "IF R1==1", "IF R2==2", "X=1", "ELSE", "X=3", "ENDIF", "X=4", "ENDIF"], [3, 4]),
    "while": (["R1=0", "WHILE R1<3", "R1=R1+1", "X=R1", "ENDWHILE"], [1, 2, 3]),
    "for": (["DEF INT II", "FOR II=2 TO 4", "X=II", "ENDFOR", "X=II*10"], [2, 3, 4, 50]),
    "for never": (["FOR R5=3 TO 2", "X=R5", "ENDFOR", "X=9"], [9]),
    "repeat until": (["R1=5", "REPEAT", "X=R1", "R1=R1-2", "UNTIL R1<0"], [5, 3, 1]),
    "loop": (["R1=0", "LOOP", "R1=R1+1", "X=R1", "IF R1==2 GOTOF OUT", "ENDLOOP", "OUT:", "X=7"], [1, 2, 7]),
    "gotob": (["R1=3", "MARK1: X=R1", "R1=R1-1", "IF R1>0 GOTOB MARK1"], [3, 2, 1]),
    "gotof": (["GOTOF LATER", "X=1", "N70 LATER: X=2"], [2]),
    "goto n": (["R1=1", "N20 X=R1", "R1=R1+1", "IF R1<4 GOTOB N20", "X=0"], [1, 2, 3, 0]),
    "goto": (["GOTO A1", "X=1", "A1: X=2"], [2]),
    "gotoc": (["GOTOC NOWHERE", "X=1"], [1]),
    "two on a line": (["R1=2", "IF R1==1 GOTOF A1 IF R1==2 GOTOF B1", "X=9", "A1: X=1", "B1: X=2"], [2]),
    "repeat of a section": (["R1=0", "BEGIN1: R1=R1+1", "X=R1", "REPEAT BEGIN1 P=2", "X=9"], [1, 2, 3, 9]),
    "repeat of two labels": (["R1=0", "A1: R1=R1+1", "B1: X=R1", "Y=1", "REPEAT A1 B1 P=2"], None),
    "repeat to endlabel": (["R1=0", "A1: R1=R1+1", "X=R1", "ENDLABEL:", "X=10", "REPEAT A1 P=1", "X=9"], [1, 10, 2, 9]),
    "repeatb": (["R1=0", "A1: X=IC(1)", "X=10", "REPEATB A1 P=3", "X=9"], [1, 10, 11, 12, 13, 9]),
    "brackets": (["R1=1 R2=2", "IF (R1==1) AND (R2==3)", "X=1", "ELSE", "X=2", "ENDIF"], [2]),
    "remarks": (["R1=1 ; IF nothing", 'MSG("GOTOF; A")', "IF R1==1 ; ENDIF", "X=4 ; ELSE", "ENDIF"], [4]),
    "skipped lines are not looked at": (["GOTOF A1", "THIS IS NONSENSE(", "A1: X=2"], [2]),
    "small letters": (["r1=1", "while r1<3", "x=r1", "r1=r1+1", "endwhile"], [1, 2]),
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name, (_, found) in CONTROL.items() if found is not None])
def test_the_way_through_a_program(tmp_path: Path, name: str) -> None:
    lines, expected = CONTROL[name]
    assert [end[0] for end in ends(tmp_path, "G1", *lines)] == expected


def test_a_section_of_two_labels_is_repeated(tmp_path: Path) -> None:
    lines, _ = CONTROL["repeat of two labels"]
    assert ends(tmp_path, "G1", *lines) == [[1, 0], [1, 1], [2, 1], [3, 1]]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["G1 X=R7"], "line 2: R7 has no value; set it in the program before it is used"),
        (["R1=1", "IF R1==1 AND R1==1 GOTOF A1", "A1:"], "line 3: comparisons beside each other: AND and OR bind"),
        (["R1=$AA_IM[X]"], "line 2: $AA_IM[ is not known in an expression"),
        (["$P_UIFR[1]=3"], "line 2: $P_UIFR is a variable of the control's own"),
        (["R1=1/0"], "line 2: 1 / 0 has no value"),
        (["IF 1==1", "G1 X=1"], "line 2: IF has no ENDIF after it"),
        (["G1 X=1", "ENDWHILE"], "line 3: ENDWHILE has no WHILE before it"),
        (["GOTOF A1"], "line 2: GOTOF A1: no line of the program behind it has that label"),
        (["A1: G1 X1", "GOTOF A1"], "line 3: GOTOF A1: no line of the program behind it has that label"),
        (["A1: X1", "GOTOB A1"], "line 3: more than 1000 lines are executed"),
        (["REPEAT A1 P=2"], "line 2: REPEAT A1: no line of the program has that label"),
        (["FOR I=1 TO 3", "ENDFOR"], "line 2: I is not a variable; declare it with DEF INT"),
        (["X=1 GOTOF A1", "A1:"], "line 2: 'GOTOF A1': a jump must be alone on its line"),
        (["R1=5+", "X=R1"], "line 2: a value is missing at the end of the line"),
        (["DEF FRAME A"], "line 2: 'DEF FRAME A': only DEF REAL"),
        (["GOTOS"], "line 2: 'GOTOS ': expected GOTOF, GOTOB or GOTO with a label"),
    ],
)
def test_what_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: list[str], reason: str) -> None:
    monkeypatch.setattr("splinefeed.programs.gcode.flow.MAX_STEPS", 1000)
    assert refusal(tmp_path, "G90 G1 F60", *lines, dialect="siemens").startswith(reason)


def test_a_loop_is_read_and_said_to_be_of_its_lines(tmp_path: Path) -> None:
    file = program(
        tmp_path, "; SINUMERIK 840D", "G17 G90 G71", "R1=0", "G0 X0 Y0", "TURN1: G1 X=10*COS(R1) Y=10*SIN(R1) F600",
        "R1=R1+10", "IF R1<=360 GOTOB TURN1", "M30", name="turn.mpf",
    )  # fmt: skip
    path = sf.read(file)
    assert path.length == pytest.approx(10 + 36 * 20 * math.sin(math.radians(5)), abs=1e-6)


def test_ten_thousand_turns_take_no_time_to_speak_of(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "G90 G1 F600", "FOR R1=1 TO 10000", "X=R1*0.01", "ENDFOR", "M30", dialect="siemens"
    )  # fmt: skip
    assert len(path.curves) == 10000


def test_a_long_plain_program_has_no_endless_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("splinefeed.programs.gcode.flow.MAX_STEPS", 10)
    assert len(ends(tmp_path, *(f"G1 X{k}" for k in range(1, 40)))) == 39
    block = [f"L X+{k} F500" for k in range(1, 40)]
    path = path_of(tmp_path, "BEGIN PGM A MM", *block, "END PGM A MM")
    assert len(path.curves) == 39
