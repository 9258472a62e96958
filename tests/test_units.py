"""Quantities with units: what is read, what is refused and with which words, and what people are shown."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.errors import UnitError
from splinefeed.units import KINDS, UNITS, WORDS, format_quantity, parse


@pytest.mark.parametrize(
    ("quantity", "kind", "value"),
    [
        ("60", "feed", 60.0),
        (60, "feed", 60.0),
        ("3600mm/min", "feed", 60.0),
        ("3600 MM/MIN", "feed", 60.0),
        ("60 ipm", "feed", 25.4),
        ("0.06 m/s", "feed", 60.0),
        ("3 mm s^-1", "feed", 3.0),
        ("1ms", "time", 1e-3),
        ("250 µs", "time", 250e-6),
        ("2 min", "time", 120.0),
        ("0.5in", "length", 12.7),
        ('0.5"', "length", 12.7),
        ("-1.5e1mm", "length", -15.0),
        ("5e3um", "length", 5.0),
        ("2000mm/s^3", "jerk", 2000.0),
        ("2000 mm/s³", "jerk", 2000.0),
        ("2m/s2", "acceleration", 2000.0),
        ("2m/s**2", "acceleration", 2000.0),
        ("2m/s/s", "acceleration", 2000.0),
        ("1g", "acceleration", 9806.65),
        ("180deg", "angle", math.pi),
        ("180°", "angle", math.pi),
        ("0.5rev", "angle", math.pi),
        ("15rpm", "angular velocity", math.pi / 2.0),
        ("90deg/s^3", "angular jerk", math.pi / 2.0),
    ],
)
def test_a_quantity_is_read_in_base_units(quantity: str | float, kind: str, value: float) -> None:
    assert parse(quantity, kind) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("quantity", "kind", "message"),
    [
        ("", "feed", "'' cannot be read; expected a feed such as 60mm/s or 3600mm/min"),
        ("mm", "length", "'mm' cannot be read; expected a length such as 12.5mm or 0.5in"),
        ("3,5mm", "length", "'3,5mm' uses a comma; write a decimal point; expected a length such as 12.5mm or 0.5in"),
        ("5furlong", "length", "'5furlong' has an unknown unit: furlong; expected a length such as 12.5mm or 0.5in"),
        ("5mm", "feed", "'5mm' is a length; expected a feed such as 60mm/s or 3600mm/min"),
        ("5mm/s", "jerk", "'5mm/s' is a feed; expected a jerk such as 2000mm/s^3 or 2m/s^3"),
        (
            "1000hz",
            "time",
            "'1000hz' is a frequency; expected a time such as 1ms or 0.001s",
        ),
        ("0hz", "time", "'0hz' is a frequency; expected a time such as 1ms or 0.001s"),
        ("1e999", "feed", "'1e999' is not finite; expected a feed such as 60mm/s or 3600mm/min"),
        ("1e308m", "length", "'1e308m' is not finite; expected a length such as 12.5mm or 0.5in"),
        ("nan", "angle", "'nan' cannot be read; expected an angle such as 15deg or 0.26rad"),
        (math.inf, "time", "inf is not finite; expected a time such as 1ms or 0.001s"),
        (True, "time", "True is not a number; expected a time such as 1ms or 0.001s"),
        (None, "time", "None is not a number; expected a time such as 1ms or 0.001s"),
        (
            "__import__('os')",
            "acceleration",
            "\"__import__('os')\" cannot be read; expected an acceleration such as 50mm/s^2 or 0.05m/s^2",
        ),
        ("2**9**9**9", "length", "'2**9**9**9' cannot be read; expected a length such as 12.5mm or 0.5in"),
        (
            "9" * 10_000,
            "length",
            f"'{'9' * 31}... has 10000 characters; expected a length such as 12.5mm or 0.5in",
        ),
    ],
)
def test_what_is_no_quantity_is_refused_in_one_line(quantity: str, kind: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse(quantity, kind)
    assert str(caught.value) == message


@pytest.mark.parametrize("kind", KINDS)
def test_the_examples_in_messages_can_be_read(kind: str) -> None:
    for example in KINDS[kind].example.split(" or "):
        assert parse(example, kind) > 0.0


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (60.0, "feed", "60 mm/s"),
        (1e-3, "time", "1 ms"),
        (2.5e-4, "time", "250 us"),
        (0.0, "time", "0 s"),
        (7.25, "time", "7.25 s"),
        (1234.5678, "length", "1234.57 mm"),
        (2000.0, "jerk", "2000 mm/s^3"),
    ],
)
def test_people_are_shown_a_number_and_its_unit(value: float, kind: str, text: str) -> None:
    assert format_quantity(value, kind) == text


@given(value=st.floats(-1e12, 1e12), kind=st.sampled_from(sorted(KINDS)))
def test_what_is_shown_can_be_read_back(value: float, kind: str) -> None:
    assert parse(format_quantity(value, kind), kind) == pytest.approx(value, rel=1e-5)


@given(
    st.text(max_size=80)
    | st.text(alphabet="0123456789.e+-*/^ mshzindegr²³µ°\"'_,()", max_size=40)
    | st.builds(lambda number, unit: f"{number!r}{unit}", st.floats(), st.text(alphabet="msinz*/^-0129 ", max_size=12))
)
def test_any_text_gives_a_finite_number_or_a_unit_error(text: str) -> None:
    message = ""
    try:
        value = parse(text, "length")
    except UnitError as error:
        value, message = 0.0, str(error)
    assert math.isfinite(value)
    assert "\n" not in message


def test_nothing_heavy_is_imported_for_a_unit() -> None:
    program = (
        "import sys; from splinefeed.units import parse; parse('60mm/s', 'feed'); assert 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_what_the_standards_say(unit: str) -> None:
    """Inch, foot and mil by the agreement of 1959; g is 9.80665 m/s^2 (CGPM 1901); the rest are SI's prefixes."""
    exact = {
        "nm": 1e-6, "um": 1e-3, "mm": 1, "cm": 10, "m": 1e3, "in": 25.4, "thou": 0.0254, "ft": 12 * 25.4,
        "us": 1e-6, "ms": 1e-3, "s": 1, "min": 60, "h": 3600, "hz": 1, "khz": 1e3, "ipm": 25.4 / 60, "g": 9806.65,
        "rad": 1, "mrad": 1e-3, "deg": math.pi / 180, "arcmin": math.pi / 10800, "arcsec": math.pi / 648000,
        "rev": 2 * math.pi, "rpm": 2 * math.pi / 60, "kg": 1, "n": 1e3, "kn": 1e6, "v": 1, "mv": 1e-3,
    }  # fmt: skip
    assert UNITS[unit][0] == pytest.approx(exact[unit], rel=1e-15)


@pytest.mark.parametrize(("word", "unit"), WORDS.items())
def test_a_word_is_its_unit(word: str, unit: str) -> None:
    kind = {(1, 0, 0): "length", (0, 1, 0): "time", (0, 0, 1): "angle"}[UNITS[unit][1][:3]]
    assert parse(f"2 {word}", kind) == parse(f"2{unit}", kind)
