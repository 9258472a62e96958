"""The public names: which there are, one home each, and what their docstrings say."""

from __future__ import annotations

import ast
import inspect
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from types import ModuleType

import pytest

import splinefeed as sf

#: What users may import; a change here is a change of the API and needs a line in CHANGELOG.md.
PUBLIC = {
    "splinefeed": """
        Limits Machine NurbsCurve Path Response Run Setpoints SplinefeedError TimeLaw ToolPath Verdict __version__
        analysis check cycle_time errors formats interpolate interpolation kinematics load machine paths plan planner
        plot programs read records report robot robots run runs save shapes simulation smooth sweep write
    """,
    "splinefeed.analysis": "AxisMotion Contour LimitUse Ripple feed_ripple",
    "splinefeed.formats": "BitPattern read_parts",
    "splinefeed.interpolation": "Interpolator methods register",
    "splinefeed.paths": "Fit Job Marker PathParts Smoother fit job shapes smooth_stream tangential Track",
    "splinefeed.planner": "LawSource LookAhead MotionBlock Override OverrideTicks State with_reserve",
    "splinefeed.plot": """
        Figure binding bode compare contour errors joints law limits motion overview path program ripple
    """,
    "splinefeed.programs": "CycleTime",
    "splinefeed.robots": "Arm JointTrajectory Payload joint_trajectory motion_at",
    "splinefeed.runs": """
        AxisTuning MethodResult MethodTrace PathTuning compare follow stream_setpoints tune tune_on_path
    """,
    "splinefeed.simulation": "Bound Margins Tuning UltimatePoint margins",
}
ROOMS = [room for room in PUBLIC if room != "splinefeed.plot"]


def module(room: str):
    return sf.plot if room == "splinefeed.plot" else import_module(room)


@pytest.mark.parametrize("room", PUBLIC)
def test_the_public_names_are_these(room):
    assert sorted(module(room).__all__) == sorted(PUBLIC[room].split())
    for name in PUBLIC[room].split():
        assert getattr(module(room), name) is not None


def test_each_name_has_one_home():
    seen: dict[int, str] = {}
    for room, names in PUBLIC.items():
        for name in names.split():
            value = getattr(module(room), name)
            assert id(value) not in seen or isinstance(value, ModuleType | str), (
                f"{room}.{name} is {seen[id(value)]} too"
            )
            seen[id(value)] = f"{room}.{name}"


@pytest.mark.parametrize("room", ROOMS)
def test_a_checker_of_types_sees_the_same_names(room):
    """The stub that checkers read is what the imports at work go by."""
    tree = ast.parse(Path(module(room).__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    for node in imports:
        home = import_module(f".{node.module}" if node.module else ".", package=room)
        for each in node.names:
            assert each.asname == each.name
            found = getattr(home, each.name) if node.module else import_module(f"{room}.{each.name}")
            assert getattr(module(room), each.name) is found
    typed = {each.name for node in imports for each in node.names}
    assert typed == set(PUBLIC[room].split()) - {"__version__"}


def test_a_name_that_is_none():
    with pytest.raises(AttributeError, match=r"No splinefeed attribute plann$"):
        sf.plann  # noqa: B018


def test_what_is_no_path_is_refused():
    with pytest.raises(sf.SplinefeedError, match=r"smooth: expected Path first, got int"):
        sf.smooth(5, 0.01)


@pytest.fixture(scope="module")
def motion():
    path = sf.shapes.naca("0025", perimeter=33)
    limits = sf.Limits(feed=60, acceleration=50, jerk=2000)
    law = sf.plan(path, limits, period=1e-3)
    return path, limits, law, sf.interpolate(path, law)


def test_a_wrong_order_is_refused_and_named(motion):
    path, limits, law, setpoints = motion
    machine = sf.Machine.load("xytheta")
    for call, message in [
        (
            lambda: sf.check(path, setpoints, limits),
            "check: expected Setpoints first, got Path; the order is check(setpoints, path, limits)",
        ),
        (
            lambda: sf.check(setpoints, limits, path),
            "check: expected Path second, got Limits; the order is check(setpoints, path, limits)",
        ),
        (
            lambda: sf.check(setpoints, path, law),
            "check: expected Limits third, got TimeLaw; the order is check(setpoints, path, limits)",
        ),
        (lambda: sf.plan(limits, path), "plan: expected Path first, got Limits; the order is plan(path, limits)"),
        (lambda: sf.plan(path, law), "plan: expected Limits second, got TimeLaw; the order is plan(path, limits)"),
        (
            lambda: sf.interpolate(law, path),
            "interpolate: expected Path first, got TimeLaw; the order is interpolate(path, law)",
        ),
        (
            lambda: sf.runs.follow(machine, setpoints),
            "follow: expected Setpoints first, got Machine; the order is follow(setpoints, machine)",
        ),
        (lambda: sf.run(limits, path), "run: expected Path first, got Limits; the order is run(path, limits)"),
        (lambda: sf.read(path), "read: expected str first, got Path; the order is read(file)"),
        (lambda: sf.write("x.dxf", path), "write: expected str second, got Path; the order is write(path, file)"),
        (lambda: sf.save("x.csv", setpoints), "save: expected str second, got Setpoints; the order is save(record, fi"),
        (lambda: sf.check([setpoints.position], path, limits), "check: expected Setpoints or chunks of them, got nda"),
    ]:
        with pytest.raises(sf.errors.InputError) as error:
            call()  # type: ignore[no-untyped-call]
        assert str(error.value).startswith(message)


def test_a_name_stands_for_a_machine_and_for_one_method(motion):
    path, _, law, setpoints = motion
    by_name = sf.runs.follow(setpoints, "xytheta", path=path)
    assert (
        by_name.contour_error_max == sf.runs.follow(setpoints, sf.Machine.load("xytheta"), path=path).contour_error_max
    )
    assert [each.result.method for each in sf.runs.compare(path, law, methods="taylor-2", timed=False)] == ["taylor-2"]


def test_records_are_one_short_line(motion):
    path, limits, law, setpoints = motion
    run = sf.run(path, limits)
    records = law, setpoints, run, sf.runs.follow(setpoints, "xytheta"), sf.Machine.load("router")
    for record in records:
        assert repr(record).startswith(f"{type(record).__name__}(")
        assert len(repr(record)) < 200
    assert repr(law) == f"TimeLaw('seven-phase', {law.length:.6g} mm in {law.duration:.6g} s)"
    assert repr(records[-1]) == "Machine('router', axes x y z)"


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("plan", ["path", "limits"]),
        ("run", ["path", "limits"]),
        ("interpolate", ["path", "law"]),
        ("runs.compare", ["path", "law"]),
        ("check", ["setpoints", "path", "limits"]),
        ("runs.follow", ["setpoints", "machine"]),
    ],
)
def test_all_behind_the_chain_is_keyword_only(name, first):
    parameters = inspect.signature(attrgetter(name)(sf)).parameters
    assert [each for each, p in parameters.items() if p.kind is not p.KEYWORD_ONLY] == first
