"""Texts and values as numbers: what is one, what is too large, and in which words it is refused."""

from __future__ import annotations

import math
import time
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.errors import InputError
from splinefeed.numbers import MOST, MOST_WHOLE, finite, whole, within

LENGTH = 100_000
WORST = ["9" * LENGTH, "." + "9" * LENGTH + "x", "1" + " " * LENGTH + "x", "1e" + "9" * LENGTH, "-" * LENGTH,
         "e" * LENGTH, "1" * LENGTH + "." + "1" * LENGTH + "."]  # fmt: skip


@given(st.floats(-MOST, MOST))
def test_what_python_writes_is_read_again(value: float) -> None:
    assert finite(repr(value)) == value == finite(value)


@pytest.mark.parametrize(("text", "value"), [(" +1.5e3 ", 1500.0), (".5", 0.5), ("5.", 5.0), ("1E-400", 0.0)])
def test_forms_of_numbers(text: str, value: float) -> None:
    assert finite(text) == value


@pytest.mark.parametrize(
    "wrong", ["", "x", "1_0", "0x10", "\u0661", "1,5", "1e", "--1", "1.2.3", "nan", "inf", True, None, [1], b"1", "1 2"]
)
def test_what_is_no_number_is_refused_by_its_name(wrong: object) -> None:
    with pytest.raises(InputError, match=r"^depth is .*; expected a number$"):
        finite(wrong, "depth")


@pytest.mark.parametrize("wrong", ["1e101", "-1e400", math.nan, 10**400, np.float64("inf"), Fraction(10**200)])
def test_what_is_too_large_is_refused(wrong: object) -> None:
    with pytest.raises(InputError, match=r"expected a number of at most 1e\+100 in size$"):
        finite(wrong)


def test_whole_numbers() -> None:
    assert [whole(each, "", 0, 9) for each in ("0", "+9", 5)] == [0, 9, 5]
    assert whole(str(MOST_WHOLE)) == MOST_WHOLE
    for wrong in ("", "+", "-1", "10", "1.0", "1e0", "\u0661", "9" * 5000, 10, 10**5000, True, 1.0, None):
        with pytest.raises(InputError, match=r"^count is .*; expected a whole number from 0 to 9$"):
            whole(wrong, "count", 0, 9)


def test_a_cube_of_the_largest_is_finite() -> None:
    assert (
        math.isfinite(MOST**3) and within(MOST) and not within(math.nextafter(MOST, math.inf)) and not within(math.nan)
    )


@pytest.mark.parametrize("text", WORST, ids=lambda text: f"{text[:4]}...{text[-1]}")
def test_the_worst_texts_are_refused_at_once(text: str) -> None:
    begin = time.process_time()
    for read in (finite, whole):
        with pytest.raises(InputError) as caught:
            read(text, "depth")
        assert len(str(caught.value)) < 200
    assert time.process_time() - begin < 1.0
