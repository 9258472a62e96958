"""Logs of runs: the events that are read, and what is refused with its line."""

from __future__ import annotations

import pytest

from splinefeed.errors import FormatError
from splinefeed.programs.run_log import read_run

GOOD = """seconds,what,value
0.0,Block_Number,0
1.5,Program_Status,ACTIVE
2.0,Block_Number,3
2.2,Feed_Rate,25.4
2.5,Block_Number,5
9.0,Program_Status,PROGRAM_COMPLETED
9.5,Feed_Rate,0
"""


def read(tmp_path, text):
    file = tmp_path / "run.csv"
    file.write_text(text)
    return read_run(file)


def test_a_run_is_from_active_to_its_end(tmp_path):
    run = read(tmp_path, GOOD)
    assert (run.start, run.end, run.duration, run.name) == (1.5, 9.0, 7.5, "run.csv")
    assert run.line.tolist() == [0, 3, 5]
    assert run.seconds.tolist() == [0.0, 2.0, 2.5]


def test_without_a_status_it_is_from_the_first_line_to_the_last_event(tmp_path):
    bare = "\n".join(line for line in GOOD.splitlines() if "Status" not in line)
    assert (read(tmp_path, bare).start, read(tmp_path, bare).end) == (2.0, 9.5)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2.2,Feed_Rate,25.4", "2.2,Feed_Rate", "line 5: expected seconds,what,value"),
        ("2.2,", "nan,", "line 5: expected seconds,what,value"),
        ("2.2,", "1e999,", "line 5: expected seconds,what,value"),
        ("2.2,", "1.0,", "line 5: expected seconds,what,value, sorted by time"),
        ("Block_Number,5", "Block_Number,-5", "line 6: Block_Number is '-5'; expected a whole"),
        ("Block_Number,", "Line,", "no event Block_Number names a line"),
        ("9.0,Program_Status,PROGRAM_COMPLETED\n9.5,Feed_Rate,0", "", None),
        (GOOD, "", "is empty"),
    ],
)
def test_what_is_no_log_is_refused_with_its_line(tmp_path, old, new, words):
    assert old in GOOD
    if words is None:
        assert read(tmp_path, GOOD.replace(old, new)).end == 2.5
        return
    with pytest.raises(FormatError, match=words):
        read(tmp_path, GOOD.replace(old, new))
