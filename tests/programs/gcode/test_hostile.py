"""Broken and hostile programs: one line of our own, in bounded time, whatever stands in the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fuzzing
import splinefeed as sf
from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.programs.gcode import reader
from splinefeed.programs.gcode.dialects import DIALECTS
from splinefeed.programs.gcode.overview import summary


def survives(file: Path, **options: object) -> None:
    """Nothing but our own error comes out of reading `file`, in one line."""
    for read in (sf.read, summary):
        try:
            read(file, **options)
        except SplinefeedError as error:
            assert "\n" not in str(error) and len(str(error)) < 600


SAMPLES = (
    "cncjs_calibration.gcode",
    "gcodepreview_mach3.gcode",
    "linuxcnc_nurbs.ngc",
    "gcodetoolpath_one-inch-circle.nc",
)


@pytest.mark.parametrize("name", SAMPLES)
def test_files_that_end_too_early(tmp_path: Path, data_dir: Path, name: str) -> None:
    whole = (data_dir / "gcode" / name).read_bytes()[:2000]
    file = tmp_path / "cut.ngc"
    for end in range(1, len(whole), 10 if len(whole) < 1000 else 50):
        file.write_bytes(whole[:end])
        survives(file, repair=bool(end & 1))


def fuzz(folder: Path, data_dir: Path, seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    files = [(data_dir / "gcode" / name).read_bytes()[:600] for name in SAMPLES]
    file = folder / "noise.ngc"
    for i in range(count):
        file.write_bytes(fuzzing.program(rng, files[i % len(files)]))
        options = {"repair": bool(rng.integers(2))}
        if rng.random() < 0.5:
            options |= {"dialect": str(rng.choice(list(DIALECTS)))}
        survives(file, **options)


def test_noise(tmp_path: Path, data_dir: Path) -> None:
    fuzz(tmp_path, data_dir, 0, 300)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"G1 X1 F1\n" + b"G1 X" + b"9" * 10**6 + b"\n", "line 2: has 1000004 characters; at most 4096 can be read"),
        (b"G1 X1 F1\nG1 X" + b"[" * 4000 + b"\n", "line 2: X: more than 40 brackets within brackets"),
        (b"G1 X1 F1\nG1 X" + b"-" * 4000 + b"1\n", "line 2: X: more than 40 brackets within brackets"),
        (b"G1 X1 F1\nX" + b"#" * 4000 + b"1\n", "line 2: X: more than 40 brackets within brackets"),
        (b"G1 X1 F1\n" + b"M3 " * 50 + b"\n", "line 2: M3 and M3 exclude each other"),
        (b"G1 X1 F1\n" + b"M7 " * 1000 + b"\n", "line 2: more than 100 words"),
        (b"G1 X1 F1\nG2 X2 I9 J9 P1000000\n", "line 2: P1e+06: the turns of an arc must be whole, 1 to 1000"),
        (b"G1 X1 F1\nG1 X[2**9999]\n", "line 2: X: 2 ** 9999 has no value"),
        (b"G1 X1 F1\n\x00\x01\x02\n", "line 2: expected a letter, got '\\x00"),
    ],
)
def test_what_is_too_much_is_named(tmp_path: Path, content: bytes, reason: str) -> None:
    file = tmp_path / "part.ngc"
    file.write_bytes(content)
    for read in (sf.read, summary):
        with pytest.raises(FormatError) as caught:
            read(file)
        assert str(caught.value).startswith(f"{file}: {reason}")


def test_a_line_without_end_is_not_read_into_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "BLOCK", 2**12)
    file = tmp_path / "part.ngc"
    file.write_bytes(b"G1 X1 F1\n" + b"(" * 2**16)
    with pytest.raises(FormatError, match=r"line 2: has [0-9]+ characters; at most 4096 can be read"):
        sf.read(file)


def test_programs_of_a_wrong_name_or_size_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.ngc"
    file.write_bytes(b"solid of a kind\n")
    with pytest.raises(FormatError, match="line 1: "):
        sf.read(file)
    file.write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
    with pytest.raises(FormatError, match="pointer of Git LFS"):
        sf.read(file)
    with file.open("wb") as stream:
        stream.truncate(3 * 2**30)
    with pytest.raises(FormatError):
        sf.read(file)


def test_more_moves_than_a_path_may_have_can_still_be_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "part.ngc"
    file.write_text("F1\n" + "".join(f"G1 X{i}\n" for i in range(1, 50)))
    monkeypatch.setattr("splinefeed.programs.gcode.to_path.MAX_MOVES", 20)
    with pytest.raises(FormatError, match=r"has more than 20 moves; split it, look at it with info, or read its parts"):
        sf.read(file)
    assert summary(file).moves["G1"] == 49


def test_a_bspline_of_siemens_that_a_motion_word_ends_has_its_own_degree(tmp_path: Path) -> None:
    file = tmp_path / "part.mpf"
    file.write_text("G0 X0 Y0\nBSPLINE X2 Y5 PL=1\nX4 Y0\nX6 Y1\nCOMPCAD X8 Y1\nM30\n")
    survives(file, dialect="siemens")
    file.write_text("G0 X60 BSPLINE Z=2 F300\nG2 X10 Y0 CR=12\n")
    survives(file, dialect="siemens")


DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("suffix", "lines"),
    [
        (".ngc", ["G21", f"o{DIGITS} sub", f"o{DIGITS} endsub", "G1 X1 F10", "M2"]),
        (".nc", ["%", "O1", "G21 G90", "G1 X1. F10.", "M98 P2", "M30", f"O{DIGITS}", "M99", "%"]),
        (".h", ["0 BEGIN PGM A MM", f"1 LBL {DIGITS}", "2 L X+1 F10", "3 END PGM A MM"]),
        (".h", ["0 BEGIN PGM A MM", "1 LBL 1", "2 L X+1 F10", f"3 CALL LBL 1 REP {DIGITS}", "4 END PGM A MM"]),
        (".mpf", ["DEF REAL B=1", "A:", "N1 G90 G71 G1 X1 F10", f"REPEAT A P={DIGITS}", "M30"]),
    ],
)
def test_lines_that_jump_may_be_no_longer_than_others(tmp_path, suffix, lines):
    (file := tmp_path / f"part{suffix}").write_text("\n".join([*lines, ""]))
    options = {"dialect": "siemens"} if suffix == ".mpf" else {}
    with pytest.raises(FormatError, match=r"line \d: has \d+ characters; at most 4096 can be read") as caught:
        sf.read(file, **options)
    assert len(str(caught.value)) < 400


def test_a_number_of_a_line_of_thousands_of_digits_is_no_aim(tmp_path):
    lines = ["%", "O1", "G21 G90", "G1 X1. F10.", "GOTO 10", f"N{DIGITS} X2.", "N10 X3.", "M30", "%", ""]
    (file := tmp_path / "part.nc").write_text("\n".join(lines))
    assert sf.read(file).length == pytest.approx(3.0)
