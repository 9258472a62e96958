"""Fanuc's macro calls: G65 with arguments, variables without a value, M99 P, files of subprograms.

After Fanuc B-64484EN, "Custom macro": argument specification I and II, local variables, <vacant>, FIX and FUP.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from gcode_programs import path_of, refusal

HEAD = ("O0001", "G90 G21 G17 F600", "G0 X0. Y0. Z0.")


def ends(tmp_path: Path, *lines: str) -> list[list[float]]:
    path = path_of(tmp_path, *HEAD, *lines)
    return np.round(path.ends[:, 1, :2], 9).tolist()


def test_letters_set_the_variables_of_the_macro(tmp_path: Path) -> None:
    letters = "A1. B2. C3. D7. E8. F9. H11. M13. Q17. R18. S19. T20. U21. V22. W23. X24. Y25. Z26. I4. J5. K6."
    body = [f"G1 X#{k} Y1." for k in (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, *range(17, 27))]
    found = ends(tmp_path, f"G65 P9000 {letters}", "M30", "O9000", *body, "M99")
    assert [x for x, _ in found] == [float(line.split()[1][2:]) for line in body]


def test_i_j_k_may_be_said_again(tmp_path: Path) -> None:
    found = ends(tmp_path, "G65 P9000 I1. J2. K3. I4. J5. K6. J7. I8.", "M30", "O9000",
                 "G1 X#4 Y#5", "X#6 Y#7", "X#8 Y#9", "X#11 Y#13", "M99")  # fmt: skip
    assert found == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]


def test_a_macro_has_variables_of_its_own_and_the_caller_keeps_its(tmp_path: Path) -> None:
    found = ends(tmp_path, "#1=5.", "G65 P9000 A7.", "G1 X#1 Y#100", "M30", "O9000", "#1=#1+1.", "#100=#1", "M99")
    assert found == [[5.0, 8.0]]


def test_repeats_begin_with_the_same_variables(tmp_path: Path) -> None:
    found = ends(tmp_path, "#100=0.", "G65 P9000 A2. L3", "G1 X#100 Y1.", "M30",
                 "O9000", "#100=#100+#1", "#1=99.", "M99")  # fmt: skip
    assert found == [[6.0, 1.0]]


def test_what_has_no_value_is_0_in_arithmetic_equal_to_nothing_and_no_word(tmp_path: Path) -> None:
    found = ends(tmp_path, "#2=0", "IF [#1 EQ #0] THEN #10=1.", "IF [#2 EQ #0] THEN #10=9.", "IF [#1 EQ 0] THEN #10=9.",
                 "IF [#1 NE #2] THEN #11=2.", "G1 X[#10+#1] Y[#11*1.]", "G1 X#1 Y7.",
                 "#10=#0", "G1 X3. Y#10", "M30")  # fmt: skip
    assert found == [[1.0, 2.0], [1.0, 7.0], [3.0, 7.0]]


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("FIX[-1.2]", -1.0), ("FUP[-1.2]", -2.0), ("FIX[1.8]", 1.0), ("FUP[1.2]", 2.0), ("ROUND[-2.5]", -3.0),
        ("RND[2.5]", 3.0), ("SQR[9]", 3.0), ("SQRT[16]", 4.0), ("6 AND 3", 2.0), ("6 OR 3", 7.0), ("6 XOR 3", 5.0),
        ("ATAN[1]", 45.0), ("ATAN[1]/[-1]", 135.0), ("ATAN[1]/9", 5.0), ("[2 GT 1] AND [3 GT 2]", 1.0),
        ("#[#3]", 12.0),
    ],
)  # fmt: skip
def test_functions_are_those_of_the_control(tmp_path: Path, expression: str, value: float) -> None:
    assert ends(tmp_path, "#3=4", "#4=12.", f"#20={expression}", "G1 X#20 Y1.", "M30") == [[value, 1.0]]


def test_a_macro_writes_the_variable_whose_number_it_is_given(tmp_path: Path) -> None:
    found = ends(tmp_path, "G65 P9001 A3. C5. V100.", "G1 X#100", "M30", "O9001", "#[#22]=SQRT[[#3*#3]-[#1*#1]]", "M99")
    assert found == [[4.0, 0.0]]


def test_m99_with_p_goes_on_at_that_line_of_the_caller(tmp_path: Path) -> None:
    found = ends(tmp_path, "M98 P9000", "N10 G1 X1.", "N20 G1 X2.", "M30", "O9000", "G1 Y5.", "M99 P20")
    assert found == [[0.0, 5.0], [2.0, 5.0]]
    again = ends(tmp_path, "#1=0", "N10 #1=#1+1", "G1 X#1", "IF [#1 GE 3] GOTO 90", "M99 P10", "N90 M30")
    assert again == [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]


@pytest.mark.parametrize("name", ["O9100.nc", "9100.nc", "O9100", "9100.ngc", "O9100.CNC"])
def test_a_subprogram_may_be_a_file_beside_the_program(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("%\nO9100\nIF [#1 LT 0] GOTO 5\nG1 X#1\nN5 M99\n%\n")
    assert ends(tmp_path, "G65 P9100 A4.", "G65 P9100 A-4.", "M30") == [[4.0, 0.0]]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["G65 A1."], "line 4: G65 needs P, the number of a program"),
        (["G65 P9000.5"], "line 4: P of G65 is 9000.5; it must be a whole number from 0"),
        (["G65 P9000 G1 X1."], "line 4: G1 beside G65: write it on its own line"),
        (["G65 P8000 A1."], "line 4: O8000 is called, and is neither in the program nor in O8000.nc beside it"),
        (["G65 P9000", "M30", "O9000", "G65 P9000", "M99"], "line 7: o9000: more than 10 calls within calls"),
        (["G65 P9000 L999999999", "M30", "O9000", "M99"], "times, and at most 300000 jumps are executed"),
        (["M98 P9000 L99999999", "M30", "O9000", "M99"], "times, and at most 300000 jumps are executed"),
        (["#0=1"], "line 4: #0 never has a value and cannot be assigned"),
        (["G1 X#500"], "line 4: X: #500 has no value; set it in the program before it is used"),
        (["G#1 X1."], "line 4: G: its variable has no value"),
        (["M99 P77"], "line 4: GOTO 77: no line of the program begins with N77"),
        (["G65 P9000 " + "I1." * 11], "line 4: G65: I, J and K may be said 10 times"),
    ],
)
def test_what_cannot_be_called_is_refused(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert reason in refusal(tmp_path, *HEAD, *lines)


def test_another_control_has_no_macros(tmp_path: Path) -> None:
    assert "G65 is a macro call" in refusal(tmp_path, "G1 X1 F60", "G65 P1", dialect="linuxcnc")


@pytest.mark.slow
@pytest.mark.parametrize(
    "lines",
    [
        ["#1=0", "WHILE [#1 LT 100000] DO1", "G1 X[#1*0.001]", "#1=#1+1", "END1", "M30"],
        ["#1=0", "N10 G1 X[#1*0.001]", "#1=#1+1", "IF [#1 LT 100000] GOTO 10", "M30"],
    ],
)
def test_a_hundred_thousand_turns_take_seconds(tmp_path: Path, lines: list[str]) -> None:
    begun = time.process_time()
    path = path_of(tmp_path, *HEAD, *lines)
    assert path.length == pytest.approx(99.999)
    assert time.process_time() - begun < 40.0  # 8 s where this was written
