"""Texts of 100 KB at which a pattern that backtracks would stay for minutes: refused in well under a second."""

from __future__ import annotations

import time

import pytest

from splinefeed.errors import FormatError
from splinefeed.files import json_values
from splinefeed.files.source import toml_of
from splinefeed.formats import svg_places
from splinefeed.programs.gcode.expressions import mended
from splinefeed.programs.gcode.faults import LineError

LENGTH = 100_000
HALF = LENGTH // 2
#: s; in proportion to the length each takes some hundredths of it.
MOST_SECONDS = 1.0
TEXTS = ["9" * LENGTH + "x", "." + "9" * LENGTH + "x", "1" + " " * LENGTH + "x", "a" * LENGTH, "a(" * HALF,
         "1e" + "9" * LENGTH + "x", " ," * HALF + "x", "scale(1" + " " * LENGTH + "x"]  # fmt: skip


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
    with pytest.raises(FormatError, match=r"^part: line 1: '9{20}'... is too large for a number"):
        toml_of(f"feed = {'9' * 5000}", "part")


@pytest.mark.parametrize("text", ["(" * LENGTH, "()" * HALF, "(" * HALF + ")" * HALF, ")" * LENGTH])
def test_a_program_with_many_brackets_is_mended_at_once(text: str) -> None:
    begin = time.process_time()
    assert mended(f"X1{text}", lambda said: None) == "X1"
    assert time.process_time() - begin < MOST_SECONDS


@pytest.mark.parametrize(
    ("line", "left"),
    [("X1 (a (b) c) Y2", "X1  Y2"), ("X1 (a;b) Y2", "X1  Y2"), ("X1) Y2", "X1 Y2"), ("X1 (a Y2", "X1 "),
     ("X1 ((a) Y2", "X1  Y2"), ("X1; a (b", "X1"), ("X1 (a (b;c) d", "X1  d"), ("X1 ((a) b) (c", "X1  ")],
)  # fmt: skip
def test_what_stands_outside_of_wrong_comments_is_kept(line: str, left: str) -> None:
    assert mended(line, lambda said: None) == left


def test_a_number_beyond_all_bounds_is_not_written_out() -> None:
    with pytest.raises(LineError, match="1e400 is too large for a number"):
        mended("X1e400", lambda said: None)


DOTTED = [f"feed.{'a.' * HALF}b = 1", f"[{'a.' * HALF}b]", f"x = {{{'a . ' * (LENGTH // 4)}b = 1}}",
          "'a'." + '"b".' * (LENGTH // 4) + "b = 1", "a." * 9 + "b = 1"]  # fmt: skip


@pytest.mark.parametrize("text", DOTTED, ids=lambda text: text[:12])
def test_keys_of_many_words_are_refused_before_they_are_parsed(text: str) -> None:
    begin = time.process_time()
    with pytest.raises(FormatError, match=r"^part: line 2: .* has more than 8 words between dots"):
        toml_of(f"name = 'x'\n{text}", "part")
    assert time.process_time() - begin < MOST_SECONDS


@pytest.mark.parametrize(
    "text",
    [
        "a" * LENGTH,
        "a." * 7 + "a",
        '"' * LENGTH,
        "'" + "a" * LENGTH,
        "a" + " " * LENGTH + ".",
        "a. " * 5 + "=" * LENGTH,
    ],
)
def test_a_key_is_looked_at_in_linear_time(text: str) -> None:
    begin = time.process_time()
    with pytest.raises(FormatError, match=r"^part: is not TOML"):
        toml_of(text, "part")
    assert time.process_time() - begin < MOST_SECONDS


def test_whole_numbers_of_toml_have_64_bits() -> None:
    assert toml_of("a = 9223372036854775807", "part")["a"] == 2**63 - 1
    for text, place in (
        ("a = 9223372036854775808", "a"),
        ("[b.c]\nd = [[1], [{e = -9999999999999999999}]]", "b.c.d.e"),
    ):
        with pytest.raises(FormatError, match=f"^part: {place}: a whole number has more than 64 bits"):
            toml_of(text, "part")


def test_keys_numbers_and_texts_of_people_are_no_long_keys() -> None:
    text = "machine.x.load.inertia = 2\nlist = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5]\nname = 'a. b. c ... etc.'"
    assert toml_of(text, "part")["list"][-1] == 8.5
    with pytest.raises(FormatError, match="part: has 1048577 letters; at most 1048576 are read here"):
        toml_of("#" * (2**20 + 1), "part")


def test_a_key_twice_among_many_is_found_at_once() -> None:
    pairs = ",".join(f'"key{i}": 1' for i in range(60_000))
    begin = time.process_time()
    with pytest.raises(FormatError, match='key "key59999" appears twice'):
        json_values.parse(f'{{{pairs}, "key59999": 2}}', "part")
    assert time.process_time() - begin < 2.0 * MOST_SECONDS


def test_a_whole_number_of_thousands_of_digits_in_json_has_its_line() -> None:
    with pytest.raises(FormatError, match=r"^part: line 2: '9{20}'... is too large for a number"):
        json_values.parse(f'{{"a": 1,\n "b": {"9" * 5000}}}', "part")
