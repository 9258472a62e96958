"""Errors chunk by chunk are those of the whole; numbers by hand."""

from __future__ import annotations

import numpy as np
import pytest

from splinefeed.analysis.following import ErrorTally
from splinefeed.errors import InputError
from splinefeed.records import Response

PERIOD = 0.5


def response(error_x, error_a, contour=None, start=0.0, **besides) -> Response:
    """A machine that is off by these errors, mm and rad, when it is told to stand at 0."""
    n = len(error_x)
    off = np.column_stack([error_x, error_a])
    return Response(
        t=start + PERIOD * np.arange(n),
        command=np.zeros((n, 2)),
        position=-off,
        measured=-off,
        output=np.zeros((n, 2)),
        saturated=np.column_stack([np.abs(error_x) > 2.5, np.zeros(n, dtype=bool)]),
        axes=("x", "a"),
        period=PERIOD,
        contour_error=None if contour is None else np.asarray(contour),
        **besides,
    )


def test_the_worst_of_two_chunks_with_its_place_and_the_mean_over_both():
    tally = ErrorTally(("x", "a"))
    tally.see(response([1.0, -2.0], [0.0, 0.1], [0.5, 0.25]), np.array([10.0, 11.0]))
    tally.see(response([3.0, 0.0, 0.0], [0.0, -0.2, 0.0], [0.0, 0.0, 1.0], start=1.0, stopped="x: off"), None)
    numbers = tally.numbers()
    x, a = numbers["tracking"]["x"], numbers["tracking"]["a"]
    assert (x["unit"], x["max"], x["at_t_s"], x["at_s_mm"], x["saturated_ticks"]) == ("mm", 3.0, 1.0, None, 1)
    assert x["rms"] == pytest.approx(np.sqrt((1 + 4 + 9) / 5))
    assert (a["unit"], a["at_t_s"]) == ("deg", 1.5)
    assert a["max"] == pytest.approx(np.degrees(0.2))
    assert a["rms"] == pytest.approx(np.degrees(np.sqrt((0.01 + 0.04) / 5)))
    assert numbers["contour_error_max_mm"] == 1.0
    assert numbers["contour_error_rms_mm"] == pytest.approx(np.sqrt((0.25 + 0.0625 + 1.0) / 5))
    assert numbers["contour_error_at"] == {"t_s": 2.0, "s_mm": None}
    assert numbers["tracking_error_max"]["x"] == 3.0
    assert numbers["stopped"] == "x: off"


def test_the_place_of_the_worst_is_that_of_its_own_chunk():
    tally = ErrorTally(("x", "a"))
    tally.see(response([1.0, -2.0], [0.0, 0.1]), np.array([10.0, 11.0]))
    tally.see(response([], []), np.array([]))
    tally.see(response([0.5], [0.0], start=1.0), np.array([12.0]))
    found = tally.numbers()
    assert found["tracking"]["x"]["at_s_mm"] == 11.0
    assert found["contour_error_max_mm"] is None


def test_nothing_seen_is_no_error_and_other_axes_are_refused():
    tally = ErrorTally(("x", "y"))
    assert tally.numbers()["tracking"]["x"]["rms"] == 0.0
    with pytest.raises(InputError, match=r"the response has axes \('x', 'a'\); expected \('x', 'y'\)"):
        tally.see(response([1.0], [0.0]))
