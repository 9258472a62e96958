"""Programs as a page gets them: the numbers of `splinefeed time`, a time for each line, and errors beside fields."""

from __future__ import annotations

import base64
import shutil

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.studio.settings import Bench, SettingsError
from splinefeed.studio.tasks import plan, read, settle

PROGRAM, TABLE = "0" * 32, "1" * 32


class NoMail:
    """A worker's mail that nobody reads."""

    def tell(self, head, body=b""):
        pass


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, tmp_path, NoMail())


def settings(bench: Bench, text: str, **more):
    (bench.uploads / PROGRAM).mkdir(exist_ok=True)
    (bench.uploads / PROGRAM / "part.nc").write_text(text)
    return {"source": {"file": PROGRAM}, "machine": {"name": "hurco-02"}, "by_control": True, **more}


def column(result, name):
    return np.frombuffer(base64.b64decode(result["lines"][name]["bdata"]))


def test_a_page_gets_the_numbers_of_the_command_and_a_time_for_each_line(bench, data_dir):
    file = data_dir / "cycle-time" / "box-op2.nc"
    given = settings(bench, "")
    shutil.copy(file, bench.uploads / PROGRAM / "part.nc")
    found = plan({"settings": given}, bench)
    result, time = found["result"], sf.cycle_time(file, "hurco-02")
    assert found["final"]
    assert result["numbers"]["total_s"] == time.total
    assert result["numbers"]["tools"] == time.tools
    assert result["numbers"]["saves"] == time.saves()
    assert result["program"] == file.read_text()
    assert np.sum(column(result, "seconds")) == pytest.approx(time.total, rel=1e-12)
    place = dict(zip(column(result, "line").tolist(), zip(*map(column, [result] * 3, "xyz"), strict=True), strict=True))
    assert place[13] == pytest.approx((1.2624 * 25.4, -1.42 * 25.4, -0.0022 * 25.4))
    assert set(result["path"]["colours"]) == {"operation", "feed", "programmed feed"}
    assert {each["fill"] for each in result["figures"]["tools"]["data"]} == {"toself"}
    assert settle({"settings": given}, bench)["result"] == result


def test_a_long_program_is_left_to_a_job(bench):
    given = settings(bench, "G21 G90 G17\nG1 X9 F600\n" + "(what a post says of itself)\n" * 80_000 + "M30\n")
    assert plan({"settings": given}, bench) == {"final": False, "shown": None}
    assert settle({"settings": given}, bench)["result"]["numbers"]["blocks"] == 1


def test_a_tool_table_is_an_upload_that_gives_the_radius_of_compensation(bench):
    text = "G21 G90 G17\nG0 X-20 Y-20\nG41 D1 G1 X0 Y-10 F600\nY40\nG40 X-20\nM30\n"
    given = settings(bench, text)
    with pytest.raises(SettingsError) as caught:
        read({"source": given["source"]}, bench)
    assert caught.value.problems["source"].startswith("part.nc: line 3: G41")
    assert "give a tool table" in caught.value.problems["source"]
    (bench.uploads / TABLE).mkdir()
    (bench.uploads / TABLE / "mill.tbl").write_text("T1 P1 Z50 D6\n")
    given["source"]["tools"] = TABLE
    assert read({"source": given["source"]}, bench)["format"] == "G-code"
    result = plan({"settings": given}, bench)["result"]
    assert column(result, "x")[column(result, "line") == 4] == pytest.approx([-3.0])


@pytest.mark.parametrize(
    ("asked", "field", "words"),
    [
        ({"machine": None}, "machine", "choose the machine whose control is to run the program"),
        (
            {"machine": {"name": "lintable"}},
            "machine",
            "lintable: the acceleration of axis z is not known; add the lines ",
        ),
        ({"source": {"shape": "circle"}}, "source", "there is no such upload; drop the file again"),
        ({"source": {"file": PROGRAM, "offsets": "G99=1"}}, "source", "offsets: 'G99' is not a coordinate system"),
        ({"source": {"file": PROGRAM, "offsets": 3}}, "source", "offsets: '3' is of the wrong kind"),
        ({"source": {"file": PROGRAM, "dialect": "basic"}}, "source", "dialect 'basic' is not known"),
        ({"by_control": 1}, "by_control", "of the wrong kind"),
        ({"by_control": False}, "machine", "hurco-02 has a control but no axes; choose another machine"),
    ],
)
def test_what_is_wrong_is_said_by_field(bench, asked, field, words):
    with pytest.raises(SettingsError) as caught:
        plan({"settings": settings(bench, "G21 G90\nG1 Z-9 F600\nM30\n", **asked)}, bench)
    assert words in caught.value.problems[field]
    assert str(bench.uploads) not in str(caught.value)


def test_a_wrong_line_is_said_with_its_number(bench):
    with pytest.raises(SettingsError) as caught:
        plan({"settings": settings(bench, "G21 G90\nG1 X10 F600\nG81 Z-3\nM30\n")}, bench)
    assert caught.value.problems == {"source": "part.nc: line 3: G81 needs R"}
