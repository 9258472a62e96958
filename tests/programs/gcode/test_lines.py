"""The arrays for simple lines and the interpreter of the whole language agree to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.errors import FormatError
from splinefeed.programs.gcode.dialects import named
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.lines import ProgramLines
from splinefeed.programs.gcode.moves import Moves, joined
from splinefeed.programs.gcode.offsets import Offsets
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.state import ProgramState

NUMBERS = st.one_of(
    st.decimals(-999, 999, places=4).map(str),
    st.integers(-999, 999).map(str),
    st.sampled_from([".5", "-.25", "+3.", "0", "-0", "1.", "007.50", "1e5", "", ".", "-", "1.2.3", "99999999999"]),
    st.floats(-1e6, 1e6).map(lambda value: f"{value:.17f}"),
    st.integers(0, 10**17).map(lambda digits: f"{digits / 1e17:.17f}"),
)
WORDS = st.tuples(st.sampled_from("XYZABCUVWIJKRFPNGEMST/#xyz"), st.sampled_from(["", " "]), NUMBERS).map("".join)
MOTION = st.sampled_from(
    ["G0", "G1", "g01", "G2", "G3", "G90", "G91", "G20", "G21", "G17", "G18", "G19", "G93", "G94", "G90.1", "G91.1"]
)
OTHERS = st.sampled_from(
    [
        "(note)",
        "N-1",
        "S100",
        "; rest",
        "(open",
        ")",
        "M3 S100",
        "M5",
        "T2 M6",
        "m08 M9",
        "S-1.5",
        "M3.0",
        "M7M8",
        "M3 M4",
        "M2 G1 X1",
        "G61.1",
        "G64 P0.1",
        "G92 X1",
        "%",
        "",
        "\r",
        "\t",
    ]
)
LINES = st.lists(st.one_of(WORDS, WORDS, WORDS, MOTION, OTHERS), max_size=6).map(" ".join)
#: A line that is right, so that some of the file comes to something.
RIGHT = st.tuples(MOTION, st.sampled_from("XYZA"), NUMBERS).map(lambda each: f"{each[0]} {each[1]}{each[2]} F10")
PROGRAMS = st.lists(st.one_of(LINES, RIGHT, RIGHT, RIGHT), min_size=1, max_size=12)


def both(file: Path, repair: bool, dialect: str = "") -> list[tuple[Moves | None, str, list[str]]]:
    """Moves, error and findings with and without arrays."""
    found = []
    for fast in (True, False):
        reading = Reading(named(dialect) if dialect else None, fast=fast, repair=repair)
        parts: list[Moves] = []
        message = ""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("splinefeed.programs.gcode.reader.PLAIN", 1)  # arrays for single lines too
            try:
                for part in reading.moves(file):
                    parts.append(part)
            except FormatError as error:
                message = str(error)
        found.append((joined(parts), message, reading.findings.all()))
    return found


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kernel") / "part.ngc"


def agree(file: Path, text: str, repair: bool = False, dialect: str = "") -> Moves:
    file.write_bytes(text.encode())
    (moves, message, findings), (again, other, others) = both(file, repair, dialect)
    assert message == other and findings == others
    assert moves is not None and again is not None
    assert moves.rows.tobytes() == again.rows.tobytes()
    assert moves.marks == again.marks and len(moves.splines) == len(again.splines)
    return moves


@given(PROGRAMS, st.booleans())
def test_both_read_the_same(file: Path, lines: list[str], repair: bool) -> None:
    agree(file, "\n".join(["N1 G1 F5", *lines]), repair)


#: Lines of Siemens that `run` alone reads, beside those that arrays read, too.
OF_SIEMENS = st.sampled_from(
    ["R1=3", "X=R1 Y=2", "X3 ;(a) R", "MSG(\"X1 ; \")", "G1 X1 (Y2)", "G3 X1 Y1 CR=5", "G1 X2 RND=0.2", "MCALL",
     "MCALL CYCLE81(5,0,1,-1)", "G70", "G71", "G700", "G710", "TRANS X1", "BSPLINE X1 Y2 PL=1", "M17", "N5 A: X2",
     "X=IC(2)", "X=5 Y=-2.5", "G1 X = 3 F=500", "N5X=2", "X=2+3", "X=.5EX1", "G2 X9 Y9 CR=20 CR=3", "G2 X5 Y1 CR = -9",
     "G3 X=1 Y=2 I=AC(1) J=0", "X1=5", "CR=7", "R5", "G1 R5 X1", "D1", "T1 D1", "TRAORI", "X1 A3=0 B3=0 C3=1", "G64"]
)  # fmt: skip


@given(st.lists(st.one_of(OF_SIEMENS, LINES, RIGHT, RIGHT), min_size=1, max_size=12))
def test_both_read_the_same_of_siemens(file: Path, lines: list[str]) -> None:
    agree(file, "\n".join(["G0 X0 Y0 Z0 F5", *lines]), dialect="siemens")


PLACE = st.tuples(
    st.sampled_from("XYZAC"), st.sampled_from(["+", "-", ""]), st.sampled_from(["1.5", "2", ".25", "1,5"])
)
WAYS = st.sampled_from(["L ", "5 L ", "/6 L ", "LP ", "", "C ", "CT ", "CC "])
RADII = st.sampled_from(["", "R0", "RL", "DR+", "DR-"])
FEEDS = st.sampled_from(["", "F500", "FMAX", "F AUTO", "F MAX"])
BLOCKS = st.one_of(
    st.tuples(
        WAYS, st.lists(PLACE.map("".join), max_size=3).map(" ".join), RADII, FEEDS,
        st.sampled_from(["", "M3", "; a", "~", "\r"]),
    ).map(" ".join),
    st.sampled_from(["CT X+1 Y+2", "RND R0.1", "CC X+0 Y+0", "Q1 = 2", "L X+Q1", "LBL 1", "TOOL CALL 1 Z S500", ""]),
)  # fmt: skip
LINE_OF_L = st.tuples(st.sampled_from(["", "7 "]), PLACE, PLACE, st.sampled_from(["", " R0 F100", " FMAX"])).map(
    lambda each: f"{each[0]}L {''.join(each[1])} {''.join(each[2])}{each[3]}"
)


@given(st.lists(st.one_of(BLOCKS, LINE_OF_L, LINE_OF_L, LINE_OF_L), min_size=1, max_size=14))
def test_both_read_the_same_of_heidenhain(file: Path, lines: list[str]) -> None:
    agree(file, "\n".join(["BEGIN PGM A MM", "L X+0 Y+0 Z+1 R0 F100", *lines]), dialect="heidenhain")


@pytest.mark.parametrize(
    ("dialect", "line"), [("siemens", "N{0} G1 X{0}.5 Y-2"), ("heidenhain", "{0} L X+{0} Y-2.5 R0")]
)
def test_plain_lines_of_siemens_and_heidenhain_are_read_by_arrays(
    file: Path, dialect: str, line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[int] = []
    do = Interpreter._do
    monkeypatch.setattr(Interpreter, "_do", lambda self, block: (said.append(self.line), do(self, block)))
    file.write_text("\n".join([*(line.format(k) for k in range(100)), "", ""]))
    assert len(joined(list(Reading(named(dialect)).moves(file)))) == 100
    assert said == ([] if dialect == "siemens" else [100]), "the last one, to which a next may be tangent"


@pytest.mark.slow
def test_both_read_the_same_five_thousand_times(file: Path) -> None:
    rng = np.random.default_rng(1)
    letters = list("XYZABCUVWIJKRFPNGEMSTO/#xyz()[];%. -+0123456789\t\r\n\n") + [
        "G1 ",
        "G0 ",
        "G2 ",
        "G91",
        "\nX",
        "\nG1 Y",
    ]
    for _ in range(5000):
        agree(file, "G1 F5\n" + "".join(rng.choice(letters, rng.integers(1, 80))), bool(rng.integers(2)))


@given(st.integers(0, 10**18 - 1), st.integers(0, 22), st.booleans())
def test_numbers_are_the_nearest_floats(mantissa: int, places: int, negative: bool) -> None:
    digits = str(mantissa).rjust(places + 1, "0")
    text = ("-" if negative else "") + digits[: len(digits) - places] + "." + digits[len(digits) - places :]
    if abs(float(text)) > 1e9:
        return
    state = ProgramState(Offsets({}), np.zeros(9))
    assert ProgramLines(f"G1 X{text}\n".encode(), printer=False).scan(state, 0, 1, 1) == 1
    assert state.take()["end"][0, 0] == float(text)


def test_simple_lines_are_read_by_arrays(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[int] = []
    run = Interpreter.run
    monkeypatch.setattr(Interpreter, "run", lambda self, text, line: (said.append(line), run(self, text, line)))
    simple = ["g01X1.5F5 (note)", "N5 G2 X2 I1 Y-.5 J0", "", "S500 M3", "; rest", "X3 R9\r", "N7 G0 A5", "A6 M9"]
    file.write_text("\n".join(["G17 G90", *simple * 9, "G1 X2 X3", *simple * 9, "M2"]))
    with pytest.raises(FormatError, match="line 74: X appears twice"):
        list(Reading().moves(file))
    assert said == [1, 74]


def test_the_tool_rests_for_another_spindle_speed_and_not_for_the_same(file: Path) -> None:
    text = "G1 X1 F100 S500\nX2 S500\nX3 S600\nX4 S600 M3\nG17 X5 S600\nM62 P1 S600\nM62 P1 S1\nT2\nX6"
    marks = agree(file, text).marks
    assert [(mark.move, mark.stop) for mark in marks] == [
        (0, True), (1, False), (2, True), (3, True), (4, False), (5, False), (5, True), (5, True),
    ]  # fmt: skip


def test_blocks_may_end_anywhere(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "G21\n" + "".join(f"G1 X{i}.{i % 7} Y-{i}\r\n" for i in range(500))
    whole = agree(file, text)
    for block in (64, 100, 4096):
        monkeypatch.setattr("splinefeed.programs.gcode.reader.BLOCK", block)
        assert np.array_equal(agree(file, text).rows, whole.rows)


def test_more_moves_than_one_part_holds(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "".join(
        f"G1 X{i} F100\n" + ("M3 S5\nG5.1 X0 I1 Y3\n" if i % 5 == 0 else "M8\n" * (i % 20)) for i in range(200)
    )
    whole = agree(file, text)
    monkeypatch.setattr("splinefeed.programs.gcode.state.CAPACITY", 8)
    parts = agree(file, text)
    assert np.array_equal(parts.rows, whole.rows)
    assert parts.marks == whole.marks and len(parts.splines) == len(whole.splines) == 40


def test_old_line_ends_and_a_mark_of_the_byte_order(file: Path) -> None:
    assert len(agree(file, "\ufeffG1 X1 F1\rX2\rX3")) == 3


def test_a_program_too_large_to_jump_is_read_block_by_block(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "O0001\nG21\n" + "".join(f"G1 X{i}.5 F{1 + i % 3}\n" for i in range(300)) + "M3 S5 T1\nX1\nM30\nX2\n"
    whole = agree(file, text)
    monkeypatch.setattr("splinefeed.programs.gcode.reader.LARGEST_THAT_JUMPS", 10)
    monkeypatch.setattr("splinefeed.programs.gcode.reader.BLOCK", 100)
    parts = agree(file, text)
    assert np.array_equal(parts.rows, whole.rows) and parts.marks == whole.marks
    file.write_text("G1 X1 F1\nM98 P5\n")
    with pytest.raises(FormatError, match="line 2: M98: subprograms are not supported here"):
        list(Reading().moves(file))
