"""Texts of 100 KB at which a pattern that backtracks would stay for minutes: refused in well under a second."""

from __future__ import annotations

import time

import pytest

from splinefeed.errors import FormatError
from splinefeed.formats import svg_places
from splinefeed.formats.gcode.expressions import mended
from splinefeed.formats.source import toml_of

LENGTH = 100_000
#: s; in proportion to the length each takes some hundredths of it.
MOST_SECONDS = 1.0
TEXTS = ["9" * LENGTH + "x", "." + "9" * LENGTH + "x", "1" + " " * LENGTH + "x", "a" * LENGTH, "a(" * (LENGTH // 2),
         "1e" + "9" * LENGTH + "x", " ," * (LENGTH // 2) + "x", "scale(1" + " " * LENGTH + "x"]  # fmt: skip


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: f"{text[:8]}...{text[-1]}")
def test_svg_refuses_the_worst_text_at_once(text: str) -> None:
    begin = time.process_time()
    with pytest.raises(svg_places.ShapeError):
        svg_places.numbers(text, "points")
    with pytest.raises(svg_places.ShapeError):
        svg_places.quantity(text, "width", svg_places.PIXELS)
    with pytest.raises(svg_places.ShapeError):
        svg_places.transform({"transform": text}, svg_places.View())
    assert time.process_time() - begin < MOST_SECONDS


@pytest.mark.parametrize("text", ["9" * LENGTH, "9" * LENGTH + "e", "." + "9" * LENGTH + "E+"])
def test_a_program_with_a_row_of_digits_is_mended_at_once(text: str) -> None:
    begin = time.process_time()
    assert mended(text, lambda said: None) == text
    assert time.process_time() - begin < MOST_SECONDS


def test_a_whole_number_of_thousands_of_digits_is_a_fault_of_the_file() -> None:
    with pytest.raises(FormatError, match=r"^part: is not TOML: Exceeds the limit"):
        toml_of(f"feed = {'9' * 5000}", "part")
