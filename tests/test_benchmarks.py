"""Benchmarks: the C kernel does what Numba does, and results land where they belong. No test looks at a time."""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib import import_module

import numpy as np
import pytest
from benchmarks import __main__ as command
from benchmarks import (
    arc,
    cases,
    child,
    online,
    paths,
    peer_copp,
    points,
    sampled,
    servo,
    stream,
    tables,
    ticks,
    timing,
)

import splinefeed as sf


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed: nothing to compare Numba with")
    compiled = ticks.compile_kernel(str(tmp_path_factory.mktemp("ticks")), ["-Wall", "-Wextra", "-Werror"])
    assert compiled is not None, "gcc refused benchmarks/ticks.c"
    return compiled


def joined_paths():
    """One curve with knots, one without tight bends, and a joint in the middle of a motion."""
    smooth = cases.smooth()
    (curve,) = smooth.curves
    return [cases.butterfly(), smooth, sf.Path(curve.split(0.3, 0.4), name="three curves")]


@pytest.mark.parametrize("method", ticks.METHODS)
@pytest.mark.parametrize("path", joined_paths(), ids=lambda path: path.name)
def test_the_c_kernel_gives_the_points_of_the_numba_loop(library, path, method):
    lap = ticks.Lap(path, method)
    by_numba, by_c = lap.room(), lap.room()
    lap.by_numba(by_numba)
    lap.by_c(library, by_c)
    np.testing.assert_array_equal(by_c[0], by_numba[0])
    assert by_numba[2][-1] > 0.0
    assert ticks.largest_difference(by_numba, by_c) <= 1e-12


def test_the_c_kernel_refuses_paths_that_it_was_not_compiled_for(library):
    lap = ticks.Lap(sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, 5], [20, 0]])]), "arc-length")
    with pytest.raises(ValueError, match="planar rational cubics"):
        lap.by_c(library, lap.room())


def test_without_a_compiler_there_is_no_kernel_and_no_error(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert ticks.compile_kernel(str(tmp_path)) is None


@pytest.mark.parametrize("name", ["SciPy PPoly", "SciPy BSpline", "OCCT"])
def test_other_libraries_are_given_the_same_curve(name):
    curve = cases.butterfly().curves[0]
    u = np.linspace(*curve.domain, 100)[1:-1]
    ours = curve.derivatives(u, 2)
    theirs = points.LIBRARIES[name](curve)(u)
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-11 * np.max(np.abs(ours)))


def test_a_library_that_is_missing_or_fails_is_named(monkeypatch):
    def missing(curve):
        raise ModuleNotFoundError

    def broken(curve):
        return lambda u: u[-len(u) - 1]

    monkeypatch.setattr(points, "LIBRARIES", {"splinefeed": points.splinefeed, "gone": missing, "broken": broken})
    found, excuses = points._libraries(cases.butterfly().curves[0], np.array([0.5]))
    assert list(found) == ["splinefeed"]
    assert excuses == {"gone": "not installed", "broken": "failed with IndexError"}


def test_quadrature_finds_the_parameter_of_an_arc_length():
    curve = cases.smooth().curves[0]
    u = arc.ByQuadrature(curve)(0.37 * curve.length)
    assert float(curve.arc_length(u)) == pytest.approx(0.37 * curve.length, rel=1e-12)


def test_online_steps_are_counted_in_whole_laps():
    lap = sf.interpolation.Interpolator(cases.butterfly(), cases.law()).ticks
    assert len(online.step_times("arc-length", lap + 1)) == 2 * lap


def test_a_stream_writes_every_tick_that_it_counts():
    written = stream.write(1.0, cases.PERIOD)
    assert written["ticks"] == sf.interpolation.Interpolator(cases.butterfly(), cases.law()).ticks
    assert written["laps"] == 1
    assert min(written["peak"], written["bytes"]) > 8 * written["ticks"]


def test_an_axis_of_each_kind_is_timed_over_every_tick():
    for machine, name in servo.AXES:
        for linear in (False, True):
            assert servo.AxisRun(machine, name, linear)() == servo.TICKS


def test_a_long_job_follows_every_tick_on_three_axes():
    done = servo.job(10.0 / 3600.0)
    assert done["ticks"] >= 10_000
    assert 0.0 < done["contour"] < 0.1


def test_a_path_of_lines_is_built_whole():
    built = paths.build(500)
    assert built["stops"] == 499 and built["peak"] >= built["before"] > 0
    points = np.cumsum(np.random.default_rng(0).normal(size=(501, 3)), axis=0)
    assert built["length"] == pytest.approx(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)), rel=1e-13)


def test_rounds_are_interleaved_after_one_that_does_not_count():
    calls = []
    times = timing.interleaved({name: lambda name=name: calls.append(name) for name in "ab"}, rounds=3)
    assert "".join(calls) == "ab" * 4
    assert {name: len(each.seconds) for name, each in times.items()} == {"a": 3, "b": 3}
    assert timing.Times((3.0, 1.0, 2.5)).least == 1.0
    assert timing.Times((3.0, 1.0, 2.5)).median == 2.5


def test_a_child_hands_back_what_its_function_returns_and_fails_when_it_fails():
    closing = "<!-- /benchmarks:a -->"
    text = f"<!-- benchmarks:a -->{closing}"
    assert child.outcome("tables", "between_markers", text, "a", "b") == f"<!-- benchmarks:a -->\nb\n{closing}"
    with pytest.raises(subprocess.CalledProcessError):
        child.outcome("tables", "no_such_function")


# --- tables ---------------------------------------------------------------------------------------------------------

TABLE = tables.Table(
    "What it is.",
    (tables.Column("name"), tables.Column("time, ns", ",.1f")),
    (("a", 1234.56), ("b|c", None), ("d", "not installed")),
    ("One note.",),
)


def test_a_table_aligns_numbers_to_the_right_and_says_what_is_missing():
    assert TABLE.markdown() == (
        "What it is.\n\n"
        "| name |      time, ns |\n"
        "| ---- | ------------: |\n"
        "| a    |       1,234.6 |\n"
        "| b\\|c |             - |\n"
        "| d    | not installed |\n\n"
        "One note."
    )


def test_a_row_of_another_length_is_refused():
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        tables.Table("", TABLE.columns, (("a",),)).as_dict()


def test_results_keep_the_entries_of_other_benchmarks(tmp_path):
    file = tmp_path / "results.json"
    tables.write_results(file, "points", {"date": "then"})
    tables.write_results(file, "arc", tables.Report((TABLE,)).as_dict())
    found = json.loads(file.read_text())
    assert list(found) == ["arc", "points"]
    assert found["arc"]["tables"][0]["rows"][0] == {"name": "a", "time, ns": 1234.56}
    assert tables.read_results(file) == found


def test_the_summary_says_what_was_missed():
    lines = [tables.Headline("one", "2 s", "1 s", False), tables.Headline("two", "1 ms", "2 ms", True)]
    text = tables.summary([*lines, tables.Headline("three", "no gcc")]).markdown()
    assert [line.split("|")[-2].strip() for line in text.splitlines()[4:]] == ["**missed**", "met", ""]


# --- the README -----------------------------------------------------------------------------------------------------

README = "# Title\r\n<!-- benchmarks:arc -->\nold\n<!-- /benchmarks:arc -->\nbetween\n<!-- benchmarks:ticks -->\n"


def test_only_what_stands_between_the_markers_is_replaced(tmp_path):
    file = tmp_path / "README.md"
    file.write_bytes(README.encode())
    file.chmod(0o640)
    assert tables.write_into(file, "arc", "new | Ünïcode")
    after = file.read_bytes().decode()
    assert after == README.replace("\nold\n", "\nnew | Ünïcode\n")
    assert tables.write_into(file, "arc", "new | Ünïcode")
    assert file.read_bytes().decode() == after
    assert file.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("name", ["ticks", "points", "ar"])
def test_without_both_markers_a_file_stays_as_it_is(tmp_path, name):
    file = tmp_path / "README.md"
    file.write_bytes(README.encode())
    assert not tables.write_into(file, name, "new")
    assert file.read_bytes() == README.encode()


def test_a_closing_marker_before_the_opening_one_does_not_count():
    text = "<!-- /benchmarks:arc --> <!-- benchmarks:arc -->"
    assert tables.between_markers(text, "arc", "new") is None


def test_a_file_that_is_not_there_is_not_made(tmp_path):
    assert not tables.write_into(tmp_path / "README.md", "arc", "new")
    assert not list(tmp_path.iterdir())


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(monkeypatch, tmp_path):
    file = tmp_path / "README.md"
    file.write_bytes(README.encode())

    def refuse(*_):
        raise OSError("no")

    monkeypatch.setattr("os.replace", refuse)
    with pytest.raises(OSError, match="no"):
        tables.write_whole(file, "new")
    assert file.read_bytes() == README.encode()
    assert list(tmp_path.iterdir()) == [file]


# --- the command ----------------------------------------------------------------------------------------------------


def test_the_command_prints_and_writes_what_it_measured(monkeypatch, tmp_path, capsys):
    readme = tmp_path / "README.md"
    readme.write_text(
        "".join(f"<!-- benchmarks:{name} -->\n<!-- /benchmarks:{name} -->\n" for name in ("arc", "speed"))
    )
    monkeypatch.setattr(command, "PAGES", (readme,))
    monkeypatch.setattr(command, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr(
        arc, "measure", lambda: tables.Report((TABLE,), (tables.Headline("arc", "1 ms", "2 ms", True),))
    )
    monkeypatch.setattr("sys.argv", ["benchmarks", "arc"])
    assert command.main() == 0
    text = readme.read_text()
    assert TABLE.markdown() in text
    assert "| arc  | 1 ms     | 2 ms   | met |" in text
    assert TABLE.markdown() in capsys.readouterr().out
    entry = json.loads((tmp_path / "results.json").read_text())["arc"]
    assert {"date", "processor", "versions", "tables", "headlines"} <= entry.keys()
    readme.write_text("<!-- benchmarks:arc -->\n<!-- /benchmarks:arc -->\n")
    monkeypatch.setattr("sys.argv", ["benchmarks", "--pages"])
    assert command.main() == 0
    assert TABLE.markdown() in readme.read_text()


@pytest.mark.parametrize("name", sorted(tables.read_results(command.RESULTS)))
def test_the_pages_show_what_was_measured_where_and_with_what(name):
    """No number of a table was typed: each block is what results.json gives, with versions and the machine below."""
    entry = tables.read_results(command.RESULTS)[name]
    text = command.page_text(name, entry)
    assert f"on {entry['processor']}" in text and f"Python {entry['versions']['python']}" in text
    block = f"<!-- benchmarks:{name} -->\n{text}\n<!-- /benchmarks:{name} -->"
    shown = [page.read_text(encoding="utf-8") for page in command.PAGES]
    shown = [page for page in shown if f"<!-- benchmarks:{name} -->" in page]
    assert shown and all(block in page for page in shown), "write them anew: make bench ARGS=--pages"


def test_two_columns_of_one_title_are_refused():
    with pytest.raises(ValueError, match="same title"):
        tables.Table("a table.", (tables.Column("worst"), tables.Column("worst")), ((1, 2),))


def test_a_rule_is_never_a_colon_alone():
    lines = tables.Table("a table.", (tables.Column("s", ".0f"),), ((1.0,),)).markdown().splitlines()
    assert lines[2:4] == ["|  s |", "| -: |"]


def test_an_unknown_benchmark_is_refused(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["benchmarks", "tick"])
    with pytest.raises(SystemExit, match="2"):
        command.main()
    assert "no benchmark is called 'tick'; there are ticks, points" in capsys.readouterr().err


@pytest.mark.parametrize("name", command.NAMES)
def test_every_name_of_the_command_is_a_module_that_measures(name):
    assert callable(import_module(f"benchmarks.{name}").measure)


def test_a_peers_plan_is_judged_by_its_setpoints_and_slowed_until_they_hold():
    """Constant acceleration along a line, twice too fast: a third difference sees its jumps of acceleration."""
    line = sf.Path([sf.NurbsCurve.bezier(np.array([[0.0, 0.0], [10.0, 0.0]]))])
    nodes = sampled.grid(line, 11)
    assert nodes == pytest.approx(np.linspace(0.0, 10.0, 11))

    def at(t):
        return np.where(t < 1.0, 5.0 * t**2, 10.0 - 5.0 * (2.0 - t) ** 2)

    profile = sampled.Profile(2.0, at, 0.0)
    shares = sampled.shares_at_setpoints(line, profile, (5.0, 10.0, 1000.0), 1e-3)
    assert shares == pytest.approx((2.0, 1.0, 10.0), rel=1e-3)
    held = sampled.stretched(line, (5.0, 10.0, 1e6), profile, 1e-3)
    assert held.duration == pytest.approx(4.0, rel=1e-3)
    assert max(sampled.shares_at_setpoints(line, held, (5.0, 10.0, 1e6), 1e-3)) <= 1.0 + 2.0 * sampled.HAIR


def test_copp_and_ours_agree_on_the_least_time_of_a_smooth_curve():
    """TOPP3 of copp-py, an independent planner: within its grid's error of ours, both holding the limits."""
    pytest.importorskip("copp_py", reason="copp-py is of the extra bench")
    limits = (60.0, 500.0, 20000.0)
    path = cases.airfoil12()
    theirs = sampled.stretched(path, limits, peer_copp.plan(path, limits, (400,)), 1e-3)
    feed, acceleration, jerk = limits
    asked = sf.Limits(feed=feed, axis_velocity=feed, axis_acceleration=acceleration, axis_jerk=jerk)
    ours = sf.plan(path, asked, strategy="time-optimal", period=1e-3)
    assert ours.duration < theirs.duration < 1.05 * ours.duration


def test_lines_of_a_file_become_checked_setpoints_with_and_without_measures(tmp_path):
    from benchmarks import long

    file = str(tmp_path / "lines.nc")
    long.write_program(file, 300)
    made, measured = long.by_windows(file), long.measured(file)
    assert made["ticks"] == measured["ticks"] > 1000
    assert made["size"] == pytest.approx(measured["size"], rel=0.1)
