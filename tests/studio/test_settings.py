"""Settings of a page: strict, every problem beside its field, and the same after a way through TOML."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import six_joints
import splinefeed as sf
from splinefeed.formats import json_curve
from splinefeed.studio import results, sources
from splinefeed.studio.settings import USUAL, Bench, SettingsError, complete, from_toml, resolve, to_toml
from splinefeed.studio.tasks import plan, read


def test_the_usual_settings_are_the_butterfly(tmp_path):
    wanted = resolve({}, tmp_path)
    assert wanted.path.name == "butterfly"
    assert wanted.limits == sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    assert (wanted.period, wanted.strategy, wanted.machine) == (1e-3, "time-optimal", None)


def test_fields_take_units_and_single_axes(tmp_path):
    limits = {"feed": "3600 mm/min", "axis_jerk": "x=2000, y=0.5m/s^3", "axis_acceleration": 500, "chord_error": ""}
    wanted = resolve({"limits": limits, "period": "0.5ms"}, tmp_path)
    assert wanted.limits.as_dict() == {
        "feed": 60.0, "axis_jerk.x": 2000.0, "axis_jerk.y": 500.0, "axis_acceleration": 500.0,
        "start_feed": 0.0, "end_feed": 0.0,
    }  # fmt: skip
    assert wanted.period == 5e-4


def test_a_field_takes_values_in_the_order_of_axes(tmp_path):
    wanted = resolve({"limits": {"feed": 60, "axis_jerk": "2000, 0.5m/s^3", "axis_acceleration": [500, 400]}}, tmp_path)
    assert wanted.limits.axis_jerk == {"x": 2000.0, "y": 500.0}
    assert wanted.limits.axis_acceleration == {"x": 500.0, "y": 400.0}
    with pytest.raises(SettingsError) as caught:
        resolve({"limits": {"feed": 60, "axis_jerk": "1, 2, 3"}}, tmp_path)
    assert caught.value.problems == {
        "limits.axis_jerk": "axis_jerk has 3 values for 2 axes; give one each, in the order x, y"
    }


def test_a_machine_holds_where_no_limit_is_given(tmp_path):
    wanted = resolve({"limits": {"feed": 60, "axis_velocity": 30}, "machine": {"name": "xytheta"}}, tmp_path)
    own = sf.Machine.load("xytheta").limits(("x", "y"))
    assert wanted.limits.axis_acceleration == own["axis_acceleration"]
    assert wanted.limits.axis_velocity == {"x": 30.0, "y": 30.0}
    text = {"name": "mine", "toml": sf.Machine.load("xytheta").axes and _text("xytheta")}
    assert resolve({"machine": text}, tmp_path).machine.name == "mine"


def _text(name: str) -> str:

    return sf.Machine.load(name).to_text()


@pytest.mark.parametrize(
    ("asked", "field", "words"),
    [
        ({"limits": {"feed": "fast"}}, "limits.feed", "'fast' cannot be read; expected a feed such as"),
        ({"limits": {"jerk": "-1"}}, "limits.jerk", "'-1' must be greater than 0"),
        ({"limits": {"axis_jerk": "q=3", "feed": 1}, "strategy": "time-optimal"}, "", ""),
        ({"limits": {}}, "limits.feed", "neither feed nor axis_velocity is given"),
        ({"limits": {"sped": 3}}, "limits.feed", "unknown limit"),
        ({"period": "soon"}, "period", "'soon' cannot be read; expected a time such as"),
        ({"strategy": "fast"}, "strategy", "'fast' is not known; the known ones are"),
        ({"strategy": "seven-phase"}, "strategy", "axis_acceleration, axis_jerk: the seven-phase strategy cannot hold"),
        ({"method": "euler"}, "method", "unknown interpolation method 'euler'; "),
        ({"machine": "router/../../etc"}, "machine", "is not a machine; there are"),
        ({"machine": {"name": "x", "toml": "[axis.x]\n"}}, "machine", "axis.x.limits: missing"),
        ({"source": {"shape": "/etc/passwd"}}, "source", "is not a shape; there are"),
        ({"source": {"shape": "circle?radius=-1"}}, "source", "radius"),
        ({"source": {"file": "../../etc/passwd"}}, "source", "there is no such upload"),
        ({"source": {"file": "0" * 32}}, "source", "the uploaded file is gone"),
        ({"source": {"curves": "{}"}}, "source", "the edited curve"),
        ({"sauce": 1}, "", "'sauce' is not a setting; did you mean 'source'?"),
        ({"corrections": True}, "corrections", "of the wrong kind"),
        ({"corrections": 101}, "corrections", "from 0 to 100"),
        ([], "", "settings must be an object"),
    ],
)
def test_what_is_wrong_is_said_by_field(tmp_path, asked, field, words):
    if words == "":
        resolve(asked, tmp_path)  # the axis is looked at by the planner, which knows the path's
        return
    with pytest.raises(SettingsError) as caught:
        resolve(asked, tmp_path)
    assert set(caught.value.problems) == {field}
    assert words in caught.value.problems[field]
    assert str(tmp_path) not in str(caught.value)


def test_several_problems_are_told_together(tmp_path):
    with pytest.raises(SettingsError) as caught:
        resolve({"limits": {"feed": "x", "jerk": 0}, "method": "m", "period": "-1"}, tmp_path)
    assert set(caught.value.problems) == {"limits.feed", "limits.jerk", "method", "period"}


def test_edited_curves_are_the_path_they_say(tmp_path):
    path = sf.shapes.butterfly()
    wanted = resolve({"source": {"curves": json_curve.to_text([path])}}, tmp_path)
    assert wanted.path.curves == path.curves
    assert wanted.origin["text"] == "butterfly.json"


def test_a_page_gets_the_words_and_units_of_each_limit(tmp_path):
    path = sf.Path([sf.NurbsCurve.bezier([[0.0], [1.0], [3.0]])], ("a",))
    limits = {"feed": 60, "acceleration": 500, "jerk": 20000, "axis_jerk": "a=9000"}
    wanted = resolve({"source": {"curves": json_curve.to_text([path])}, "limits": limits}, tmp_path)
    run = sf.run(wanted.path, wanted.limits, period=wanted.period, strategy=wanted.strategy)
    page = results.result(wanted, run)
    assert page["units"] == {
        "s": "°", "feed": "°/s", "acceleration": "°/s²", "deceleration": "°/s²", "jerk": "°/s³", "axis_jerk.a": "°/s³",
    }  # fmt: skip
    assert page["words"]["axis_jerk.a"] == "axis jerk a"
    assert page["words"]["allowed"] in run.verdict.summary


words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "source": st.dictionaries(words, words, max_size=3),
            "limits": st.dictionaries(words, st.one_of(words, st.floats(allow_nan=False, allow_infinity=False))),
            "tangential": st.booleans(),
            "method": words,
            "machine": st.one_of(st.none(), st.fixed_dictionaries({"name": words, "toml": words})),
        },
    )
)
def test_settings_come_back_from_toml(asked):
    assert from_toml(to_toml(asked)) == complete(asked)


def test_the_usual_settings_are_json_and_toml():
    assert from_toml(to_toml(USUAL)) == USUAL


class NoMail:
    """A worker's mail that nobody reads."""

    def tell(self, head, body=b""):
        pass


def test_while_a_slider_moves_a_page_gets_what_it_looks_at_and_the_same_numbers(tmp_path):
    bench = Bench(tmp_path, tmp_path, NoMail())
    settings = {"source": {"shape": "circle?radius=10"}, "period": "5 ms", "strategy": "look-ahead"}
    whole = plan({"settings": settings}, bench)
    moving = plan({"settings": settings, "look": {"figure": "binding", "colour": "curvature"}}, bench)
    assert moving["result"]["numbers"] == whole["result"]["numbers"]
    assert list(moving["result"]["figures"]) == ["binding"]
    assert moving["result"]["path"]["colours"] == {"curvature": whole["result"]["path"]["colours"]["curvature"]}
    assert "entry" in whole
    assert "entry" not in moving
    odd = plan({"settings": settings, "look": {"figure": ["x"], "colour": {}}}, bench)
    assert list(odd["result"]["figures"]) == []
    assert odd["result"]["path"]["colours"] == whole["result"]["path"]["colours"]


def test_a_tool_path_is_planned_in_the_joints_of_its_machine(tmp_path, data_dir):
    (tmp_path / ("0" * 32)).mkdir()
    text = (data_dir / "five-axis" / "flank_milling_2022.json").read_text()
    (tmp_path / ("0" * 32) / "flank.json").write_text(text)
    bench = Bench(tmp_path, tmp_path, NoMail())
    settings = {
        "source": {"file": "0" * 32},
        "period": "5 ms",
        "strategy": "look-ahead",
        "limits": {"feed": "100", "orientation_error": "0.1deg"},
        "machine": {"name": "trunnion"},
    }
    found = plan({"settings": settings}, bench)
    page = found["result"]["numbers"]
    assert found["final"]  # no servo loops of joints are simulated
    assert page["ok"]
    assert list(page["axes"]) == ["x", "y", "z", "a", "c"]
    assert page["limits"]["orientation_error"]["limit"] == pytest.approx(0.1)
    assert found["result"]["path"]["space"]
    assert found["result"]["path"]["thread"]  # the tool axis beside the tip


@pytest.fixture
def plate(tmp_path):
    """A plate of two holes as an upload: its source, and its file."""
    square = sf.shapes.from_text("circle?radius=40")
    holes = [sf.shapes.from_text("circle?radius=4").transformed([[1, 0], [0, 1]], [x, 0]) for x in (-10, 10)]
    place = tmp_path / ("1" * 32)
    place.mkdir()
    sf.write([square, *holes], place / "plate.dxf")
    return {"file": place.name}, place / "plate.dxf"


def test_a_drawing_of_several_contours_is_one_motion_as_run_plans_it(plate, tmp_path):
    source, file = plate
    wanted = resolve({"source": source, "limits": {"feed": "20", "axis_acceleration": "500"}}, tmp_path)
    expected = sf.read(file).job(feed=20.0)
    assert wanted.path.order == expected.order
    assert sorted(wanted.path.order[:2]) == [1, 2]  # the holes before the plate
    assert wanted.path.findings == expected.findings
    assert (wanted.path.feeds == expected.feeds).all()
    assert wanted.path.length == expected.length
    assert dict(wanted.reading) == {"cut_feed": 20.0}
    assert wanted.limits.feed == 20.0
    page = plan(
        {"settings": {"source": source, "limits": {"feed": "20", "axis_acceleration": "500"}}},
        Bench(tmp_path, tmp_path, NoMail()),
        at_once=False,
    )
    assert any("3 contours are one motion" in note for note in page["result"]["numbers"]["notes"])
    assert page["result"]["path"]["rapid"] is not None  # drawn dashed


def test_how_contours_are_linked_is_the_machines_or_what_the_page_says(plate, tmp_path):
    source, file = plate
    text = sf.Machine.load("plain-mill").to_text()
    machine = {"name": "mill", "toml": 'clearance = "12mm"\n' + text}
    with_lift = resolve({"source": source, "machine": machine}, tmp_path)
    assert with_lift.path.linking.clearance == 12.0
    said = resolve({"source": {**source, "clearance": "3 mm", "keep_order": True}, "machine": machine}, tmp_path)
    assert said.path.linking.clearance == 3.0
    assert said.path.order == (0, 1, 2)
    assert dict(said.reading) == {"clearance": 3.0, "cut_feed": 60.0, "keep_order": True}
    one = resolve({"source": {**source, "which": 2}}, tmp_path)
    assert one.path.length == sf.read(file, path=2).length
    for wrong, words in (("high", "rapids at z: 'high'"), (-1, "must be above the contours")):
        with pytest.raises(SettingsError, match=words):
            resolve({"source": {**source, "clearance": wrong}}, tmp_path)
    with pytest.raises(SettingsError, match="neither true nor false"):
        resolve({"source": {**source, "keep_order": "yes"}}, tmp_path)


ARM = Path(__file__).parents[1] / "data/two-link.urdf"


@pytest.mark.parametrize("along", [False, True], ids=["waypoints", "tip"])
def test_a_motion_and_a_urdf_are_an_arm_in_space(tmp_path, along):
    uploads = tmp_path / "uploads"
    uploads.mkdir()
    if along:
        urdf = six_joints.urdf()
        net = sf.robot(urdf, limits=six_joints.LIMITS).forward(six_joints.START)[0] + [
            [0, 0, 0],
            [0, 60, 0],
            [80, 60, 30],
        ]
        curve = {"degree": 2, "knots": [0, 0, 0, 1, 1, 1], "control_points": net.tolist()}
        motion = {"limits": six_joints.LIMITS, "along": {"curve": curve, "start": six_joints.START, "feed": 200}}
    else:
        urdf, motion = ARM.read_text(encoding="utf-8"), {"waypoints": [[0, 0.5], [0.8, -0.4], [1.5, 0.9]]}
    robot = sources.put(uploads, "arm.urdf", urdf.encode())
    file = sources.put(uploads, "move.json", json.dumps(motion).encode())
    bench = Bench(uploads, tmp_path, NoMail())
    source = {"file": file, "robot": robot}
    assert read({"source": source}, bench)["format"] == "arm"
    shown = plan({"settings": {"source": source}}, bench, at_once=False)
    numbers = shown["result"]["numbers"]
    assert numbers["ok"]
    assert "torque.elbow" in numbers["limits"]
    assert "the limits are those of the arm, not of this page" in numbers["notes"]
    assert numbers["command"].startswith("splinefeed run move.json --period 0.001")
    assert "--robot arm.urdf" in numbers["command"]
    assert "x (mm)" in json.dumps(shown["result"]["path"])
    with pytest.raises(SettingsError) as caught:
        read({"source": {"file": file}}, bench)
    assert "move.json: is a motion of an arm" in caught.value.problems["source"]
    curve = sources.put(uploads, "curve.json", json_curve.to_text([sf.shapes.butterfly()]).encode())
    assert read({"source": {"file": curve, "robot": robot}}, bench)["format"] == "JSON curve"


def test_what_is_wrong_with_a_robot_is_said_and_not_that_its_motion_is_no_curve(tmp_path):
    robot = sources.put(tmp_path, "arm.urdf", b"<robot/>")
    file = sources.put(tmp_path, "move.json", json.dumps({"waypoints": [[0, 0.5], [0.8, -0.4]]}).encode())
    with pytest.raises(SettingsError) as caught:
        resolve({"source": {"file": file, "robot": robot}}, tmp_path)
    assert caught.value.problems["source"].startswith("arm.urdf: ")
