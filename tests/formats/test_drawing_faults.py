"""Drawings cut, garbled and made up: nothing but the house's own errors comes out."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from splinefeed.errors import SplinefeedError
from splinefeed.formats import dxf, svg

DATA = Path(__file__).parents[1] / "data"
FILES = sorted([*(DATA / "dxf").iterdir(), *(DATA / "svg").iterdir()])
READERS = {".dxf": dxf.from_file, ".svg": svg.from_file}
#: What is put into a file in place of something else.
SPLINTERS = [
    b"nan", b"inf", b"-1", b"0", b"1e400", b"999999999999", b"", b"\n", b"\0", b"\xff", b"  0\nENDSEC\n", b"</g>",
    b"<g>", b"LINE", b"SPLINE", b"INSERT", b"40", b"10", b"z", b"A", b"#", b"%", b'"', b"1_0",
]  # fmt: skip


def survives(content: bytes, suffix: str, file: Path) -> None:
    file.write_bytes(content)
    for repair in (False, True):
        with contextlib.suppress(SplinefeedError):
            READERS[suffix](file, repair=repair)


def garbled(rng: np.random.Generator) -> tuple[bytes, str]:
    """A real file with some bytes taken out, put in, or moved."""
    source = FILES[rng.integers(len(FILES))]
    content = source.read_bytes()[:20_000]
    for _ in range(rng.integers(1, 6)):
        at, width = rng.integers(len(content)), int(rng.integers(0, 30))
        splinter = SPLINTERS[rng.integers(len(SPLINTERS))]
        content = (content[:at] + splinter + content[at + width :]) or b"0"
        if rng.random() < 0.1:
            content = content[: rng.integers(1, len(content) + 1)]
    return content, source.suffix.lower()


def test_garbled_files_end_in_our_errors(tmp_path):
    rng = np.random.default_rng(11)
    for _ in range(150):
        survives(*garbled(rng), tmp_path / "bad")


codes = st.sampled_from(
    [0, 1, 2, 5, 8, 10, 11, 12, 20, 21, 30, 38, *range(40, 45), 50, 51, 60, 66, 67, *range(70, 75), 90, 210, 220, 230]
)
values = st.one_of(
    st.sampled_from(["LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE", "VERTEX", "SEQEND",
                     "INSERT", "BLOCK", "ENDBLK", "ENDSEC", "b", "0", "1", "-1", "3", "1e300", "-1e-300", "nan"]),
    st.floats(-100, 100).map(repr),
)  # fmt: skip


@settings(max_examples=100)
@given(st.lists(st.tuples(codes, values), max_size=60))
def test_made_up_tags_end_in_our_errors(tmp_path_factory, tags):
    head = "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nb\n0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n0\nENDBLK\n0\nENDSEC\n"
    body = "".join(f"{code}\n{value}\n" for code, value in tags)
    text = head + "0\nSECTION\n2\nENTITIES\n" + body + "0\nENDSEC\n0\nEOF\n"
    survives(text.encode(), ".dxf", tmp_path_factory.getbasetemp() / "tags.dxf")


@settings(max_examples=150)
@given(
    st.text("MmZzLlHhVvCcSsQqTtAa0123456789.,-+e \n#", max_size=60), st.text("matrixscalewYX(), 019.-e", max_size=30)
)
def test_made_up_path_data_ends_in_our_errors(tmp_path_factory, data, transform):
    text = f'<svg width="9mm" height="9mm" viewBox="0 0 9 9"><path d="M1 2 {data}" transform="{transform}"/></svg>'
    survives(text.encode(), ".svg", tmp_path_factory.getbasetemp() / "data.svg")
