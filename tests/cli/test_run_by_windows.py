"""`run` by windows: what it writes is what `check` on the whole path takes, and it leaves nothing half done."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import weakref
from contextlib import suppress

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.measures import chord_errors
from splinefeed.formats import long_files
from splinefeed.formats.long_files import read_parts
from splinefeed.paths.smoothing import smoothed
from splinefeed.runs import fold, long_path
from splinefeed.runs.run import MotionJob, carry_out


def short_lines(file, count: int) -> None:
    """A program of lines of 0.5 mm along a winding curve."""
    heading = np.cumsum(0.02 * np.sin(np.arange(count) / 40.0) + 0.003)
    at = np.cumsum(0.5 * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    lines = "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y in at.tolist())
    file.write_text(f"G21 G90\nG64 P0.01\nG0 X0 Y0\nG1 F3000\n{lines}M5\nM2\n")


@pytest.fixture
def program(folder):
    short_lines(folder / "part.nc", 2000)
    return "part.nc"


@pytest.fixture
def by_windows(monkeypatch):
    """Files of more than a thousand lines go by windows."""
    monkeypatch.setattr(long_files, "MOST_LINES", 1000)


LIMITS = ("--axis-accel", "1500", "--axis-jerk", "50000")


def test_its_setpoints_are_those_of_the_smoothed_path(splinefeed, program, by_windows):
    done = splinefeed("run", program, *LIMITS, "--smooth", "program", "--format", "csv", "--format", "hdf5",
                      "-o", "out", "--json")  # fmt: skip
    assert done.exit_code == 0
    page = json.loads(done.stdout)
    assert page["ok"]
    assert (page["strategy"], page["method"]) == ("look-ahead", "arc-length")
    assert {"out/run.json", "out/setpoints.csv", "out/setpoints.h5", "out/motion.svg"} <= set(page["files"])
    points = sf.load("out/setpoints.h5")
    assert len(points) == page["ticks"] == len(sf.load("out/setpoints.csv"))
    assert "--smooth program" in page["command"]
    path = smoothed(sf.read(program), "program", corners="round")
    limits = sf.Limits(feed=50, axis_acceleration=1500, axis_jerk=50000)
    verdict = sf.check(points, path, limits)
    assert verdict.ok, verdict.problems
    assert page["length_mm"] == pytest.approx(path.length, rel=1e-12)
    for name, limit in verdict.limits.items():
        assert page["limits"][name]["worst"] == pytest.approx(limit.worst, rel=1e-6)
    again = splinefeed("check", "out/setpoints.h5", "--feed", "50", *LIMITS)  # the file names its program
    assert again.exit_code == 0, again.stderr


def test_its_numbers_are_those_of_the_whole_path(splinefeed, program, by_windows, monkeypatch):
    """Every measure of chunks on parts of the path is that of the same setpoints on the path in one."""
    monkeypatch.setattr(fold, "CHUNK", 900)
    monkeypatch.setattr(long_path.windows, "__defaults__", (900,))
    done = splinefeed("run", program, *LIMITS, "--smooth", "program", "--chord-error", "0.002", "--machine", "router",
                      "--axis-velocity", "200", "-o", "out", "--json")  # fmt: skip
    page = json.loads(done.stdout)
    points, path = sf.load("out/setpoints.h5", sf.Setpoints), smoothed(sf.read(program), "program", corners="round")
    assert len(points) > 10 * 900
    assert page["chord_error_max_mm"] == pytest.approx(float(np.max(chord_errors(points, path))), rel=1e-9)
    assert page["ripple_max"] < 1e-6
    for k, axis in enumerate(path.axes):
        velocity = np.abs(np.diff(points.position[:, k])) / points.period
        acceleration = np.abs(np.diff(points.position[:, k], n=2)) / points.period**2
        assert page["axes"][axis]["velocity"] == pytest.approx(velocity.max(), rel=1e-3)
        assert page["axes"][axis]["acceleration"] == pytest.approx(acceleration.max(), rel=1e-2)
    response = sf.runs.follow(points, "router", path=path)
    written = sf.load("out/response.h5", sf.Response)
    assert np.array_equal(written.position, response.position)
    assert np.max(np.abs(written.contour_error - response.contour_error)) < 1e-9
    assert page["contour_error_max_mm"] == pytest.approx(response.contour_error.max(), abs=1e-9)
    assert page["setpoints_off_law_mm"] < 1e-9 if "setpoints_off_law_mm" in page else True
    assert sum(page["bound_by"].values()) == pytest.approx(1.0)
    assert {"out/path.svg", "out/motion.svg", "out/binding.svg", "out/report.html"} <= set(page["files"])


def test_the_size_of_the_file_makes_the_choice(splinefeed, refused, folder, monkeypatch):
    short_lines(folder / "part.nc", 400)
    words = ("run", "part.nc", *LIMITS, "--smooth", "program", "--no-figures", "--json")
    monkeypatch.setattr(long_files, "MOST_LINES", 405)  # it has one line more
    page = json.loads(splinefeed(*words, "-o", "long").stdout)
    assert any(note.startswith("read in parts: the time law is not kept") for note in page["notes"])
    said = "--strategy time-optimal: needs the whole path"
    assert said in refused(*words, "--strategy", "time-optimal")
    monkeypatch.setattr(long_files, "MOST_LINES", 406)
    whole = json.loads(splinefeed(*words, "-o", "short", "--strategy", "look-ahead").stdout)
    assert whole["ripple_max"] > 0.0
    assert whole["duration_s"] == pytest.approx(page["duration_s"], rel=1e-2)


def test_a_table_of_points_is_smoothed(splinefeed, by_windows):
    at = np.linspace(0.0, 20.0, 4000)
    np.savetxt("scan.csv", np.column_stack([at, np.sin(at)]), delimiter=",")
    done = splinefeed("run", "scan.csv", "--feed", "40", *LIMITS, "--tolerance", "0.002mm")
    assert done.exit_code == 0, done.stderr
    assert "checked: every limit holds" in done.stdout
    assert "smoothed: 3999 curve(s) became" in done.stdout
    points = sf.load("splinefeed-scan/setpoints.h5")
    assert np.max(np.abs(points.position[:, 1] - np.sin(points.position[:, 0]))) < 0.003


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--strategy", "time-optimal"), "--strategy time-optimal: needs the whole path; a file of more than 1000"),
        (("--method", "taylor-2"), "--method taylor-2: needs the whole path"),
        (("--compare",), "--compare: needs the whole path"),
        (("--3d",), "--3d: needs the whole path"),
        (("--tolerance", "0.01"), "--tolerance: is for tables of points; use --smooth LENGTH for a program"),
        (("--layer", "0"), "option 'layer' is not one of a G-code file"),
    ],
)  # fmt: skip
def test_what_cannot_go_by_windows_is_said(refused, program, by_windows, words, said):
    assert said in refused("run", program, *words)


def test_a_file_of_another_kind_is_read_as_a_whole(folder):
    said = "smooth.json: JSON curve is read as a whole; G-code and tables of points can be read in parts"
    with pytest.raises(sf.errors.FormatError, match=said):
        read_parts("smooth.json")


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_ctrl_c_leaves_nothing_half_written(tmp_path):
    short_lines(tmp_path / "part.nc", 1_000_000)

    def written() -> int:
        """Bytes of the setpoints so far."""
        sizes = [0]
        for each in tmp_path.glob("splinefeed-part/.*/.*.h5"):
            with suppress(OSError):
                sizes.append(each.stat().st_size)
        return max(sizes)

    with subprocess.Popen(
        [sys.executable, "-m", "splinefeed", "run", "part.nc", *LIMITS, "--smooth", "program"],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            while written() < 2**14:
                assert process.poll() is None, process.stderr.read()
                time.sleep(0.02)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=300)
        finally:
            process.kill()
    assert process.returncode == 130
    assert "interrupted; no half-written file is left" in said
    assert [each.name for each in tmp_path.iterdir()] == ["part.nc"]


class Watcher:
    """How many parts of a path are there at the most."""

    def __init__(self, alive) -> None:
        self.alive, self.highest = alive, 0

    def start(self, chunk) -> None:
        pass

    def feed(self, chunk) -> None:
        self.highest = max(self.highest, len(self.alive))

    def finish(self) -> None:
        pass


def test_parts_are_forgotten_whatever_the_length(tmp_path):
    """Of a program twice as long no more is held."""
    most = []
    for count in (20_000, 40_000):
        short_lines(tmp_path / "part.nc", count)
        parts = read_parts(tmp_path / "part.nc")
        alive: weakref.WeakSet[sf.Path] = weakref.WeakSet()

        def watched(made=parts.make, alive=alive):
            for part in made():
                alive.add(part)
                yield part

        object.__setattr__(parts, "make", watched)
        limits = sf.Limits(feed=50, axis_acceleration=1500, axis_jerk=50000)
        job = MotionJob(parts, limits, period=5e-3, reading={"smooth": 0.01})
        watcher = Watcher(alive)
        made = carry_out(job, meters=[watcher])
        assert made.ok, made.verdict.problems
        most.append(watcher.highest)
    assert most[1] <= most[0] + 1 <= 6
