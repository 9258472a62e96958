"""What commands print: numbers that can be read, JSON that is JSON, tables that no pipe cuts."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from splinefeed.cli import failures, output


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 4, "0"),
        (-0.0, 4, "0"),
        (40.0, 4, "40"),
        (39.98, 4, "39.98"),
        (1539.96, 4, "1540"),
        (62562.3, 4, "62562"),
        (0.00019426, 3, "0.000194"),
        (1.2345e-5, 3, "1.23e-5"),
        (4.085e8, 4, "4.085e8"),
        (-4.085e8, 4, "-4.085e8"),
        (1e-300, 4, "1.000e-300"),
        (100.0, 1, "100"),
        (math.inf, 4, "inf"),
        (math.nan, 4, "nan"),
    ],
)
def test_numbers_for_people(value, digits, text):
    assert output.number(value, digits) == text


def test_json_is_plain(capsys):
    given = {
        "tuple": (1, 2),
        "array": np.array([[1.5, np.nan]]),
        "numpy": np.float64(0.1),
        "flag": np.bool_(True),
        "none": None,
        "infinite": math.inf,
        1: "x",
    }
    output.print_json(given)
    assert json.loads(capsys.readouterr().out) == {
        "tuple": [1, 2],
        "array": [[1.5, None]],
        "numpy": 0.1,
        "flag": True,
        "none": None,
        "infinite": None,
        "1": "x",
    }


def test_no_cell_is_cut(capsys):
    row = ["a" * 90, "1" * 60, "[red]2[/red]"]
    output.print_blocks([output.table(["name", "digits", "markup"], [row])])
    text = capsys.readouterr().out
    assert text.splitlines()[1].split() == row
    assert "\x1b" not in text


def test_what_a_terminal_would_obey_is_escaped():
    assert failures.visible("a\x07\x1b[2J") == "a\\x07\\x1b[2J"
    assert failures.visible("  µ² 飛\udcff") == "  µ² 飛\\udcff"


def test_nothing_of_this_machine_is_in_the_sources():
    package = Path(output.__file__).parents[1]
    for source in [*package.glob("cli/*.py"), *package.glob("reports/*.py")]:
        assert str(Path.home()) + "/" not in source.read_text()
