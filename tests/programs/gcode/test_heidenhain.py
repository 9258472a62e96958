"""Heidenhain's conversational programs: lines, arcs, corners, against places and lengths that are computed by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of
from splinefeed.errors import SplinefeedError
from splinefeed.programs.gcode.dialects import holds

BEGIN = ("BEGIN PGM PART MM", "BLK FORM 0.1 Z X+0 Y+0 Z-20", "BLK FORM 0.2 X+100 Y+100 Z+0", "TOOL CALL 5 Z S3500 F600")


def read(tmp_path: Path, *blocks: str, numbered: bool = True) -> sf.Path:
    file = tmp_path / "part.h"
    lines = [*BEGIN, *blocks, "END PGM PART MM"]
    file.write_text("\n".join(f"{k} {line}" if numbered else line for k, line in enumerate(lines)) + "\n")
    return sf.read(file)


def refusal(tmp_path: Path, *blocks: str) -> str:
    with pytest.raises(SplinefeedError) as caught:
        read(tmp_path, "L X+0 Y+0 Z+0 R0 F600", *blocks)
    assert "\n" not in str(caught.value)
    return str(caught.value).partition("part.h: ")[2]


def lengths(path: sf.Path) -> list[float]:
    return np.diff(path.curve_starts).tolist()


def end(path: sf.Path) -> list[float]:
    place = dict.fromkeys("xyz", 0.0) | dict(zip(path.axes, path.curves[-1].control_points[-1].tolist(), strict=True))
    return [place[axis] for axis in "xyz"]


def test_it_is_told_by_its_first_block() -> None:
    for head in (b"0 BEGIN PGM 17 MM\n1 L X+1 F100\n", b"BEGIN PGM ABC MM \nL X+1\n", b"  0  BEGIN PGM a INCH\n"):
        assert detect(head).name == "heidenhain"
        assert holds(head)
    assert not holds(b"to BEGIN PGM one says\nmore words\n")


@pytest.mark.parametrize("numbered", [True, False])
def test_lines_arcs_and_corners(tmp_path: Path, numbered: bool) -> None:
    path = read(
        tmp_path,
        "L X+0 Y+0 Z-5 R0 FMAX M3",
        "L X+50 F600",
        "RND R5",
        "L Y+40",
        "CC X+40 Y+40",
        "C X+40 Y+50 DR+",
        "L X+20",
        "CT X+10 Y+40",
        "CR X+0 Y+30 R+10 DR+",
        "L Y+20",
        "CHF 2",
        "L IX+10",
        "L X+60 Y+0 FMAX",
        "CC X+50 Y+0",
        "CP IPA+720 IZ-4 DR+ F100",
        "LP PR+20 PA+90",
        numbered=numbered,
    )
    quarter = 0.5 * math.pi
    expected = [
        45.0, 5.0 * quarter, 35.0, 10.0 * quarter, 20.0, 10.0 * quarter, 10.0 * quarter, 8.0, math.sqrt(8.0), 8.0,
        math.hypot(50.0, 20.0), math.hypot(40.0 * math.pi, 4.0), math.hypot(10.0, 20.0),
    ]  # fmt: skip
    assert np.allclose(lengths(path), expected, atol=1e-9)
    assert np.allclose(path.ends[-1, 1], [50.0, 20.0, -9.0])
    assert np.round(60.0 * path.feeds, 6).tolist() == [600.0] * 10 + [math.inf] + [100.0] * 2
    assert [marker.text for marker in path.markers] == ["S3500 T5 M6", "M3"]


def test_a_feed_stays_and_fmax_is_for_one_block(tmp_path: Path) -> None:
    path = read(tmp_path, "L X+0 Y+0 R0 FMAX", "L X+10 F200", "L X+20 F MAX", "L X+30", "L X+40 R0 F AUTO")
    assert np.round(60.0 * path.feeds, 6).tolist() == [200.0, math.inf, 200.0, 200.0]


def test_polar_arcs_and_decimal_commas(tmp_path: Path) -> None:
    path = read(
        tmp_path, "L X+10,5 Y+0 R0 F100", "CC X+0,5 Y+0", "CP PA+90 DR+", "CC", "LP PR+5 PA+0", "CP IPA-180 DR-"
    )
    assert np.allclose(path.ends[-3:, 1], [[0.5, 10.0], [5.5, 10.0], [-4.5, 10.0]], atol=1e-9)
    assert np.allclose(lengths(path)[-3:], [5.0 * math.pi, 5.0, 5.0 * math.pi])


def test_a_full_circle_and_the_long_way(tmp_path: Path) -> None:
    path = read(tmp_path, "L X+10 Y+0 R0 F100", "CC X+0 Y+0", "C X+10 Y+0 DR-", "CR X+0 Y+10 R-10 DR-")
    assert np.allclose(lengths(path)[-2:], [20.0 * math.pi, 15.0 * math.pi])


def test_shifts_and_waits(tmp_path: Path) -> None:
    path = read(
        tmp_path, "L X+0 Y+0 R0 F100", "CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+100", "CYCL DEF 7.2 Y-20",
        "L X+0 Y+0", "CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL 1.5", "CYCL DEF 7.0 DATUM SHIFT",
        "CYCL DEF 7.1 X+0",
        "L X+1",
    )  # fmt: skip
    assert np.allclose(path.ends[:, 1], [[100.0, -20.0], [1.0, -20.0]])
    assert [marker.dwell for marker in path.markers if marker.dwell] == [1.5]


def test_what_says_nothing_of_the_motion_is_passed_over(tmp_path: Path) -> None:
    path = read(
        tmp_path, "; a comment", "* - structure", "TOOL DEF 1 L+0 R+5", "L Z-10 FMAX M91", "PLANE RESET STAY",
        "CYCL DEF 247 INIT. REF.PKT ~", "   Q339=1 ;REF.PUNKTNUMMER ~", "   Q340=2 ;MORE", "LBL 1",
        "L X+0 Y+0 R0 F100", "STOP", "L X+5", "M30", "L X+99",
    )  # fmt: skip
    assert path.length == 5.0
    assert any("places of the machine (M91) are left out" in each for each in path.findings)


@pytest.mark.parametrize(
    ("block", "reason"),
    [
        ("L X+1 RL", "RL is compensation of the tool's radius; write the compensated path (R0)"),
        ("C X+1 Y+1 DR+", "C needs its centre, CC, before it"),
        ("CR X+1 Y+1 R+5", "CR needs DR+ or DR-"),
        ("CC X+5 Y+5\n9 C X+0 Y+0", "C needs DR+ or DR-"),
        ("CALL LBL 2 REP 3", "line 6: LBL 2 is called, and is not in the program"),
        ("CALL LBL 0", "line 6: LBL 0 ends a subprogram; it cannot be called"),
        ("CALL LBL QS5", "line 6: LBL, CALL LBL and IF need the number of a label, or its name in quotes"),
        ('CALL LBL "" REP 2', "line 6: LBL, CALL LBL and IF need the number of a label, or its name in quotes"),
        ("LBL 1\nL X+1\nCALL LBL 1", "line 8: LBL 1: more than 19 calls within calls"),
        ("LBL 1\nFN 9: IF +1 EQU +1 GOTO LBL 1", "line 7: more than 300000 jumps are executed"),
        ("FN 0: Q1 = +5\nFN 14: IF +Q1 EQU +5 GOTO LBL 0", "line 7: FN 14 does not jump"),
        ("CALL LBL 1\nL X+1\nM30\nLBL 1\nL X+2", "within LBL 1, which has no LBL 0"),
        ("FN 18: SYSREAD Q1 = ID20 NR1", "is a function of the control, which is not read"),
        ("QS1 = \"A\"", "is not known, and is not read"),
        ("CALL PGM B.H", "'CALL PGM B.H' calls, which is not read in a Heidenhain program"),
        ("Q1 = Q2 + 7", "Q2 has no value; set it in the program before it is used"),
        ("L X+Q1", "Q1 has no value; set it in the program before it is used"),
        ("FN 4: Q1 = +8 DIV +0", "8 DIV 0 has no value"),
        ("Q1 = SQRT -4", "SQRT -4 has no value"),
        ("Q1 = ( 2 + 3", "a bracket of the formula is not closed"),
        ("Q1 = 2 +", "a value is missing at the end of the line"),
        ("Q1 = 2 ROOT 3", "expected a formula, got 'ROOT 3'"),
        ("Q1 = SGN 3", "'SGN' is not known in a formula"),
        ("Q1 = ROOT 3", "'ROOT' is not known in a formula"),
        ("Q1 = 2 $ 3", "expected a formula, got '$ 3'"),
        ("Q1 = 1" + "0" * 200 + " * 1" + "0" * 200, "is too large"),
        ("Q1 = " + "(" * 90 + "1", "more than 40 brackets within brackets"),
        ("CYCL DEF 7.1 #5", "a datum shift by a line of a table is not read"),
        ("CYCL DEF 7.1 XX", "a datum shift by 'XX' is not read"),
        ("CYCL DEF 8.1 X", "cycle 8 turns, mirrors or scales what follows"),
        ("CYCL DEF 10.1 ROT+35", "cycle 10 turns, mirrors or scales what follows"),
        ("CYCL DEF 11.1 SCL 0.5", "cycle 11 turns, mirrors or scales what follows"),
        ("APPR LT X+10 Y+10 LEN15 R0", "APPR is not read in a Heidenhain program"),
        ("PLANE SPATIAL SPA+10 SPB+0 SPC+0", "turns the plane, which is not read"),
        ("L X+5 M128", "M128 is not read in a Heidenhain program"),
        ("CYCL DEF 251 POCKET ~\n   Q200=2 ;SET-UP\n7 L X+5 M99", "M99 calls cycle 251, which is not read"),
        ("CYCL DEF 200 DRILLING Q200=2 Q201=-5 Q206=100\n7 L X+5 M99", "cycle 200 needs Q203"),
        ("CYCL DEF 200 A Q200=2 Q201=5 Q206=100 Q203=0\n7 CYCL CALL", "cycle 200: a depth above 0, 5, works upwards"),
        ("CYCL DEF 203 A Q200=2 Q201=-9 Q206=9 Q203=0 Q202=3 Q213=2\n7 CYCL CALL", "cycle 203 with chip breaking"),
        ("CYCL DEF 207 A Q200=2 Q201=-9 Q203=0 Q239=0\n7 CYCL CALL", "cycle 207 needs the speed of the spindle"),
        ("CYCL CALL PAT FMAX", "'CYCL CALL PAT FMAX' is a cycle, which is not read"),
        ("CYCL CALL", "no cycle is defined for the call"),
        ("TOOL CALL 4 X S100", "TOOL CALL X: the tool must lie along Z"),
        ("BEGIN PGM B INCH", "a program in inches, whose F is in units of its own, is not read"),
        ("WHATEVER", "'WHATEVER' is not known, and is not read"),
        ("CR X+1 Y+1 R+5 DR+ FMAX", "CR FMAX: an arc has a feed; write F"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_refused_by_its_name(tmp_path: Path, block: str, reason: str) -> None:
    assert reason in refusal(tmp_path, block)


def test_a_section_is_repeated_with_a_parameter_that_counts(tmp_path: Path) -> None:
    path = read(
        tmp_path,
        "L X+0 Y+0 Z+0 R0 FMAX",
        "Q22 = - 3",
        "LBL 2",
        "L Z+Q22 F600",
        "L X+10",
        "L X+0 Z+5 FMAX",
        "Q22 = Q22 - 3",
        "LBL 0",
        "CALL LBL 2 REP14",
        "/ 44 LBL 1",
        "/ 45 L X-1 F600",
        "/ 46 LBL 0",
        "L M30",
        "L X+500",
        numbered=False,
    )
    depths = [3.0 * (k + 1) for k in range(15)]
    cut = sum(10.0 for _ in depths) + 3.0 + sum(5.0 + depth for depth in depths[1:]) + 1.0 + 5.0 - 5.0
    fed = np.diff(path.curve_starts)[np.isfinite(path.feeds)]
    assert fed.sum() == pytest.approx(cut)
    assert path.bounding_box()[0][2] == -45.0
    assert any("blocks with / are carried out" in each for each in path.findings)


def test_subprograms_within_subprograms_and_jumps(tmp_path: Path) -> None:
    path = read(
        tmp_path,
        "L X+0 Y+0 Z+0 R0 F600",
        'CALL LBL "ROW"',
        "L IY+5",
        'CALL LBL "ROW"',
        "FN 0: Q1 = +0",
        "LBL 5",
        "L IZ-1",
        "FN 1: Q1 = +Q1 + +1",
        "FN 12: IF +Q1 LT +4 GOTO LBL 5",
        "M30",
        'LBL "ROW"',
        "CALL LBL 3",
        "L IX+1",
        "LBL 0",
        "LBL 3",
        "L IX+10",
        "LBL 0",
    )
    assert end(path) == [22.0, 5.0, -4.0]
    assert path.length == 31.0


@pytest.mark.parametrize(
    ("block", "value"),
    [
        ("FN 0: Q1 = +60", 60.0), ("FN 2: Q1 = +10 - +5", 5.0), ("FN 3: Q1 = +3 * +3", 9.0),
        ("FN 4: Q1 = +8 DIV +2", 4.0), ("FN 5: Q1 = SQRT 4", 2.0), ("FN 6: Q1 = SIN+30", 0.5),
        ("FN 7: Q1 = COS-60", 0.5), ("FN 8: Q1 = +3 LEN +4", 5.0),
        ("FN 13: Q1 = +10 ANG-10", 135.0),
        ("Q1 = 5 * 3 + 2 * 10", 35.0), ("Q1 = SQ 10 - 3^3", 73.0),
        ("Q1 = ( 1,5 + 2 ) / -7", -0.5), ("Q1 = NEG INT 2.9", -2.0), ("Q1 = ABS -4 + FRAC 2.25 - 3", 1.25),
        ("Q1 = ATAN 1 + ASIN 1 + ACOS 0", 225.0), ("Q1 = LN EXP 2 + LOG 100", 4.0), ("QL5 = 7\nQ1 = QL5", 7.0),
        ("Q1 = PI", math.pi),
    ],
)  # fmt: skip
def test_parameters_compute(tmp_path: Path, block: str, value: float) -> None:
    path = read(
        tmp_path, "L X+0 Y+0 Z+0 R0 F600", *block.split("\n"), "L X+Q1 Y-Q1 FQ1" if value > 0 else "L X+Q1 Y-Q1"
    )
    assert end(path) == pytest.approx([value, -value, 0.0])
    assert path.feeds[0] == pytest.approx((value if value > 0 else 600.0) / 60.0)


def test_datum_shifts_by_steps_and_parameters(tmp_path: Path) -> None:
    path = read(
        tmp_path,
        "L X+0 Y+0 Z+0 R0 F600",
        "Q5 = 4",
        "CYCL DEF 7.0 PUNKT BAZOWY",
        "CYCL DEF 7.1 IZ+0",
        "CYCL DEF 7.2 Y-11.75",
        "CYCL DEF 7.1 X + Q5 IY+1",
        "CYCL DEF 10.0 ROTATION",
        "CYCL DEF 10.1 ROT+0",
        "L X+0 Y+0",
    )
    assert end(path) == [4.0, -10.75, 0.0]


def test_what_a_post_for_milling_machines_writes(tmp_path: Path) -> None:
    path = read(
        tmp_path,
        "CYCL DEF 32.0 TOLERANCE",
        "CYCL DEF 247 DATUM SETTING ~\n    Q339=+1 ;DATUM NUMBER",
        "FN 0:Q2=53 ; Z FEED RATE",
        "L X36 Y0 Z0 R0 F MAX M3",
        "CYCL DEF9 .0 VARAKOZASI IDO",
        "CYCL DEF9.1 V.IDO5",
        "L X0 F Q2",
        "L Y1 FQ2",
    )
    assert path.dwells[0][1] == 5.0
    assert path.feeds.tolist() == [pytest.approx(53.0 / 60.0)] * 2
    assert not any("is defined; it is not read" in each for each in path.findings)


HOLE = {"Q200": 2, "Q201": -15, "Q206": 250, "Q202": 5, "Q210": 0, "Q203": 0, "Q204": 50, "Q211": 0.25}


def cycle(number: int, **given: float) -> list[str]:
    """CYCL DEF over several lines, as the control writes it."""
    lines = [f"{name}={value:+g} ;TEXT" for name, value in (HOLE | given).items()]
    return " ~\n    ".join([f"CYCL DEF {number} NAME", *lines]).split("\n")


def moves(path: sf.Path) -> str:
    """Kind, and Z where each move of the path ends."""
    assert path.feeds is not None
    return " ".join(
        f"{'R' if np.isinf(feed) else f'{60 * feed:g}:'}{curve.control_points[-1][2]:g}"
        for curve, feed in zip(path.curves, path.feeds, strict=True)
    )


@pytest.mark.parametrize(
    ("lines", "wanted", "waits"),
    [
        (cycle(200), "R100 R2 250:-5 R2 R-3 250:-10 R2 R-8 250:-15 R2 R50", [0.25]),
        (cycle(200, Q202=20, Q204=0), "R100 R2 250:-15 R2", [0.25]),
        (cycle(200, Q203=10, Q210=1), "R100 R12 250:5 R12 R7 250:0 R12 R2 250:-5 R12 R60", [1, 1, 0.25]),
        (cycle(201, Q208=500), "R100 R2 250:-15 500:2 R50", [0.25]),
        (cycle(201, Q208=0), "R100 R2 250:-15 250:2 R50", [0.25]),
        (
            cycle(203, Q202=8, Q212=3, Q205=4, Q213=0, Q208=900),
            "R100 R2 250:-8 900:2 R-6 250:-13 900:2 R-11 250:-15 900:2 R50", [0.25],
        ),
        (cycle(203, Q213=3, Q202=15, Q208=0), "R100 R2 250:-15 R2 R50", [0.25]),
        (cycle(240, Q343=0), "R100 R2 250:-15 R2 R50", [0.25]),
        (cycle(206), "R100 R2 250:-15 250:2 R50", [0.25]),
        (cycle(207, Q239=1.5), "R100 R2 750:-15 750:2 R50", []),
        (
            ["L Z+2 FMAX", "CYCL DEF 1.0 PECKING", "CYCL DEF 1.1 SET UP 2", "CYCL DEF 1.2 DEPTH -20",
             "CYCL DEF 1.3 PECKG 10", "CYCL DEF 1.4 DWELL 0,5", "CYCL DEF 1.5 F100"],
            "R2 R2 100:-10 R2 R-9.4 100:-20 R2", [0.5],
        ),
        (
            ["L Z+2 FMAX", "CYCL DEF 17.0 RIGID", "CYCL DEF 17.1 SET UP2", "CYCL DEF 17.2 DEPTH-10",
             "CYCL DEF 17.3 PITCH+1"],
            "R2 R2 500:-10 500:2", [],
        ),
    ],
)  # fmt: skip
def test_holes_of_cycles(tmp_path: Path, lines: list[str], wanted: str, waits: list[float]) -> None:
    """Steps by hand from the manuals that `klartext_cycles` names."""
    head = ["BEGIN PGM A MM", "TOOL CALL 1 Z S500", "L X+0 Y+0 Z+100 R0 FMAX M3"]
    for call in (["L X+10 FMAX M99"], ["L X+10 FMAX", "CYCL CALL M3"], ["CYCL CALL POS X+10 Y+0 Z+0 FMAX"]):
        if "POS" in call[0] and "CYCL DEF 1" in lines[1] + lines[0]:
            continue
        path = path_of(tmp_path, *head, *lines, *call, "L X+20 F700", "END PGM A MM", start=(0, 0, 100))
        *before, last = moves(path).split(" ")
        assert " ".join(before) == wanted and last.startswith("700:"), call
        assert [each.dwell for each in path.markers if each.dwell] == waits


def test_a_cycle_is_called_behind_every_block_until_m99(tmp_path: Path) -> None:
    lines = [*cycle(200, Q202=15), "L X+10 FMAX M89", "L X+20 FMAX", "L X+30 FMAX M99", "L X+40 FMAX"]
    path = path_of(tmp_path, "BEGIN PGM A MM", "L X+0 Y+0 Z+50 FMAX", *lines, start=(0, 0, 50))
    assert path.feeds is not None and int(np.sum(np.isfinite(path.feeds))) == 3
    assert path.length == pytest.approx(40 + 3 * 130)


def test_values_of_a_cycle_may_be_parameters(tmp_path: Path) -> None:
    lines = ["Q5 = -7", "CYCL DEF 200 A Q200=2 Q201=Q5 Q206=100 Q203=+Q6 Q202=9", "L X+1 FMAX M99"]
    path = path_of(tmp_path, "BEGIN PGM A MM", "Q6 = 3", "L X+0 Y+0 Z+50 FMAX", *lines, start=(0, 0, 50))
    assert moves(path) == "R50 R5 100:-4 R5"


def test_the_speed_beside_a_tool_counts(tmp_path: Path) -> None:
    path = path_of(tmp_path, "T1 M6 S500", "M3 G95 G1 X10 F0.1", dialect="fanuc")
    assert path.feeds is not None and path.feeds[0] == pytest.approx(50.0 / 60.0)


def test_a_datum_shift_in_new_words(tmp_path: Path) -> None:
    lines = ["L X+0 Y+0 R0 F100", "TRANS DATUM AXIS X+30 Y-40", "L X+0 Y+0", "TRANS DATUM RESET", "L X+0 Y+0"]
    assert path_of(tmp_path, "BEGIN PGM A MM", *lines).length == pytest.approx(100.0)
