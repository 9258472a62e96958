"""O-words, loops and subprograms; those of LinuxCNC held against its own interpreter where it is installed."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from gcode_programs import path_of, program, refusal, said
from rs274_held import held_against
from rs274_twin import PROGRAM
from splinefeed.programs.gcode import flow
from splinefeed.programs.gcode.dialects import named
from splinefeed.programs.gcode.moves import joined
from splinefeed.programs.gcode.reader import Reading

TWIN = pytest.mark.skipif(PROGRAM is None, reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace")

#: What stands in files beside the programs.
FILES = {
    "ext.ngc": "o<ext> sub\nG0 Y#1\no<ext> endsub [7]\nM2\n",
    "9.ngc": "O9\nG0 Y8\nM99\n",
}
PROGRAMS = [
    "o100 sub\nG0 X#1 Y#2 Z#3\n#1=9\no100 return [5]\no100 endsub\n#1=4\no100 call [1] [2]\nG0 X#1 Y#<_value>\n"
    "Z#<_value_returned>",
    "F10\n#1=4 #<q>=3\nM98 P100 L2\nG1 X#1 Y#<q>\nM30\nO100\n#1=[#1+1] #<q>=7\nG1 Z[#1+3]\nM99",
    "M98 P7 L0\nG0 X2\nM30\nO7\nG0 X8\nM99",
    "o1 if [1]\nG0 X1\no1 else\nG0 X#<nix>bla\no1 endif\nG0 X2",
    "o1 repeat [2.6]\nG0 X[#5420+1]\no1 endrepeat\no2 repeat [2.4]\nG0 Y[#5421+1]\no2 endrepeat\n"
    "o3 repeat [-1]\nG0 X9\n"
    "o3 endrepeat",
    "#1=0\no1 do\n#1=[#1+1]\nG0 X#1\no2 if [#1 eq 2]\no1 continue\no2 endif\nG0 Y#1\no1 while [#1 lt 4]\nG0 Z1",
    "o1 while [1]\no1 break\no1 endwhile\nG0 X3\no2 do\no2 break\nG0 X4\no2 while [1]\nG0 Y1",
    "G0 X1\nO100\nG0 X2",
    "#<g>=1\no<s> sub\nG0 X[exists[#<g>]] Y[exists[#<_h>]]\n#<_h>=2\no<s> endsub\n#<_h>=1\no<s> call\n"
    "G0 X#<_h> Y#<_value_returned>",
    "o1 call [3]\nG0 X1\nM2\no1 sub\nG0 Y#1\no1 endsub",
    "o<ext> call [3]\nG0 X#<_value>",
    "M98 P9\nG0 X3",
    "#1=5\no#1 call [3]\no[2+3] call [#1]\nM2\no5 sub\nG0 Y#1\no5 endsub",
    "o1 sub\n#1=8 #31=7\no1 endsub\n#1=3 #31=1\no1 call [5]\nG0 X#1 Y#31",
    "#1=0\no1 while [#1 lt 3]\n#1=[#1+1]\no2 if [#1 eq 1]\nG0 X1\no2 elseif [#1 eq 2]\nG0 Y2\n"
    "o2 else\nG0 Z3\no2 endif\n"
    "o1 endwhile",
    "o5 sub\no5 return [1]\no5 endsub\no5 call\nG0 X#<_value>\no6 sub\no6 endsub\no6 call\n"
    "G0 Y[#<_value>+1] Z#<_value_returned>",
    "o5 sub\n#2=3\n#<a>=2\no7 if [1]\nM98 P7\no7 endif\nG0 Y#2 Z#<a>\no5 endsub\no5 call\nM2\nO7\nG0 X#2\n#2=7\nM99",
    "o<A b> sub\nG0 X1\no<ab> endsub\nO <AB> CALL",
    "N10 o1 if [1]\nG0 X1\n/o1 endif",
    "G0 X2\nG0 X#<_x> Y#<_metric> Z5\nG0 X#<_absolute> Y#<_plane> Z#5220\nF7 G1 X#<_feed> Y#<_imperial>",
    "O100 if [0]\nG0 X1\nO100 elseif [0]\nG0 X2\no100 endif\nO101 if [0]\nO102 if[1]\nO102 else\n"
    "O102 endif\nO101 else\n"
    "G0 X4\nO101 endif",
    "G0 X1\nM99\nG0 X2",
    "o1 sub\nG91 G1 F100 X1\nY1\no1 endsub\no2 repeat [3]\no1 call\nG90 G0 Z5\no2 endrepeat",
]  # fmt: skip
#: What both refuse, and the line.
REFUSED = [
    ("o1 sub\nG0 X1\nM99\no1 endsub\no1 call", 3, "M99 is inside o1 sub; write endsub or return"),
    ("G0 X1\nM98 P5\nM2", 2, "o5 is called, and is neither in the program nor in 5.ngc beside it; begin it with O5"),
    ("o1 call [1]", 1, "o1 is called, and is neither in the program nor in 1.ngc beside it; define it with sub and"),
    ("G0 X1\no1 if [0]\nG0 X1", 2, "o1 if has no o1 endif after it"),
    ("o1 while [0]\no1 endwhile\no1 while [0]\no1 endwhile", 3, "o1 while: line 1 has the label; write another number"),
    ("o<a> sub\no<a> call\no<a> endsub\no<a> call", 2,
     "o<a>: more than 10 calls within calls; does a sub call itself?"),
    ("o1 if [1] G0 X3\no1 endif", 1, "o1 if: expected brackets, 1 at most, got 'G0X3'"),
    ("o1 if 1\nG0 X3\no1 endif", 1, "o1 if: expected brackets"),
    ("o1 endif", 1, "o1 endif has no o1 if before it"),
    ("o1 else\no1 endif", 1, "o1 else has no o1 if before it"),
    ("G0 X1\no1 endwhile", 2, "o1 endwhile has no o1 while before it"),
    ("o1 repeat [2]\no1 break\no1 endrepeat", 2, "o1 break has no o1 while or do before it"),
    ("o1 return", 1, "o1 return is outside of a called sub"),
    ("o1 if [1]\no1 if [1]\no1 endif\no1 endif", 2, "o1 if: line 1 has the label; write another number"),
    ("o1 sub\no2 sub\no2 endsub\no1 endsub\no1 call", 2, "o2 sub is inside o1; define it outside"),
    ("o1 sub\no1 endsub\no1 sub\no1 endsub\no1 call", 3, "o1 sub: line 1 has the label; write another number"),
    ("M98 P7 L2.5\nM2\nO7\nM99", 1, "L2.5 of M98 is not a whole number from 0"),
    ("M98\nM2", 1, "M98 needs P"),
    ("o1 sub\nG0 X1 X2\no1 endsub\nG0 X1\no1 call", 2, "X appears twice"),
    ("o1 if [1]\n (abort, no tool)\no1 endif", 2, "the program ends itself: no tool"),
    ("o1 do\nG0 X1\no1 while", 3, "o1 while needs a value in brackets"),
    ("o1 call [1\nM2\no1 sub\no1 endsub", 1, "] is missing at the end of the line"),
    ("#<_x>=1", 1, "#<_x> is set by the machine and cannot be assigned"),
    ("o1 what", 1, "o1: expected sub, call, if, while, repeat or the like, got 'WHAT'"),
]  # fmt: skip


def folder_with_files(folder: Path) -> Path:
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return folder


@TWIN
@pytest.mark.linuxcnc
@pytest.mark.parametrize("text", PROGRAMS)
def test_a_program_jumps_as_in_linuxcnc(tmp_path: Path, text: str) -> None:
    file = program(folder_with_files(tmp_path), text, "M2")
    assert held_against(file).error == ""


@TWIN
@pytest.mark.linuxcnc
@pytest.mark.parametrize("text", [text for text, _, _ in REFUSED if "(abort" not in text])
def test_what_linuxcnc_refuses_is_refused(tmp_path: Path, text: str) -> None:
    assert held_against(program(tmp_path, text, "M2")).error


@pytest.mark.parametrize(("text", "line", "reason"), REFUSED)
def test_the_line_and_the_mend_are_named(tmp_path: Path, text: str, line: int, reason: str) -> None:
    assert refusal(tmp_path, text, "M2", dialect="linuxcnc").startswith(f"line {line}: {reason}")


def random_jumps(rng: np.random.Generator) -> str:
    """Subs that call each other, loops in loops and branches, drawn at random; all of them end."""
    label = iter(range(100, 1000))
    # LinuxCNC's break also ends the next do loop that comes to its while
    leaves = ["continue"] if (has_do := rng.random() < 0.5) else ["break", "continue"]

    def value() -> str:
        return str(rng.choice(["#1", "#2", "#<n>", "#<_wide>", "[#1+#2]", "[#5420-1]", f"{rng.uniform(-5, 5):.3f}"]))

    def body(depth: int, subs: int, loop: str = "") -> list[str]:
        out: list[str] = []
        for _ in range(rng.integers(1, 5)):
            kind, o = int(rng.integers(0, 11 if depth else 4)), f"o{next(label)}"
            if kind < 3:
                out.append(f"{rng.choice(['G0', 'G1', 'G91 G1', 'G90'])} {rng.choice(list('XYZ'))}[{value()} MOD 7]")
            elif kind == 3:
                out.append(f"{rng.choice(['#1', '#2', '#<n>', '#<_wide>'])}=[[{value()} + {value()}] MOD 9]")
            elif kind == 4:
                out += [f"{o} if [{value()} gt {value()}]", *body(depth - 1, subs, loop)]
                out += [f"{o} elseif [{value()} lt 1]", *body(depth - 1, subs, loop)] if rng.random() < 0.5 else []
                out += [f"{o} else", *body(depth - 1, subs, loop)] if rng.random() < 0.5 else []
                out.append(f"{o} endif")
            elif kind == 5:
                out += [f"{o} repeat [{rng.integers(0, 4)}]", *body(depth - 1, subs), f"{o} endrepeat"]
            elif kind in (6, 7):
                count = f"#{1000 + int(o[1:])}"
                ahead, again = (f"{o} while [{count} lt 3]", f"{o} endwhile")
                if kind == 7 and has_do:
                    ahead, again = f"{o} do", f"{o} while [{count} lt 3]"
                out += [f"{count}=0", ahead, f"{count}=[{count}+1]", *body(depth - 1, subs, o), again]
            elif kind == 8 and loop:
                out += [f"{o} if [{value()} gt 2]", f"{loop} {rng.choice(leaves)}", f"{o} endif"]
            elif kind == 9 and subs:
                out.append(f"o{rng.integers(1, subs + 1)} call [{value()}] [{value()}]")
            elif kind == 10 and subs < 3:
                out.append(f"o{next(label)} if [{value()} gt 9]\no{next(label) - 1} endif")
        return out

    lines = ["G21 G90 F100", "#1=1 #2=2 #<n>=3 #<_wide>=4"]
    for sub in range(1, 4):
        ends = f"o{sub} endsub" + (f" [{value()}]" if rng.random() < 0.5 else "")
        lines += [f"o{sub} sub", "#<n>=1", *body(2, sub - 1), ends]
    return "\n".join([*lines, *body(3, 3), "G1 X#1 Y#2 Z#<n>", "X[#<_wide>]", "M2", ""])


@TWIN
@pytest.mark.slow
@pytest.mark.linuxcnc
@pytest.mark.parametrize("seed", range(60))
def test_random_jumps_are_those_of_linuxcnc(tmp_path: Path, seed: int) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(random_jumps(np.random.default_rng(seed)))
    held_against(file)


@pytest.mark.parametrize(
    "loop",
    [
        ["o1 while [1]", "o1 endwhile"],
        ["o1 do", "#1=[#5420+1]", "o1 while [1]"],
        ["o1 repeat [99999999999]", "G91 G1 X0.1 F1", "o1 endrepeat"],
        ["o1 while [1]", *["G91 G1 X0.001 F1"] * 2000, "o1 endwhile"],
    ],
)
def test_a_loop_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, loop: list[str]) -> None:
    monkeypatch.setattr(flow, "MAX_STEPS", 20_000)
    assert "more than 20000 lines are executed; is there an endless loop near here?" in refusal(tmp_path, *loop)


@pytest.mark.parametrize(("call", "dialect"), [("M98 P7", "linuxcnc"), ("M98 P7", "fanuc"), ("G65 P7", "fanuc")])
def test_more_repeats_than_a_program_may_jump_are_refused_before_they_begin(
    tmp_path: Path, call: str, dialect: str
) -> None:
    sub = ["M2", "O7", "G91 G1 X1. F60.", "M99"]
    begin = time.process_time()
    assert refusal(tmp_path, f"{call} L99999999", *sub, dialect=dialect) == (
        "line 1: repeats 99999999 times, and at most 300000 jumps are executed; leave L out"
    )
    assert time.process_time() - begin < 2.0
    assert path_of(tmp_path, f"{call} L9", *sub, dialect=dialect).length == 9.0


def test_modes_are_kept_and_restored(tmp_path: Path) -> None:
    lines = ["G21 G91 F60 S500 M3 M8", "G64 P.1", "M70", "G20 G90 F9 S20 M5 M9", "G64 P1", "G1 X1", "M72", "X1", "M30"]
    path = path_of(tmp_path, *lines)
    assert said(path) == ["S500 M3 M8", "S20 M5 M9", "F25.4", "S500 M3 M9 M8", "F26.4", "M30"]
    assert path.feeds is not None and path.feeds.tolist() == [pytest.approx(0.15), 1.0]
    assert path.tolerances is not None and path.tolerances.tolist() == [25.4, 0.1]
    sub = ["o1 sub", "M73", "G91 G1 X2 F9", "o1 endsub", "G90 G1 X1 F60", "o1 call", "X5"]
    assert said(path_of(tmp_path, *sub)) == ["F1", "F3", "F5"]
    assert refusal(tmp_path, "o1 sub", "M72", "o1 endsub", "M70", "o1 call") == (
        "line 2: M72: nothing is kept here; write M70 before it, in the same sub"
    )
    compensated = ["G41.1 D2", "G1 X9 F60", "M70"]
    assert refusal(tmp_path, *compensated) == "line 3: M70 to M73 are not allowed between G41 or G42 and G40"
    assert said(path_of(tmp_path, "G1 X1 F60", "M70", "X2", dialect="mach3")) == ["F1", "M70", "F2"]


def test_subprograms_of_fanuc(tmp_path: Path) -> None:
    main = ["O0001", "G90 G0 X0 Y0", "M98 P30100", "G1 X9. F100", "M98 P0200", "M30"]
    subs = ["O0100", "G91 G1 X1. F100", "M98 P200", "M99", "O0200", "G91 Y2.", "G90", "M99"]
    path = path_of(tmp_path, *main, *subs, dialect="fanuc")
    ends = [curve.control_points[-1].tolist() for curve in path.curves]
    assert ends == [[1, 0], [1, 2], [2, 2], [2, 4], [3, 4], [3, 6], [9, 6], [9, 8]]
    assert refusal(tmp_path, "O0001", "M98 P100", "M30", "O0100", "M99 P5", dialect="fanuc").startswith(
        "line 5: GOTO 5: no line"
    )
    assert refusal(tmp_path, "O0001", "M98 P100", "M30", "O0100", dialect="fanuc").startswith(
        "line 4: the file ends within o100, which has no M99"
    )


def test_a_file_of_subs_is_named_where_it_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "deep.ngc").write_text("o<deep> sub\nG1 X1 F1\nG1 X1 X2\no<deep> endsub\n")
    assert refusal(tmp_path, "G0 X1", "o<deep> call") == f"{tmp_path / 'deep.ngc'}: line 3: X appears twice"
    assert refusal(tmp_path, "o<../deep> call").startswith("line 1: o<../deep> is called, and is neither in")
    (tmp_path / "deep.ngc").write_text("o<deep> sub\nG1 X1 F1\nG2 X1 R.001\no<deep> endsub\n")
    assert refusal(tmp_path, "G0 X9", "o<deep> call").startswith("line 2: ")  # moves are of the line that calls


def test_long_stretches_between_jumps_are_read_as_line_by_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    lines = [f"G1 X{x:.3f} Y{y:.3f} F{100 + k % 3}" for k, (x, y) in enumerate(rng.uniform(-9, 9, (300, 2)))]
    file = program(
        tmp_path, "o1 sub", *lines[:200], "o1 endsub", "o2 repeat [4]", *lines[200:], "o1 call", "o2 endrepeat"
    )
    fast, slow = (joined(list(Reading(dialect=named("linuxcnc"), fast=each).moves(file))) for each in (True, False))
    assert len(fast) == 1200
    assert np.array_equal(fast.rows, slow.rows)


def test_in_other_dialects_there_are_no_jumps(tmp_path: Path) -> None:
    assert refusal(tmp_path, "M98 P100", dialect="grbl").startswith("line 1: M98: subprograms are not supported")
    assert refusal(tmp_path, "O100 sub", dialect="grbl").startswith("line 1: O100 sub: subprograms, loops and")


@pytest.mark.parametrize(
    ("dialect", "lines"),
    [
        ("linuxcnc", ["#1=0", "O1 while [#1 lt 100000]", "#1=[#1+1]", "O1 endwhile", "G1 X1 F60"]),
        ("fanuc", ["#1=0", "WHILE [#1 LT 100000] DO1", "#1=#1+1", "END1", "G1 X1. F60."]),
        ("siemens", ["R1=0", "WHILE R1<100000", "R1=R1+1", "ENDWHILE", "G1 X1 F60"]),
    ],
)
@pytest.mark.slow
def test_a_loop_of_a_hundred_thousand_turns_runs(tmp_path: Path, dialect: str, lines: list[str]) -> None:
    """FluidNC#1312: a turn is two jumps, of which a program may make as many."""
    assert path_of(tmp_path, *lines, dialect=dialect).length == 1.0
