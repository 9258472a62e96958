"""limits.toml: what is written comes back, units and degrees, and every error at once with its key."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import splinefeed as sf
from splinefeed.errors import FormatError, UnitError
from splinefeed.machine import limits_toml

WHOLE = """\
# a small router
feed = "3600mm/min"
acceleration = 500
deceleration = "0.4m/s^2"
jerk = "20m/s^3"
chord_error = "1um"
centripetal = 300.0
end_feed = 0
axis_velocity = 80

[axis_acceleration]
x = "0.5m/s^2"
theta = 90           # deg/s^2

[axis_jerk]
x = 20000
theta = "2rad/s^3"

[travel]
x = [-1, "0.5m"]
theta = [-90, 90]
"""


def test_a_whole_file():
    limits = limits_toml.parse(WHOLE)
    assert limits == sf.Limits(
        feed=60,
        acceleration=500,
        deceleration=400,
        jerk=20000,
        chord_error=1e-3,
        centripetal=300,
        axis_velocity=80,
        axis_acceleration={"x": 500.0, "theta": math.pi / 2},
        axis_jerk={"x": 20000.0, "theta": 2.0},
        axis_minimum={"x": -1.0, "theta": -math.pi / 2},
        axis_maximum={"x": 500.0, "theta": math.pi / 2},
    )
    assert limits.travel == {"x": (-1.0, 500.0), "theta": (-math.pi / 2, math.pi / 2)}


def test_every_field_of_limits_has_a_kind():
    python_only = {"combinations", "torque", "modelled"}
    kinds = {*limits_toml.KINDS, "axis_minimum", "axis_maximum", *python_only}
    assert kinds == {f.name for f in dataclasses.fields(sf.Limits)}


@pytest.mark.parametrize(
    ("text", "order", "value"),
    [
        (90, 1, math.pi / 2),
        ("90", 2, math.pi / 2),
        ("90deg/s", 1, math.pi / 2),
        ("90 °/s", 1, math.pi / 2),
        ("30rpm", 1, math.pi),
        ("0.5rev/s", 1, math.pi),
        ("180deg/min", 1, math.pi / 60),
        ("180deg/s^2", 2, math.pi),
        ("180 deg/s3", 3, math.pi),
        ("1e3rad/s^3", 3, 1000.0),
        ("15deg", 0, math.pi / 12),
    ],
)
def test_quantities_of_rotary_axes(text, order, value):
    assert limits_toml.turning(text, order) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("text", "order"), [("90deg/s", 2), ("90mm/s", 1), ("90deg", 1), ("90deg/s", 0), ("fast", 1)])
def test_what_is_no_quantity_of_a_rotary_axis(text, order):
    with pytest.raises(UnitError, match=r"; expected an angle such|; expected an angular (velocity|acceleration) such"):
        limits_toml.turning(text, order)


def test_all_errors_at_once_each_with_its_key():
    text = """\
feed = "60mm"
acceleration = -5
jrek = 3
chord_error = [1]

[axis_jerk]
x = true
theta = "3mm/s^3"
[travel]
x = [3, 1]
y = 4
"""
    with pytest.raises(limits_toml.LimitsFileError) as caught:
        limits_toml.parse(text, "machine.toml")
    problems = caught.value.problems
    starts = [
        "feed: '60mm' is a length",
        "acceleration: -5 must be greater than 0",
        "jrek: unknown limit; did you mean 'jerk'?",
        "chord_error: must be one number",
        "axis_jerk.x: True is not a number",
        "axis_jerk.theta: '3mm/s^3' is a jerk; expected an angular jerk such as 90deg/s^3",
        "travel.x: runs from 3 to 1",
        "travel.y: 4; write least and greatest position",
    ]
    assert len(problems) == len(starts)
    for problem, start in zip(problems, starts, strict=True):
        assert problem.startswith(start)
    assert str(caught.value).startswith("machine.toml: 8 errors\n")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("feed = ", "limits: is not TOML: "),
        ("", "limits: neither feed nor axis_velocity is given"),
        ("feed = 60\nstart_feed = 70", "limits: start_feed: is 70 mm/s; it must lie between"),
        ("feed = nan", "limits: feed: nan is not finite"),
        ("travel = 3\nfeed=1", "limits: travel: 3; write least and greatest position of each axis"),
        ("feed = {x = 1}", "limits: feed: must be one number"),
    ],
)
def test_refused(text, message):
    with pytest.raises(FormatError) as caught:
        limits_toml.parse(text)
    assert str(caught.value).startswith(message)


positive = st.floats(1e-12, 1e12)


@given(
    flat=st.fixed_dictionaries({"feed": positive}, optional={
        "acceleration": positive, "jerk": positive, "deceleration": positive, "chord_error": positive,
        "centripetal": positive, "axis_jerk.x": positive, "axis_jerk.theta": positive, "axis_velocity": positive,
    })
)  # fmt: skip
def test_what_is_written_comes_back(flat):
    limits = sf.Limits.from_dict(flat)
    back = limits_toml.parse(limits_toml.to_text(limits))
    for name, value in limits.as_dict().items():
        if name.endswith(".theta"):
            assert back.as_dict()[name] == pytest.approx(value, rel=1e-15)
        else:
            assert back.as_dict()[name] == value
    assert set(back.as_dict()) == set(limits.as_dict())


def test_files(tmp_path):
    limits = limits_toml.parse(WHOLE)
    file = tmp_path / "limits.toml"
    limits_toml.write(limits, file)
    assert limits_toml.read(file) == limits
    assert "theta = 90.0 # deg/s^2" in file.read_text()
    with pytest.raises(FormatError, match="no such file"):
        limits_toml.read(tmp_path / "no.toml")
