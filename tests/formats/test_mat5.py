"""MATLAB's files as SciPy and MATLAB write them are read bit for bit; damaged ones are one line."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import fuzzing
from splinefeed.errors import InputError, SplinefeedError
from splinefeed.formats import mat5
from splinefeed.formats.setpoints import load

HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def saved(file: Path, packed: bool = True, **struct_of: object) -> bytes:
    scipy.io.savemat(file, {"other": np.ones(9), "record": struct_of}, do_compression=packed, oned_as="column")
    return file.read_bytes()


@pytest.mark.parametrize("packed", [True, False])
def test_what_scipy_writes_is_read_as_scipy_reads_it(tmp_path: Path, packed: bool) -> None:
    random = np.random.default_rng(2)
    told = {
        "t": random.normal(size=(50, 1)), "grid": random.normal(size=(7, 3)), "whole": np.arange(-5, 5),
        "small": np.arange(9, dtype=np.uint8), "one": 0.25, "text": "milne µ",
        "names": np.array(["x", "theta"], object),
        "inner": {"unit": "mm", "deeper": {"a": 1.0}}, "unasked": "aside", "f": np.float32([1.5, 2.5]),
    }  # fmt: skip
    content = saved(tmp_path / "a.mat", packed, **told)
    found = mat5.read_struct(content, "record", told.keys() - {"unasked"})
    other = scipy.io.loadmat(tmp_path / "a.mat", simplify_cells=True)["record"]
    assert set(found) == told.keys() - {"unasked"}
    for name in ("t", "grid", "whole", "small", "one", "f"):
        assert np.array_equal(np.squeeze(found[name]), other[name]), name
    assert (found["text"], found["names"], found["inner"]["unit"]) == ("milne µ", ["x", "theta"], "mm")
    assert found["inner"]["deeper"]["a"] == [[1.0]]


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(kind: int, sizes: tuple[int, ...], name: bytes, data: bytes) -> bytes:
    flags = element(6, struct.pack("<II", kind, 0))
    return element(14, flags + element(5, struct.pack(f"<{len(sizes)}i", *sizes)) + element(1, name) + data)


def test_numbers_that_matlab_keeps_in_fewer_bytes_and_texts_of_16_bits() -> None:
    text = matrix(4, (1, 2), b"", element(17, "µm".encode("utf-16-le")))
    fields = matrix(6, (2, 2), b"", element(2, bytes([1, 2, 3, 4]))) + text + element(14, b"")
    names = struct.pack("<HHi", 5, 4, 8) + element(1, b"a\0\0\0\0\0\0\0b\0\0\0\0\0\0\0c\0\0\0\0\0\0\0")
    content = HEAD + matrix(2, (1, 1), b"record", names + fields)
    found = mat5.read_struct(content, "record", "abc")
    assert found["a"].tolist() == [[1, 3], [2, 4]] and found["b"] == "µm" and found["c"].size == 0


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is no MATLAB file"),
        (HEAD[:-2] + b"XX", "is no MATLAB file"),
        (HEAD, "has no struct record"),
        (HEAD + element(14, b"1234567"), "is damaged: an element ends before its data"),
        (HEAD + matrix(6, (1, 1), b"record", element(9, bytes(8))), "record is no struct"),
        (HEAD + matrix(2, (2, 1), b"record", b""), "holds a list of structs"),
        (HEAD + matrix(2, (2**30, 2**30), b"record", b""), "more than 100000 cells and structs"),
        (HEAD + matrix(2, (1, 1), b"record", element(5, struct.pack("<i", 0)) + element(1, b"")), "no names of fields"),
        (HEAD + struct.pack("<II", 15, 2**31) + b"x", "is damaged: an element ends before its data"),
        (HEAD + element(15, zlib.compress(bytes(2**27))), "unpacks to far more than it packs"),
        (HEAD + element(15, b"not packed"), "is damaged: Error -3"),
    ],
)
def test_damage_is_refused_in_one_line(content: bytes, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        mat5.read_struct(content, "record", ())
    assert reason in str(caught.value) and "\n" not in str(caught.value)


def test_structs_in_structs_end(tmp_path: Path) -> None:
    inner: dict[str, object] = {}
    for _ in range(12):
        inner = {"a": inner, "b": 1.0}
    with pytest.raises(InputError, match="nested more than 8 deep"):
        mat5.read_struct(saved(tmp_path / "a.mat", **inner), "record", ("a",))


def test_every_byte_of_the_heads_may_be_anything(tmp_path: Path) -> None:
    """Each of the first bytes of an unpacked file in turn, as SciPy's reader was ended by such: by 3 values of it."""
    content = next(fuzzing.seeds("mat", tmp_path))
    file = tmp_path / "changed.mat"
    read = 0
    for at in range(0, 1400):
        for value in (0, content[at] ^ 0x80, (content[at] + 1) % 256):
            file.write_bytes(content[:at] + bytes([value]) + content[at + 1 :])
            try:
                load(file)
                read += 1
            except SplinefeedError as error:
                assert "\n" not in str(error) and str(error).startswith(str(file))
    assert 0 < read < 4200


@pytest.mark.slow
def test_ten_thousand_changed_files_end_in_setpoints_or_in_one_line(tmp_path: Path) -> None:
    assert fuzzing.fuzz("mat", 40, 10_000, tmp_path).startswith("mat: 10000 inputs")
