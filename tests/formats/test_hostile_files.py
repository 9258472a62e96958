"""The same misfortunes for every reader: cut files, pointers, wrong names, noise, huge files, numbers that are none."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import fuzzing
from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.formats.registry import FORMATS, format_of, read_all

KINDS = {
    **{kind: f"formats.{kind}" for kind in ("dxf", "svg", "airfoil", "step", "iges")},
    **{"json": "formats.json_curve", "gcode": "programs.gcode", "3dm": "formats.threedm"},
}
SUFFIXES = {kind: next(each for each in FORMATS if each.module == module).suffixes[0] for kind, module in KINDS.items()}


def small(kind: str, folder: Path) -> bytes:
    """The smallest sound file of a kind."""
    return min(fuzzing.seeds(kind, folder), key=len)


def refused(file: Path) -> str:
    """The one line that says why `file` is not read."""
    with pytest.raises(SplinefeedError) as caught:
        read_all(file)
    message = str(caught.value)
    assert "\n" not in message and message.startswith(str(file)) and len(message) < 600
    return message


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_cut_at_every_tenth_byte_is_refused_or_read_up_to_there(tmp_path: Path, kind: str) -> None:
    whole = small(kind, tmp_path)[:3000]
    file = tmp_path / f"cut{SUFFIXES[kind]}"
    read = 0
    for end in range(
        1, len(whole), 10 if kind not in ("step", "iges", "3dm") else 50
    ):  # their every tenth: cad_hostile
        file.write_bytes(whole[:end])
        try:
            read_all(file)
            read += 1
        except SplinefeedError as error:
            assert "\n" not in str(error) and str(error).startswith(str(file))
    # only where every line stands for itself can a part of a file be a file
    assert read == 0 or kind in ("gcode", "airfoil", "dxf")


@pytest.mark.parametrize("kind", KINDS)
def test_a_pointer_of_git_lfs_is_told(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"part{SUFFIXES[kind]}"
    file.write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    assert "is a pointer of Git LFS, not the file itself; run: git lfs pull" in refused(file)


@pytest.mark.parametrize("kind", KINDS)
def test_the_name_may_be_wrong(tmp_path: Path, kind: str) -> None:
    content = max((each for each in fuzzing.seeds(kind, tmp_path)), key=len)
    for other in KINDS:
        if other != kind and (kind, other) != ("airfoil", "gcode"):
            file = tmp_path / f"wrong{SUFFIXES[other]}"
            file.write_bytes(content)
            assert format_of(file).module == KINDS[kind], other


@pytest.mark.parametrize("kind", KINDS)
def test_noise_is_refused(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(3)
    file = tmp_path / f"noise{SUFFIXES[kind]}"
    for content in (
        rng.bytes(5000),
        rng.integers(32, 127, 5000).astype(np.uint8).tobytes(),
        b"\0" * 5000,
        b"\xff" * 99,
    ):
        file.write_bytes(content)
        refused(file)
        file.write_bytes(small(kind, tmp_path)[:40] + content)
        refused(file)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_three_gigabytes_is_not_read_into_memory(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"large{SUFFIXES[kind]}"
    with file.open("wb") as stream:
        stream.write(small(kind, tmp_path))
        stream.truncate(3 * 2**30)
    assert "is larger than" in refused(file)


DEEP = {
    "json": b'{"curves":' + b"[" * 100_000,
    "svg": b"<svg>" + b"<g>" * 100_000,
    "dxf": b"0\nSECTION\n2\nENTITIES\n" + b"0\nSECTION\n2\nX\n" * 1000,
    "step": b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=A(" + b"(" * 100_000 + b")" * 100_001 + b";\nENDSEC;\n"
    b"END-ISO-10303-21;\n",
    "gcode": b"G1 X" + b"[" * 1000 + b"1" + b"]" * 1000 + b"\n",
}


@pytest.mark.parametrize("kind", DEEP)
def test_what_lies_too_deep_is_refused(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"deep{SUFFIXES[kind]}"
    file.write_bytes(DEEP[kind])
    refused(file)


NUMBERS = {
    "json": '{"degree":1,"knots":[0,0,1,1],"control_points":[[0,0],[1,%s]]}',
    "svg": '<svg width="9mm" height="9mm" viewBox="0 0 9 9"><path d="M0 0 L1 %s"/></svg>',
    "dxf": "0\nSECTION\n2\nENTITIES\n0\nLINE\n10\n0\n20\n0\n11\n1\n21\n%s\n0\nENDSEC\n0\nEOF\n",
    "gcode": "G1 X1 Y%s F100\n",
    "airfoil": "name\n1 0\n0.5 0.1\n0 0\n0.5 %s\n1 0\n",
}


@pytest.mark.parametrize(
    "word", ["nan", "NaN", "inf", "-Infinity", "1e999", "0x10", "1_0", "\u0661", "", "1.2.3", "--1"]
)
@pytest.mark.parametrize("kind", NUMBERS)
def test_words_that_are_no_numbers_are_refused(tmp_path: Path, kind: str, word: str) -> None:
    file = tmp_path / f"part{SUFFIXES[kind]}"
    file.write_text(NUMBERS[kind] % "2")
    read_all(file)
    file.write_text(NUMBERS[kind] % word)
    if (kind, word) in (("gcode", "--1"), ("dxf", "1_0"), ("dxf", "\u0661")):
        return  # minus minus one is a value of RS274, and ezdxf takes what Python's float takes
    refused(file)


COUNTS = {
    "dxf": b"0\nSECTION\n2\nENTITIES\n0\nSPLINE\n70\n8\n71\n999999999\n72\n999999999\n73\n999999999\n40\n0\n10\n1\n"
    b"20\n1\n0\nENDSEC\n0\nEOF\n",
    "dxf of rows": b"0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nb\n0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n0\nENDBLK\n0\nENDSEC\n"
    b"0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nb\n70\n32000\n71\n32000\n44\n1\n45\n1\n0\nENDSEC\n0\nEOF\n",
    "json": b'{"degree":999999999,"knots":[0,1],"control_points":[[0,0],[1,1]]}',
    "gcode": b"G6.2 P999999999 K0 X1\n",
    "airfoil": b"name\n999999999. 999999999.\n\n0 0\n1 0\n\n0 0\n1 0\n",
    "step": b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=B_SPLINE_CURVE_WITH_KNOTS('',999999999,(),.U.,.F.,.F.,"
    b"(999999999),(0.),.U.);\nENDSEC;\nEND-ISO-10303-21;\n",
    "3dm": b"3D Geometry File Format        8" + struct.pack("<Iq", 1, 2**62) + b"\0" * 40,
}


@pytest.mark.parametrize("kind", COUNTS)
def test_huge_counts_are_refused(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"counts{SUFFIXES[kind.split()[0]]}"
    file.write_bytes(COUNTS[kind])
    refused(file)


def test_old_line_ends_of_a_drawing(tmp_path: Path) -> None:
    file = tmp_path / "old.dxf"
    file.write_bytes((NUMBERS["dxf"] % "2").replace("\n", "\r").encode())
    assert format_of(file).module == "formats.dxf" and len(read_all(file)) == 1


def test_a_folder_an_empty_file_and_none(tmp_path: Path) -> None:
    (tmp_path / "empty.dxf").touch()
    for name, reason in ((".", "is a folder"), ("empty.dxf", "is empty"), ("none.stp", "no such file")):
        with pytest.raises(FormatError, match=reason):
            read_all(tmp_path / name)
